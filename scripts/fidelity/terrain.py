"""The rasters that the fidelity benchmark runs on, and the working grids of its jobs."""

import dataclasses
import pathlib

from fidelity.workshop import DATA, FOLDER, run, skip, tell, why, write_heights

# The desert window of every figure in the specification: columns 481 to 940, rows 0 to 375 from the NORTH. Greedy
# insertion (pydelatin) of 2,500 and 5,000 points has RMS 4.15 m and 2.55 m there, at 4,911 and 9,868 triangles.
DESERT = "ntc_scape/ntc_1024x1024_25m_assumed.tif"
DESERT_WINDOW = (481, 0, 460, 376)
WINDOW_POINTS = (2_500, 5_000)
# Other rasters get a vertex for so many posts, as the windows have 35 to 69 and the 50 km area has 51.
POSTS_PER_POINT = 50
SAMPLE_POSTS = 1001
# Above so many posts, Lindstrom-Turk takes minutes and up to a gigabyte.
LARGE_POSTS = 500_000


@dataclasses.dataclass
class Input:
    """A raster and the numbers of points to try on it. Heights: rows from the south, metres."""

    name: str
    points: tuple
    heights: object
    spacing_m: tuple
    dem: pathlib.Path
    raw: pathlib.Path

    @property
    def large(self):
        return LARGE_POSTS < self.heights.size


def inputs(tiefort, quick, wanted):
    """Every raster that is there and whose name is wanted, one at a time; what is missing is told."""
    stand_ins = "ntc_standin/tiefort_size_"
    named = [
        ("desert-window", DESERT, WINDOW_POINTS, DESERT_WINDOW),
        ("mackay-window", f"{stand_ins}mackay_idaho_460x376_utm12n.tif", WINDOW_POINTS),
        ("alps-window", f"{stand_ins}bavarian_alps_460x376_utm32n.tif", WINDOW_POINTS),
        ("alps-1979", "ntc_standin/bavarian_alps_50km_1979x1979_utm32n.tif", (76_500,)),
        ("desert-1024", DESERT),
        *((path.name.split("_")[0], f"dem/{path.name}") for path in sorted((DATA / "dem").glob("*.tif"))),
    ]
    for name, *rest in named[:1] if quick else named:
        if wanted(name):
            yield from found(name, *rest)
    if wanted("sample") and not quick:
        yield from sample(tiefort)


def found(name, file, points=None, window=None):
    """The raster at `file`, cut to `window`, when it is there and in metres."""
    path = DATA / file
    if not path.exists():
        return skip(name, f"no {path}")
    heights, spacing_m, profile = read(path, window)
    if heights is None:
        return skip(name, f"{file} is not in metres")
    tell(f"{name}: {file}, {heights.shape[1]} x {heights.shape[0]} posts")
    dem = FOLDER / f"{name}.tif"
    write_geotiff(dem, heights, profile)
    yield made(name, points, heights, spacing_m, dem)


def sample(tiefort):
    dem = FOLDER / "sample.tif"
    ran = run(tiefort, "sample", "--posts", SAMPLE_POSTS, "--out", dem)
    if ran["code"] != 0:
        return skip("sample", why(ran))
    heights, spacing_m, _ = read(dem)
    yield made("sample", None, heights, spacing_m, dem)


def made(name, points, heights, spacing_m, dem):
    raw = FOLDER / f"{name}.heights"
    write_heights(raw, heights)
    return Input(name, points or (heights.size // POSTS_PER_POINT // 100 * 100,), heights, spacing_m, dem, raw)


def read(path, window=None):
    """Heights from the south, spacing in metres, and what a copy needs. Heights are None where it is in degrees."""
    import numpy
    import rasterio
    from rasterio.windows import Window

    with rasterio.open(path) as raster:
        if raster.crs is None or not raster.crs.is_projected or raster.crs.linear_units_factor[1] != 1.0:
            return None, None, None
        part = Window(*window) if window else Window(0, 0, raster.width, raster.height)
        band = raster.read(1, window=part, masked=True)
        spacing_m = (raster.transform.a, -raster.transform.e)
        profile = {"crs": raster.crs, "transform": raster.window_transform(part), "dtype": band.dtype}
    band = numpy.ma.masked_invalid(band)
    if band.mask.any():
        # The peers know no voids. What is void in this data is the sea, so it becomes the lowest ground.
        tell(f"{path.name}: {int(band.mask.sum()):,} void posts are filled with the lowest height, {band.min()} m")
    return band.filled(band.min())[::-1].astype("f4"), spacing_m, profile


def write_geotiff(path, heights, profile):
    import rasterio

    rows, columns = heights.shape
    with rasterio.open(path, "w", driver="GTiff", width=columns, height=rows, count=1, **profile) as out:
        out.write(heights[::-1].astype(profile["dtype"]), 1)


# --- working grids ---


def working_grid(job, tiefort):
    """Heights of a job's working grid from the south, to 1/128 m: bilinear between the raster's posts; None without it.

    Written from the description of the compiler's resampling, since a regular grid of it is one of the yardsticks.
    """
    area, dem = job["area"], job["dem"]
    spacing_m = area["spacing_m"]
    posts = [int(size // spacing_m) + 1 for size in area["size_m"]]
    if "sources" in dem:
        path = pathlib.Path(dem["sources"][0])
    else:
        path = FOLDER / "sample-area.tif"
        ran = run(tiefort, "sample", "--posts", max(posts), "--spacing", spacing_m, "--seed", dem.get("seed", 1),
                  "--out", path)
        if ran["code"] != 0:
            return skip(f"the working grid of {area['name']}", why(ran))
    return resampled(path, area["origin_m"], spacing_m, posts)


def resampled(path, origin_m, spacing_m, posts):
    import numpy
    import rasterio

    heights, raster_spacing_m, profile = read(path)
    to_posts = ~profile["transform"]
    # The middle of the southernmost, westernmost pixel is post 0, 0.
    west, south = to_posts * tuple(origin_m)
    start = [west - 0.5, heights.shape[0] - 0.5 - south]
    taps = []
    for axis in (0, 1):
        place = start[axis] + numpy.arange(posts[axis]) * spacing_m / raster_spacing_m[axis]
        units = numpy.clip(numpy.floor(place * 65536 + 0.5), 0, (heights.shape[1 - axis] - 1) * 65536).astype("i8")
        near, weight = units >> 16, (units & 65535) / 65536
        taps.append((near, numpy.minimum(near + 1, heights.shape[1 - axis] - 1), weight))
    (west, east, u), (south, north, v) = taps
    exact = heights.astype("f8")
    lower = exact[numpy.ix_(south, west)] * (1 - u) + exact[numpy.ix_(south, east)] * u
    upper = exact[numpy.ix_(north, west)] * (1 - u) + exact[numpy.ix_(north, east)] * u
    mixed = lower * (1 - v)[:, None] + upper * v[:, None]
    return (numpy.floor(mixed * 128 + 0.5) / 128).astype("f4")
