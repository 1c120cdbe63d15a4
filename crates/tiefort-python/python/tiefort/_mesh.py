"""Meshes: from heights, to files and to other packages."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Callable

import numpy as np
import numpy.typing as npt

from . import _tiefort
from ._errors import RequestError
from ._inputs import Affine6, Path, alone, is_path, path_of, places_of, posts_of
from ._progress import Progress, Teller

if TYPE_CHECKING:
    from geopandas import GeoDataFrame
    from meshio import Mesh as MeshioMesh
    from pyvista import PolyData
    from trimesh import Trimesh


@dataclass(frozen=True)
class Residual:
    """How far heights lie from a mesh, in metres, over all posts that have one.

    Attributes
    ----------
    rms_m, max_m, mean_abs_m : float
        Root mean square, largest, and mean of the absolute residuals.
    p95_m, p99_m : float or None
        95 and 99 of 100 posts are within; None for load modules.
    """

    rms_m: float
    max_m: float
    mean_abs_m: float | None = None
    p95_m: float | None = None
    p99_m: float | None = None


class Mesh:
    """Triangles over ground. A pickled mesh of heights keeps its arrays and figures, and cannot be saved.

    Attributes
    ----------
    vertices : ndarray of float64, shape (n, 3)
        East, north and height of each, in metres; read-only, as are triangles and classes of what tiefort made.
    triangles : ndarray of uint32, shape (m, 3)
        Vertices of each, counter-clockwise seen from above.
    residual : Residual
        Against the heights that it was made from.
    crs : str or None
        Its coordinate system, as ``EPSG:32611``; None where it is not known.
    transform : tuple of six float, or None
        Where the posts lie that it was made from, as rasterio has it: ``x = a col + b row + c``, ``y = d col + e row +
        f`` for corners of pixels, whose middles are posts. None for load modules.
    classes : ndarray of uint8, shape (m,), or None
        Class of the ground under each triangle of a load module, 255 over holes. None for others.
    stop : str or None
        Why a mesh of heights has no more vertices.
    seconds : float
        What the library took to make a mesh of heights.
    """

    def __init__(
        self,
        vertices: npt.NDArray[np.float64],
        triangles: npt.NDArray[np.uint32],
        residual: Residual,
        crs: str | None,
        *,
        tin: _tiefort.Tin | None = None,
        exported: list[str] | None = None,
        classes: npt.NDArray[np.uint8] | None = None,
    ) -> None:
        if tin is not None or exported is not None:
            # Copies of what save and sample read: a change here would not reach them.
            copies: list[npt.NDArray[Any] | None] = [vertices, triangles, classes]
            for array in copies:
                if array is not None:
                    array.flags.writeable = False
        self.vertices = vertices
        self.triangles = triangles
        self.residual = residual
        self.crs = crs
        self.classes = classes
        self.transform: Affine6 | None = None
        self.stop: str | None = None
        self.seconds = 0.0
        self._tin = tin
        self._exported = exported
        if tin is not None:
            (west, south), (east_step, north_step), (rows, _) = tin.grid
            north = south + north_step * (rows - 1)
            self.transform = (east_step, 0.0, west - east_step / 2, 0.0, -north_step, north + north_step / 2)
            self.stop, self.seconds = tin.stop, tin.seconds

    @classmethod
    def _of_tin(cls, tin: _tiefort.Tin) -> Mesh:
        crs = None if tin.epsg is None else f"EPSG:{tin.epsg}"
        return cls(tin.vertices(), tin.triangles(), Residual(**tin.residual()), crs, tin=tin)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_tin": None}

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles, RMS {self.residual.rms_m:.3f} m)"

    def save(self, path: Path, *, coordinates: str = "local") -> None:
        """Write it to a file, with the bytes that the command line writes.

        Parameters
        ----------
        path : path
            A name that ends in ``.ply``, ``.obj`` or ``.glb``.
        coordinates : {"local", "map"}
            Metres from the south-west corner, or on the map (for ply and obj).

        Raises
        ------
        RequestError, OutputError
        """
        if coordinates not in ("local", "map"):
            raise RequestError(f"coordinates: found {coordinates!r}, expected local or map", "local is from the corner")
        name = path_of(path)
        if self._tin is not None:
            self._tin.save(name, coordinates == "map")
        elif self._exported is not None:
            kind = name.rsplit(".", 1)[-1].lower()
            kind = kind if kind in ("ply", "obj", "glb") else "ply"
            words = ["--format", kind, f"--out={name}", "--coordinates", coordinates]
            _tiefort.export([*self._exported, *words])
        else:
            raise RequestError("found a mesh that was not made here, expected one of tiefort", "write it with meshio")

    def sample(self, xy: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return heights of the mesh.

        Parameters
        ----------
        xy : array_like, shape (..., 2)
            East and north in metres.

        Returns
        -------
        ndarray of float64, shape (...)
            Metres; NaN outside of the mesh.
        """
        rows, shape = places_of(xy)
        if self._tin is not None:
            return self._tin.heights(rows).reshape(shape)
        return _tiefort.heights_within(self.vertices, self.triangles, rows).reshape(shape)

    def to_trimesh(self) -> Trimesh:
        """Return a ``trimesh.Trimesh``, in metres on the map."""
        import trimesh

        return trimesh.Trimesh(self.vertices.copy(), self.triangles.astype(np.int64), process=False)

    def to_pyvista(self) -> PolyData:
        """Return a ``pyvista.PolyData``, in metres on the map."""
        import pyvista

        faces = np.column_stack((np.full(len(self.triangles), 3), self.triangles.astype(np.int64)))
        mesh = pyvista.PolyData(self.vertices.copy(), faces.ravel())
        if self.classes is not None:
            mesh.cell_data["class"] = self.classes
        return mesh

    def to_meshio(self) -> MeshioMesh:
        """Return a ``meshio.Mesh``, in metres on the map."""
        import meshio

        data = None if self.classes is None else {"class": [self.classes.copy()]}
        return meshio.Mesh(self.vertices.copy(), [("triangle", self.triangles.astype(np.int64))], cell_data=data)

    def to_geopandas(self) -> GeoDataFrame:
        """Return a ``geopandas.GeoDataFrame`` with a polygon of three corners for each triangle."""
        import geopandas
        import shapely

        corners = self.vertices[self.triangles]
        data = {} if self.classes is None else {"class": self.classes}
        return geopandas.GeoDataFrame(data, geometry=shapely.polygons(corners), crs=self.crs)


def tin(
    dem: Any,
    triangles: int | None = None,
    points: int | None = None,
    max_residual_m: float | None = None,
    rms_m: float | None = None,
    method: str | None = None,
    effort: str | None = None,
    tiles: tuple[int, int] | str | None = None,
    *,
    crs: Any = None,
    transform: Any = None,
    spacing_m: float | None = None,
    nodata: float | None = None,
    key: str | None = None,
    height_fit: str | None = None,
    lattice: str | None = None,
    start: Path | None = None,
    workers: int | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Mesh:
    """Make a mesh of heights: the truest that so many triangles or points allow.

    The first of `triangles` or `points`, `max_residual_m` and `rms_m` that is reached ends it; one at least is given.

    Parameters
    ----------
    dem : array_like, xarray.DataArray, rasterio dataset or path
        Heights in metres, shape (rows, columns), the northern row first; float32, float64, int16 or int32 (smaller
        types are widened). NaN is void, and so is `nodata`. A DataArray and a dataset bring their system and their
        transform.
    triangles, points : int, optional
        Triangles, or vertices, at most. `triangles` is for the optimised method.
    max_residual_m, rms_m : float, optional
        Largest residual to accept, and root mean square to reach, in metres.
    method : {"optimised", "paper", "greedy"}, optional
        Which post comes next; optimised unless said otherwise.
    effort : {"fast", "normal", "best"}, optional
        How long the optimised method tries; normal unless said otherwise.
    tiles : (int, int) or str, optional
        Rows and columns of tiles that are refined at once, their borders matched.
    crs : str, int or object with ``to_epsg``, optional
        Coordinate system of an array. One in degrees is resampled to metres, as the command line does.
    transform : six numbers or affine.Affine, optional
        Where an array lies, as rasterio has it.
    spacing_m : float, optional
        Metres between posts of an array without a transform, whose south-west post is then at (0, 0); 1 unless given.
    nodata : float, optional
        Height that marks a void.
    key : {"max", "sse"}, optional
        What makes a post worth a point, for the greedy method.
    height_fit, lattice : str, optional
        Where the optimised method may put vertices; as in a job.
    start : str or path, optional
        ``METHOD:N``, or a file of points (``.csv``, ``.geojson``) to start from.
    workers : int, optional
        Tiles at once; as many as cores unless given.
    progress : callable, optional
        Called with a `Progress` for everything that happens. What it raises ends the run.

    Returns
    -------
    Mesh

    Raises
    ------
    RequestError
        When what is asked for cannot be.
    SourceError
        When heights cannot be used.

    Warns
    -----
    TiefortWarning
        What a person should know about the heights.
    """
    words: list[str] = []
    for name, count in (("triangles", triangles), ("points", points), ("workers", workers)):
        if count is not None:
            words.append(f"--{name}={operator.index(count)}")
    for name, metres in (("max-residual", max_residual_m), ("rms", rms_m)):
        if metres is not None:
            words.append(f"--{name}={float(metres)!r}")
    named = (("method", method), ("effort", effort), ("key", key), ("height-fit", height_fit), ("lattice", lattice))
    words += [f"--{name}={value}" for name, value in named if value is not None]
    if tiles is not None:
        words.append(f"--tiles={tiles if isinstance(tiles, str) else f'{tiles[0]}x{tiles[1]}'}")
    if start is not None:
        words.append(f"--start={path_of(start)}")
    told = Teller(progress)
    if is_path(dem):
        alone(crs, transform, spacing_m, nodata)
        return Mesh._of_tin(_tiefort.tin_of_file(path_of(dem), words, told))
    posts = posts_of(dem, crs, transform, spacing_m, nodata)
    return Mesh._of_tin(_tiefort.tin_of_array(posts.array, posts.placed, words, told))
