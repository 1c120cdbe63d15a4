"""Heights and places as people hold them: arrays, DataArrays, open rasters, paths."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ._errors import RequestError, SourceError

Affine6 = tuple[float, float, float, float, float, float]
Path = Union[str, bytes, "os.PathLike[str]", "os.PathLike[bytes]"]

# What is held in a type of the compiled part, losing nothing: heights are below 2**17 m.
_HELD_AS = {
    "float32": "float32",
    "float64": "float64",
    "int16": "int16",
    "int32": "int32",
    "float16": "float32",
    "uint8": "int16",
    "int8": "int16",
    "uint16": "int32",
    "uint32": "float64",
    "int64": "float64",
    "uint64": "float64",
}


@dataclass(frozen=True)
class Posts:
    """Heights, and where they lie."""

    array: npt.NDArray[Any]
    crs: str | None
    south_west: tuple[float, float]
    spacing: tuple[float, float]
    nodata: float | None
    south_first: bool

    @property
    def placed(self) -> tuple[str | None, tuple[float, float], tuple[float, float], float | None, bool]:
        """All but the heights."""
        return (self.crs, self.south_west, self.spacing, self.nodata, self.south_first)


@dataclass
class _Found:
    """What a holder of heights says of them."""

    array: Any
    crs: Any = None
    transform: Affine6 | None = None
    axes: tuple[float, float, float, float] | None = None
    nodata: float | None = None


def is_path(dem: Any) -> bool:
    """Whether heights are named, not held."""
    return isinstance(dem, (str, bytes, os.PathLike))


def path_of(path: Path) -> str:
    """Return a path as text; bytes that are no text stay what they are."""
    return os.fsdecode(path)


def alone(crs: Any, transform: Any, spacing_m: float | None, nodata: float | None) -> None:
    """Refuse what is said beside a path."""
    said = (("crs", crs), ("transform", transform), ("spacing_m", spacing_m), ("nodata", nodata))
    for name, value in said:
        if value is not None:
            message = f"found {name} with a path, expected what the file says itself"
            raise RequestError(message, f"leave {name} out, or open the file and give its heights as an array")


def posts_of(dem: Any, crs: Any, transform: Any, spacing_m: float | None, nodata: float | None) -> Posts:
    """Heights as the compiled part takes them; what is said beside them goes before what they say themselves."""
    found = _held(dem)
    array, nodata = _array(found.array, found.nodata if nodata is None else nodata)
    given = crs if crs is not None else found.crs
    system = None if given is None else crs_text(given)
    rows, _cols = array.shape
    if transform is not None and spacing_m is not None:
        raise RequestError("found transform and spacing_m, expected one of them", "transform says the spacing, too")
    if transform is not None:
        found.transform, found.axes = affine(transform), None
    if spacing_m is not None:
        if not (math.isfinite(spacing_m) and 0 < spacing_m):
            raise RequestError(f"spacing_m: found {spacing_m}, expected a number above 0", "metres between posts")
        found.transform, found.axes = None, (0.0, (rows - 1) * spacing_m, spacing_m, -spacing_m)
    if found.axes is not None:
        west, first_north, east_step, north_step = found.axes
    elif found.transform is not None:
        a, b, c, d, e, f = found.transform
        if b != 0 or d != 0:
            message = f"transform: found a raster that is turned ({b} and {d}), expected rows that run east"
            raise RequestError(message, "warp it first, for example with rioxarray's reproject")
        west, first_north, east_step, north_step = c + 0.5 * a, f + 0.5 * e, a, e
    else:
        if system is not None:
            message = "found a crs without a transform, expected both or none"
            raise RequestError(message, "transform=(a, b, c, d, e, f) as rasterio has it, or spacing_m=METRES")
        west, first_north, east_step, north_step = 0.0, rows - 1.0, 1.0, -1.0
    numbers = (west, first_north, east_step, north_step)
    if not all(map(math.isfinite, numbers)) or east_step <= 0 or north_step == 0:
        message = f"transform: found steps of {east_step} and {north_step} from {west}, {first_north}"
        raise RequestError(f"{message}, expected finite numbers, the first above 0", "columns run from west to east")
    south = first_north if 0 < north_step else first_north + north_step * (rows - 1)
    spacing = (east_step, abs(north_step))
    if system is None and 1e-6 * spacing[0] < abs(spacing[0] - spacing[1]):
        message = f"found posts {spacing[0]} x {spacing[1]} apart and no crs, expected square ones, or a crs"
        raise RequestError(message, 'with crs="EPSG:…" they are resampled to square ones')
    return Posts(array, system, (west, south), spacing, nodata, 0 < north_step)


def _held(dem: Any) -> _Found:
    if hasattr(dem, "dims") and hasattr(dem, "coords"):
        return _of_data_array(dem)
    if hasattr(dem, "read") and hasattr(dem, "transform") and hasattr(dem, "nodata"):
        return _of_dataset(dem)
    return _Found(dem)


def _of_dataset(dem: Any) -> _Found:
    """Heights of an open rasterio dataset: its first band."""
    if getattr(dem, "closed", False):
        raise SourceError(f"{dem.name}: found a dataset that is closed, expected an open one", "open it again")
    array = dem.read(1)
    scale, offset = dem.scales[0], dem.offsets[0]
    nodata = dem.nodata
    if (scale, offset) != (1.0, 0.0):
        void = np.zeros(array.shape, bool) if nodata is None else array == nodata
        array, nodata = np.where(void, np.nan, array * scale + offset), None
    return _Found(array, dem.crs, affine(dem.transform), None, nodata)


def _of_data_array(dem: Any) -> _Found:
    """Heights of an xarray.DataArray: what rioxarray says of it, else its coordinates."""
    while 2 < dem.ndim and dem.shape[0] == 1:
        dem = dem[0]
    found = _Found(dem.data)
    if dem.ndim != 2:
        return found
    rio = getattr(dem, "rio", None)
    if rio is not None:
        found.crs, found.nodata = rio.crs, rio.nodata
    else:
        spatial = dem.coords["spatial_ref"].attrs if "spatial_ref" in dem.coords else {}
        found.crs = spatial.get("crs_wkt") or spatial.get("spatial_ref") or dem.attrs.get("crs")
        found.nodata = dem.attrs.get("_FillValue", dem.attrs.get("nodata"))
    rows, cols = dem.dims
    if rows in dem.coords and cols in dem.coords and 1 < min(dem.shape):
        first_north, north_step = _even(np.asarray(dem.coords[rows]), rows)
        west, east_step = _even(np.asarray(dem.coords[cols]), cols)
        found.axes = (west, first_north, east_step, north_step)
    elif rio is not None and found.crs is not None:
        found.transform = affine(rio.transform())
    return found


def _even(places: npt.NDArray[Any], name: Any) -> tuple[float, float]:
    """First place and step along a coordinate whose places are evenly spaced."""
    places = places.astype(np.float64)
    step = (places[-1] - places[0]) / (len(places) - 1)
    if not np.allclose(np.diff(places), step, rtol=1e-4, atol=0.0):
        message = f"found a coordinate {name} whose places are not evenly spaced, expected a regular grid"
        raise SourceError(message, "interpolate it to a regular grid first: DataArray.interp")
    return float(places[0]), float(step)


def _array(held: Any, nodata: float | None) -> tuple[npt.NDArray[Any], float | None]:
    if isinstance(held, np.ma.MaskedArray):
        held, nodata = np.ma.filled(held.astype(np.float64), np.nan), None
    array = np.asarray(held)
    if array.ndim != 2:
        shape = " x ".join(map(str, array.shape)) or "a single number"
        message = f"dem: found an array of {array.ndim} dimensions ({shape}), expected 2: rows and columns"
        raise SourceError(message, "choose one band, as dem[0], or give rows and columns by reshape")
    if array.size == 0:
        message = f"dem: found {array.shape[0]} x {array.shape[1]} posts, expected at least 2 x 2"
        raise SourceError(message, "a mesh needs ground to cover")
    held_as = _HELD_AS.get(array.dtype.newbyteorder("=").name)
    if held_as is None:
        message = f"dem: found an array of {array.dtype}, expected float32, float64, int16 or int32"
        raise SourceError(message, "convert it: dem.astype(numpy.float32)")
    array = np.require(array.astype(held_as, copy=False), requirements=["C", "A"])
    if nodata is not None:
        nodata = float(nodata)
        nodata = None if math.isnan(nodata) else nodata
    return array, nodata


def crs_text(crs: Any) -> str:
    """Return a coordinate system as a code or as well-known text."""
    if isinstance(crs, (int, np.integer)) and not isinstance(crs, bool):
        return f"EPSG:{int(crs)}"
    if isinstance(crs, str):
        return crs
    for name in ("to_epsg", "to_wkt"):
        method = getattr(crs, name, None)
        found = method() if callable(method) else None
        if found:
            return f"EPSG:{found}" if name == "to_epsg" else str(found)
    message = f"crs: found {type(crs).__name__} without a code or a well-known text, expected a coordinate system"
    raise RequestError(message, 'give a code, as crs="EPSG:32611"')


def affine(transform: Any) -> Affine6:
    """Return the six numbers of a transform in rasterio's order."""
    try:
        numbers = tuple(float(number) for number in transform)[:6]
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != 6:
        message = f"transform: found {transform!r}, expected six numbers a, b, c, d, e, f"
        raise RequestError(message, "as rasterio has them: x = a col + b row + c, y = d col + e row + f")
    return numbers


def places_of(xy: Any, count: int = 2, name: str = "xy") -> tuple[npt.NDArray[np.float64], tuple[int, ...]]:
    """Places as rows of numbers, and the shape of what is answered."""
    # What is masked is no place, of which nothing is known.
    array = np.ma.filled(xy.astype(np.float64), np.nan) if np.ma.isMaskedArray(xy) else np.asarray(xy)
    if array.dtype.kind not in "fiu" or array.ndim == 0 or array.shape[-1] != count:
        what = "east and north" if count == 2 else "east, north and height"
        message = f"{name}: found an array of {array.dtype} and shape {array.shape}, expected (…, {count}): {what}"
        raise RequestError(message, "in metres of the area's system; numpy.column_stack((east, north)) makes one")
    rows = np.require(array.reshape(-1, count), np.float64, ["C", "A"])
    return rows, array.shape[:-1]
