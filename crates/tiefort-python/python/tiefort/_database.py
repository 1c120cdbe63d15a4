"""A finished terrain database, asked for heights and lines of sight."""

from __future__ import annotations

import json
import math
import operator
import os
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Callable

import numpy as np
import numpy.typing as npt

from . import _tiefort
from ._errors import RequestError
from ._inputs import Affine6, Path, path_of, places_of
from ._mesh import Mesh, Residual
from ._report import Report

if TYPE_CHECKING:
    from geopandas import GeoDataFrame
    from xarray import DataArray

# Targets of a viewshed that are asked for at once, and most of them: a gigabyte of answers.
_AT_ONCE = 1 << 20
_VIEWSHED_MAX = 1 << 28


@dataclass(frozen=True, eq=False)
class LineOfSight:
    """What stands between places.

    Attributes
    ----------
    visible : ndarray of bool, shape (...)
        Whether nothing does. False where a line leaves the area.
    known : ndarray of bool, shape (...)
        Whether the area holds enough ground to say.
    blocker : ndarray of float64, shape (..., 3)
        East, north and height of the first place that hides the rest; NaN where nothing does.
    clearance_m : ndarray of float64, shape (...)
        How far the whole line stays above the ground at least, in metres; negative where the ground rises above it,
        NaN where it leaves the area. Decks of bridges and objects are not counted.
    hidden_by : ndarray of str, shape (...)
        ``"ground"``, ``"deck"``, ``"building"``, ``"wood"``, ``"row"`` (a hedge or row of trees) or ``"wall"``; empty
        where nothing hides.
    transmission : ndarray of float64, shape (...)
        The share of light that woods leave on the way to the target, or to the first thing that lets none through.
    """

    visible: npt.NDArray[np.bool_]
    known: npt.NDArray[np.bool_]
    blocker: npt.NDArray[np.float64]
    clearance_m: npt.NDArray[np.float64]
    hidden_by: npt.NDArray[np.str_]
    transmission: npt.NDArray[np.float64]


@dataclass(frozen=True)
class Obstacle:
    """What stands in a vehicle's way.

    Attributes
    ----------
    kind : str
        ``"building"``, ``"tower"``, ``"wall"``, ``"wood"``, ``"scrub"``, ``"orchard"`` or ``"row"``.
    id : int
        The number of all of its pieces.
    distance_m : float
        Metres from the place to it; 0 inside.
    spacing_m : float or None
        Metres between stems; None of what cannot be passed.
    """

    kind: str
    id: int
    distance_m: float
    spacing_m: float | None


@dataclass(frozen=True, eq=False)
class Viewshed:
    """What is seen from one place.

    Attributes
    ----------
    visible : ndarray of bool, shape (rows, columns)
        The northern row first; False beyond the range and outside the area.
    at : (float, float, float)
        East, north and height of the eye.
    transform : tuple of six float
        Where the grid lies, as rasterio has it.
    crs : str
        Its coordinate system.
    """

    visible: npt.NDArray[np.bool_]
    at: tuple[float, float, float]
    transform: Affine6
    crs: str

    def to_xarray(self) -> DataArray:
        """Return an ``xarray.DataArray``."""
        return _data_array(self.visible, self.transform, self.crs, "visible")


@dataclass(frozen=True, eq=False)
class Profile:
    """The ground along a line.

    Attributes
    ----------
    along_m : ndarray of float64, shape (n,)
        Metres from the beginning, along the line.
    places : ndarray of float64, shape (n, 2)
        East and north.
    heights : ndarray of float64, shape (n,)
        Heights of the ground; NaN outside of the area.
    decks : ndarray of float64, shape (n,)
        Heights of the topmost deck above it; NaN where there is none.
    classes : ndarray of uint8, shape (n,)
        255 over holes and outside of the area.
    crs : str
        The coordinate system.
    """

    along_m: npt.NDArray[np.float64]
    places: npt.NDArray[np.float64]
    heights: npt.NDArray[np.float64]
    decks: npt.NDArray[np.float64]
    classes: npt.NDArray[np.uint8]
    crs: str


def open(path: Path) -> Database:
    """Open a terrain database that a build has finished.

    Raises
    ------
    DatabaseError
        When it is none, unfinished or damaged.
    """
    return Database(path)


class Database:
    """A finished terrain database; a context manager, which closes it.

    Attributes
    ----------
    crs : str
        Coordinate system, as ``EPSG:32611``.
    bounds : (float, float, float, float)
        West, south, east and north, in metres.
    spacing_m : float
        Metres between posts of the working grid.
    shape : (int, int)
        Rows and columns of load modules, counted from the south-west.
    levels : int
        Levels of detail; 0 is the finest.
    vertical_datum : str
        What heights are above; empty where that is not known.
    """

    def __init__(self, path: Path) -> None:
        self._path = path_of(path)
        self._ground = _tiefort.Ground(self._path)
        frame = self._ground.frame()
        self.spacing_m, self._report = self._ground.told()
        self.crs: str = frame["crs"]
        self.vertical_datum: str = frame["vertical_datum"]
        self.levels: int = frame["levels"]
        self.shape: tuple[int, int] = (frame["rows"], frame["cols"])
        self.module_side_m: float = frame["side_m"]
        west, south = frame["origin_m"]
        rows, cols = self.shape
        self.bounds: tuple[float, float, float, float] = (
            west,
            south,
            west + cols * self.module_side_m,
            south + rows * self.module_side_m,
        )

    def __enter__(self) -> Database:
        return self

    def __reduce__(self) -> tuple[Callable[[Path], Database], tuple[Path]]:
        # Another process opens it again.
        return open, (self._path,)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        rows, cols = self.shape
        return f"Database({self._path!r}, {rows} x {cols} load modules, {self.crs})"

    def close(self) -> None:
        """Let go of files and memory; what is asked after that raises `ClosedError`."""
        self._ground.close()

    @property
    def report(self) -> Report:
        """What the build found."""
        return Report(self._report)

    def heights(self, xy: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return heights of the ground.

        Parameters
        ----------
        xy : array_like, shape (..., 2)
            East and north in metres.

        Returns
        -------
        ndarray of float64, shape (...)
            Metres above the vertical datum; NaN outside of the area.
        """
        places, shape = places_of(xy)
        return self._ground.heights(places).reshape(shape)

    def normals(self, xy: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return unit vectors out of the ground: east, north, up.

        Parameters
        ----------
        xy : array_like, shape (..., 2)
            East and north in metres.

        Returns
        -------
        ndarray of float64, shape (..., 3)
            NaN outside of the area.
        """
        places, shape = places_of(xy)
        return self._ground.normals(places).reshape((*shape, 3))

    def classes(self, xy: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """Return classes of the ground.

        Parameters
        ----------
        xy : array_like, shape (..., 2)
            East and north in metres.

        Returns
        -------
        ndarray of uint8, shape (...)
            255 over holes and outside of the area.
        """
        places, shape = places_of(xy)
        return self._ground.classes(places).reshape(shape)

    def tops(self, xy: npt.ArrayLike, *, woods: bool = True) -> npt.NDArray[np.float64]:
        """Return heights of what lies on top: the highest of the ground, decks, roofs and, unless left out, woods.

        Parameters
        ----------
        xy : array_like, shape (..., 2)
            East and north in metres.
        woods : bool
            Whether tops of woods count; without them it is where someone can stand.

        Returns
        -------
        ndarray of float64, shape (...)
            Metres above the vertical datum; NaN outside of the area.
        """
        places, shape = places_of(xy)
        return self._ground.tops(places, bool(woods)).reshape(shape)

    def obstacle_at(self, at: npt.ArrayLike, radius_m: float, *, wheels_m: float | None = None) -> Obstacle | None:
        """Return what a vehicle hits, or None where its way is free.

        That is the nearest building, tower or wall between 0.3 and 3 m above its wheels, else the wood or row whose
        stems stand closest together.

        Parameters
        ----------
        at : array_like, shape (2,)
            East and north of the vehicle, in metres.
        radius_m : float
            How far it reaches around that.
        wheels_m : float, optional
            Height of its wheels above the vertical datum; the ground's unless given.
        """
        places, shape = places_of(at, name="at")
        if shape != ():
            raise RequestError(f"at: found {len(places)} places, expected one", "call obstacle_at once for each")
        if not (math.isfinite(radius_m) and 0 <= radius_m):
            raise RequestError(f"radius_m: found {radius_m}, expected 0 or a number above it", "in metres")
        ground_m = float(self._ground.heights(places)[0])
        if math.isnan(ground_m):
            raise RequestError(
                f"at: found {places[0].tolist()}, expected a place in the area", "east and north in metres"
            )
        height_m = ground_m if wheels_m is None else float(wheels_m)
        if not math.isfinite(height_m):
            raise RequestError(f"wheels_m: found {height_m}, expected a height", "in metres above the vertical datum")
        hit = self._ground.obstacle((float(places[0, 0]), float(places[0, 1]), height_m), float(radius_m))
        return None if hit is None else Obstacle(*hit)

    def line_of_sight(
        self, a: npt.ArrayLike, b: npt.ArrayLike, *, absolute: bool = False, objects: str = "all"
    ) -> LineOfSight:
        """Return what stands between places; `a` and `b` are broadcast against each other.

        Parameters
        ----------
        a, b : array_like, shape (..., 3)
            East, north and height of eyes and of targets, in metres.
        absolute : bool
            Whether heights are above the vertical datum; they are above the ground unless said so, as they are for
            ``tiefort sight``.
        objects : {"all", "buildings", "none"}
            What stands on the ground and is looked at: all, buildings with towers and walls, or nothing.

        Returns
        -------
        LineOfSight
            An end above the ground where there is no ground makes the answer unknown.
        """
        lines, shape = self._lines(a, b, absolute)
        share, clearance_m, transmission, by = self._ground.sights(lines, objects).T
        hidden = share <= 1.0
        blocker = np.where(hidden[:, None], lines[:, :3] + share[:, None] * (lines[:, 3:] - lines[:, :3]), np.nan)
        return LineOfSight(
            (share == 2.0).reshape(shape),
            ~np.isnan(share).reshape(shape),
            blocker.reshape((*shape, 3)),
            clearance_m.reshape(shape),
            np.array(self._ground.hiders())[by.astype(np.int64)].reshape(shape),
            transmission.reshape(shape),
        )

    def visible(
        self, a: npt.ArrayLike, b: npt.ArrayLike, *, absolute: bool = False, objects: str = "all"
    ) -> npt.NDArray[np.bool_]:
        """Return whether nothing stands between places: `line_of_sight` without the rest, in less time."""
        lines, shape = self._lines(a, b, absolute)
        return self._ground.seen(lines, objects).reshape(shape)

    def _lines(
        self, a: npt.ArrayLike, b: npt.ArrayLike, absolute: bool
    ) -> tuple[npt.NDArray[np.float64], tuple[int, ...]]:
        """Both ends of every line, with heights above the datum, and the shape of what is answered."""
        ends = [places_of(place, 3, name) for place, name in ((a, "a"), (b, "b"))]
        if not absolute:
            ends = [(self._raised(rows), shape) for rows, shape in ends]
        (eyes, of_eyes), (targets, of_targets) = ends
        try:
            shape = np.broadcast_shapes(of_eyes, of_targets)
        except ValueError as error:
            message = f"found {of_eyes} places a and {of_targets} places b, expected as many, or one"
            raise RequestError(message, "shapes follow NumPy's rules of broadcasting") from error
        lines = np.empty((*shape, 6))
        lines[..., :3] = eyes.reshape((*of_eyes, 3))
        lines[..., 3:] = targets.reshape((*of_targets, 3))
        return lines.reshape(-1, 6), shape

    def _raised(self, places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Places whose heights are above the ground, with heights above the datum."""
        ground = self._ground.heights(np.ascontiguousarray(places[:, :2]))
        return np.column_stack((places[:, :2], places[:, 2] + ground))

    def profile(self, *places: npt.ArrayLike, spacing_m: float = 10.0) -> Profile:
        """Return the ground along a line, as ``tiefort profile`` does: ``profile(a, b)``.

        Parameters
        ----------
        *places : array_like, shape (2,)
            East and north of two or more places that it goes through, straight from one to the next, in metres.
        spacing_m : float
            Metres between heights at most; the places are among them.

        Returns
        -------
        Profile
        """
        if len(places) < 2:
            raise RequestError(f"profile: found {len(places)} places, expected two or more", "profile(a, b)")
        rows = []
        for number, place in enumerate(places):
            row, shape = places_of(place, name=f"place {number}")
            if shape != ():
                message = f"place {number}: found {len(row)} places, expected one"
                raise RequestError(message, "profile(*places) goes through all of an array")
            rows.append(row)
        through = np.concatenate(rows)
        if not (math.isfinite(spacing_m) and 0 < spacing_m):
            raise RequestError(f"spacing_m: found {spacing_m}, expected a number above 0", "in metres")
        steps = float(np.hypot(*np.diff(through, axis=0).T).sum()) / spacing_m
        if not steps <= _VIEWSHED_MAX:
            raise RequestError(f"found {steps:.0f} heights, expected at most {_VIEWSHED_MAX}", "a larger spacing_m")
        along, east, north, height, deck, ofclass = self._ground.profile(through, float(spacing_m)).T
        return Profile(along, np.column_stack((east, north)), height, deck, ofclass.astype(np.uint8), self.crs)

    def viewshed(
        self,
        at: npt.ArrayLike,
        range_m: float,
        *,
        eye_m: float = 2.0,
        target_m: float = 0.0,
        spacing_m: float | None = None,
        objects: str = "all",
        target_on: str = "ground",
    ) -> Viewshed:
        """Return what is seen from one place, as ``tiefort sight`` does.

        Parameters
        ----------
        at : array_like, shape (2,)
            East and north of the eye, in metres.
        range_m : float
            How far it sees, in metres.
        eye_m, target_m : float
            Metres of the eye and of what it looks at above the ground.
        spacing_m : float, optional
            Metres between the places that it looks at; those of the working grid unless given.
        objects : {"all", "buildings", "none"}
            What stands on the ground and is looked at.
        target_on : {"ground", "roof"}
            Whether what it looks at stands on the ground, or on roofs and decks where there are any.

        Returns
        -------
        Viewshed
        """
        places, shape = places_of(at, name="at")
        if shape != ():
            raise RequestError(f"at: found {len(places)} places, expected one", "call viewshed once for each")
        spacing_m = self.spacing_m if spacing_m is None else float(spacing_m)
        numbers = (("range_m", range_m), ("spacing_m", spacing_m))
        for name, metres in numbers:
            if not (math.isfinite(metres) and 0 < metres):
                raise RequestError(f"{name}: found {metres}, expected a number above 0", "in metres")
        east, north = map(float, places[0])
        ground_m = float(self.heights(places)[0])
        if math.isnan(ground_m):
            raise RequestError(f"at: found {east}, {north}, where there is no ground", f"the area is {self.bounds}")
        reach = int(range_m // spacing_m)
        if _VIEWSHED_MAX < (2 * reach + 1) ** 2:
            message = f"found {2 * reach + 1} x {2 * reach + 1} places to look at, expected at most {_VIEWSHED_MAX}"
            raise RequestError(message, "ask for a larger spacing_m or a smaller range_m")
        if target_on not in ("ground", "roof"):
            raise RequestError(f"target_on: found {target_on!r}, expected ground or roof", "where it stands")
        steps = np.arange(-reach, reach + 1) * spacing_m
        dx, dy = np.meshgrid(steps, steps[::-1])
        inside = dx**2 + dy**2 <= range_m**2
        targets = np.column_stack((east + dx[inside], north + dy[inside]))
        eye = (east, north, ground_m + eye_m)
        seen = np.zeros(len(targets), bool)
        for first in range(0, len(targets), _AT_ONCE):
            part = targets[first : first + _AT_ONCE]
            heights = (self.tops(part, woods=False) if target_on == "roof" else self.heights(part)) + target_m
            places = np.column_stack((part, heights))
            seen[first : first + _AT_ONCE] = self.visible(eye, places, absolute=True, objects=objects)
        visible = np.zeros(inside.shape, bool)
        visible[inside] = seen
        corner = (reach + 0.5) * spacing_m
        transform = (spacing_m, 0.0, east - corner, 0.0, -spacing_m, north + corner)
        return Viewshed(visible, eye, transform, self.crs)

    def module(self, row: int, col: int, level: int = 0) -> Mesh:
        """Return one load module, its row and column counted from the south-west, at a level of detail.

        The mesh lies on the map, in metres; its `classes` are those of the ground under its triangles. Decks of bridges
        are not in it.
        """
        row, col, level = (_index(name, number) for name, number in (("row", row), ("col", col), ("level", level)))
        vertices, triangles, classes, figures = self._ground.module(row, col, level)
        known = figures["posts"] != 0
        rms_m, mean_abs_m = (figures[name] if known else math.nan for name in ("rms_m", "mean_abs_m"))
        residual = Residual(rms_m, figures["max_m"], mean_abs_m)
        exported = [self._path, f"--modules={row},{col}", f"--lod={level}"]
        return Mesh(vertices, triangles, residual, self.crs, exported=exported, classes=classes)

    @property
    def modules(self) -> GeoDataFrame:
        """All load modules as a ``geopandas.GeoDataFrame``: a square each, with counts and residuals."""
        import geopandas
        import shapely

        table = self._ground.modules()
        counts = {
            name: table[:, place].astype(np.int64)
            for place, name in enumerate(("row", "col", "triangles", "vertices", "posts"))
        }
        west, south = self.bounds[:2]
        left = west + table[:, 1] * self.module_side_m
        low = south + table[:, 0] * self.module_side_m
        squares = shapely.box(left, low, left + self.module_side_m, low + self.module_side_m)
        columns = {**counts, "rms_m": table[:, 5], "max_m": table[:, 6]}
        return geopandas.GeoDataFrame(columns, geometry=squares, crs=self.crs)

    def features(self, layer: str = "lines") -> GeoDataFrame:
        """Return what became of roads, rivers and lakes, as a ``geopandas.GeoDataFrame``.

        Parameters
        ----------
        layer : {"lines", "nodes", "decks", "culverts", "remarks"}
            Lines that are edges of the ground, stations of them, decks of bridges, culverts, or what was mended,
            degraded or left out, with its place.

        Raises
        ------
        RequestError
            When the database has no features, or there is no such layer.
        """
        self._ground.frame()
        file = os.path.join(self._path, "features.gpkg")
        if not os.path.exists(file):
            raise RequestError(f"{self._path}: found no features", "a job has them in its section [features]")
        import geopandas

        known = list(geopandas.list_layers(file)["name"])
        if layer not in known:
            raise RequestError(f"layer: found {layer!r}, expected {_words(known)}", "one layer for each call")
        return geopandas.read_file(file, layer=layer)

    def objects(self) -> GeoDataFrame:
        """Return what stands on the ground, as a ``geopandas.GeoDataFrame``: a row for each piece in a load module.

        Columns are `kind`, `id` (of all pieces of one object), `base_m` and `roof_m` of buildings, towers and walls
        above the vertical datum, `height_m` above the ground, `fullness` and `spacing_m` of woods and rows; NaN
        elsewhere.
        """
        import geopandas
        import shapely

        prisms, canopies = self._ground.objects()
        nan = math.nan
        rows = [(kind, id, base, roof, nan, nan, nan) for kind, id, base, roof, _ in prisms]
        rows += [(kind, id, nan, nan, height, full, apart) for kind, id, height, apart, full, _ in canopies]
        plans = [shapely.Polygon(rings[0], rings[1:]) for *_, rings in prisms]
        plans += [shapely.union_all(shapely.polygons(np.array(triangles))) for *_, triangles in canopies]
        names = ("kind", "id", "base_m", "roof_m", "height_m", "fullness", "spacing_m")
        columns: dict[str, Any] = {name: [row[place] for row in rows] for place, name in enumerate(names)}
        columns["id"] = np.array(columns["id"], np.uint64)
        return geopandas.GeoDataFrame(columns, geometry=plans, crs=self.crs)

    def to_xarray(self, spacing_m: float | None = None) -> DataArray:
        """Return heights of the area as an ``xarray.DataArray``, the northern row first.

        They begin at its south-western corner and end with the last whole step in it.

        Parameters
        ----------
        spacing_m : float, optional
            Metres between them; those of the working grid unless given.
        """
        spacing_m = self.spacing_m if spacing_m is None else float(spacing_m)
        if not (math.isfinite(spacing_m) and 0 < spacing_m):
            raise RequestError(f"spacing_m: found {spacing_m}, expected a number above 0", "in metres")
        west, south, east, north = self.bounds
        x = west + spacing_m * np.arange(int((east - west) / spacing_m + 1e-9) + 1)
        y = south + spacing_m * np.arange(int((north - south) / spacing_m + 1e-9) + 1)[::-1]
        heights = np.empty((len(y), len(x)))
        for row, place in enumerate(y):
            heights[row] = self.heights(np.column_stack((x, np.full(len(x), place))))
        half = spacing_m / 2
        transform = (spacing_m, 0.0, x[0] - half, 0.0, -spacing_m, y[0] + half)
        return _data_array(heights, transform, self.crs, "height")

    def explain(self, row: int, col: int, *, against: Path | None = None) -> dict[str, Any]:
        """Return everything there is to know about one load module, as ``tiefort explain --format json`` does."""
        self._ground.frame()
        module = (_index("row", row), _index("col", col))
        found = _tiefort.explain(self._path, module, None if against is None else path_of(against))
        told: dict[str, Any] = json.loads(found)
        return told


def _index(name: str, number: int) -> int:
    number = operator.index(number)
    if not 0 <= number < 1 << 16:
        raise RequestError(f"{name}: found {number}, expected 0 or more", "rows and columns count from the south-west")
    return number


def _words(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def _data_array(values: npt.NDArray[Any], transform: Affine6, crs: str, name: str) -> DataArray:
    import xarray

    rows, cols = values.shape
    step, _, west, _, down, north = transform
    coordinates = {
        "y": north + down * (np.arange(rows) + 0.5),
        "x": west + step * (np.arange(cols) + 0.5),
    }
    found = xarray.DataArray(values, coordinates, ("y", "x"), name, {"crs": crs, "transform": transform})
    if hasattr(found, "rio"):
        found = found.rio.write_crs(crs)
    return found
