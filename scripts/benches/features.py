"""Roads, rivers and lakes: what they cost in real ground, as a network grows, and in one load module."""

import array
import json
import math
import os
import pathlib
import random
import resource
import struct
import subprocess
import sys
import tempfile
import time
import tomllib

from benches.areas import toml
from benches.common import DATA, FOLDER, markdown, parser_of, prepare_venv, program, run, scratch, skip, tell, why

VECTORS = DATA / "vectors"
# Name, DEM, vectors, kinds of them where their file does not say, whether the ratio of RMS residuals is a bar.
EXTRACTS = [
    ("liechtenstein", "vectors/liechtenstein_south/dem_aster_gdem2_1arcsec.tif",
     ["liechtenstein_south/liechtenstein_south.osm.pbf"], [], True),
    ("baja", "dem/baja_california_sur_1264x1005_29m.tif", ["baja_california_sur/roads.geojson"], ["minor"], True),
    ("mackay", "dem/mackay_idaho_738x919_30m_utm12n.tif",
     ["mackay_idaho/roads.geojson", "mackay_idaho/streams.geojson", "mackay_idaho/lakes.geojson"],
     ["minor", "stream", "lake"], False),
    ("porto_alegre", "dem/porto_alegre_1365x1369_1arcsec.tif", ["porto_alegre/porto_alegre.osm.pbf"], [], False),
    ("bayreuth", "vectors/north_bayreuth/dem_srtm3_3arcsec.tif", ["north_bayreuth/north_bayreuth.osm.pbf"], [], False),
    ("monaco", "vectors/monaco/dem_srtm3_3arcsec.tif", ["monaco/monaco.osm.pbf"], [], False),
    ("dirty", "vectors/liechtenstein_south/dem_aster_gdem2_1arcsec.tif", ["dirty/triesenberg_injected.osm.pbf"], [],
     False),
]
RATIO_MAX = 1.05
ASIDE_M = 60
MODULE_M = 500


def features():
    """Measure roads, rivers and lakes in real ground: what they cost, how true they are, and what the rest of it loses.

        scripts/bench.py features                   every extract that is there
        scripts/bench.py features --only baja       those whose name has this in it
        scripts/bench.py features --json all.json   every figure, for a program

    Each extract is built twice, from the job that `tiefort init` writes for its DEM and vectors: once as it is, and
    once without features and with as many triangles as the first build left beside them. Both surfaces are read from
    the load-module files by scripts/read_slm.py and compared with the DEM as rasterio resamples it, at the posts that
    lie 60 m or more from every feature; nothing of the compiler takes part. Also counted from the files alone:
    triangles of load modules and of 4 km squares against their limits.

    The table has a row for each check of the report, and the ratio of both RMS residuals. Exit code 1 when a check
    fails or the ratio of an extract marked * is above 1.05. Missing data is skipped loudly.
    """
    options = parsed()
    prepare_venv()
    results, failed = {}, False
    for name, dem, vectors, kinds, is_bar in EXTRACTS:
        if options.only and options.only not in name:
            continue
        files = [DATA / dem, *(VECTORS / path for path in vectors)]
        missing = [path for path in files if not path.exists()]
        if missing:
            skip(name, f"no {missing[0]}")
            continue
        tell(f"{name}…")
        result = measured(program(options), name, files, kinds)
        if result is None:
            failed = True
            continue
        results[name] = result
        failed |= result["faults"] != [] or (is_bar and RATIO_MAX < result["ratio"])
    show(results)
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(results, indent=1))
    return 1 if failed else 0


def parsed():
    parser = parser_of(features)
    parser.add_argument("--only", help="extracts whose name has this in it")
    parser.add_argument("--json", help="a file for every figure")
    return parser.parse_args()


def measured(tiefort, name, files, kinds):
    """The figures of an extract with features, and without them at as many remaining triangles."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{name}.toml"
    path.unlink(missing_ok=True)
    written = run(tiefort, "init", *files, "--out", path)
    if written["code"] != 0:
        return skip(name, why(written))
    job = tomllib.loads(path.read_text())
    sources = job["features"]["sources"]
    for at, kind in enumerate(kinds):
        sources[at] = {"file": sources[at]["file"] if isinstance(sources[at], dict) else sources[at], "kind": kind}
    ground = working_grid(job)
    with_features = build(tiefort, job)
    if "report" not in with_features:
        return skip(name, why(with_features))
    report = with_features["report"]["features"]
    remaining = with_features["surface"]["triangles"] - report["all"]["triangles"]
    modules = math.prod(int(size // MODULE_M) for size in job["area"]["size_m"])
    plain = {key: value for key, value in job.items() if key != "features"}
    plain["limits"] = job["limits"] | {"mean_per_load_module": remaining / modules}
    without = build(tiefort, plain)
    if "report" not in without:
        return skip(name, why(without))
    outside = ground["known"] & ~near_features(with_features["lines"], job, ground["heights"].shape)
    rms = [outside_rms(built["surface"], ground["heights"], outside) for built in (with_features, without)]
    return {
        "km": sum(row["line_km"] + row["strip_km"] + row["channel_km"] for row in report["classes"]),
        "seconds": [with_features["wall_s"], without["wall_s"]],
        "triangles": [built["surface"]["triangles"] for built in (with_features, without)],
        "of_features": report["all"]["triangles"],
        "rms_m": rms,
        "ratio": rms[0] / rms[1],
        "remarks": report["remarks"],
        "checks": report["checks"],
        "largest": [with_features["surface"]["module_max"], with_features["surface"]["window_max"]],
        "faults": faults(report["checks"], with_features["surface"], job["limits"]),
    }


def faults(checks, surface, limits):
    must_be_none = ["edges_missing", "stations_steeper", "strip_fall_max_m", "river_edges_rising", "lake_spread_max_m",
                    "shore_posts_below"]
    found = [key for key in must_be_none if checks[key] != 0]
    found += ["load module over its limit"] * (limits["per_load_module"] < surface["module_max"])
    found += ["4 km square over its limit"] * (limits["per_4km_square"] < surface["window_max"])
    return found


def build(tiefort, job):
    path = FOLDER / "features-job.toml"
    lines = []
    for section, keys in job.items():
        lines += [f"[{section}]", *(f"{key} = {toml(value)}" for key, value in keys.items()), ""]
    path.write_text("\n".join(lines))
    with scratch("features.tdb") as database:
        ran = run(tiefort, "build", path, "--out", database, "--workers", os.cpu_count(), "--fresh", "--quiet")
        if ran["code"] not in (0, 1):
            return ran
        ran["report"] = json.loads((database / "report.json").read_text())
        ran["surface"] = surface_of(database, job)
        ran["lines"] = lines_of(tiefort, database) if "features" in job else []
    return ran


# --- read back ---


def surface_of(database, job):
    """Heights at every post, from the south, and how many triangles there are, by the files of load modules alone."""
    import numpy
    import read_slm

    heights, counts = None, {}
    for path in sorted((database / "modules").glob("*.slm")):
        header, modules = read_slm.parse(path.read_bytes())
        cells, step = header["side_cells"], header["side"] // header["side_cells"]
        if heights is None:
            rows, columns = (count * cells + 1 for count in header["area_modules"])
            heights = numpy.full((rows, columns), numpy.nan)
        for module in (module for module in modules if module["level"] == 0):
            counts[module["row"], module["column"]] = len(module["triangles"])
            own = heights[module["row"] * cells :, module["column"] * cells :]
            for triangle in module["triangles"]:
                draw(own, *(module["vertices"][corner] for corner in triangle), step)
    sums = numpy.zeros([max(axis) + 2 for axis in zip(*counts)], "i8")
    for (row, column), count in counts.items():
        sums[row + 1, column + 1] = count
    sums = sums.cumsum(0).cumsum(1)
    side = 4000 // MODULE_M
    high, wide = (min(side, axis - 1) for axis in sums.shape)
    windows = sums[high:, wide:] - sums[:-high, wide:] - sums[high:, :-wide] + sums[:-high, :-wide]
    return {"heights": heights, "triangles": int(sums[-1, -1]), "module_max": max(counts.values()),
            "window_max": int(windows.max())}


def draw(heights, a, b, c, step):
    """The heights of a triangle's plane, in metres, at the posts it holds."""
    import numpy

    (xa, ya, za), (xb, yb, zb), (xc, yc, zc) = a, b, c
    columns = numpy.arange(-(-min(xa, xb, xc) // step), max(xa, xb, xc) // step + 1)
    rows = numpy.arange(-(-min(ya, yb, yc) // step), max(ya, yb, yc) // step + 1)
    if not (len(columns) and len(rows)):
        return
    x, y = (columns * step)[None, :], (rows * step)[:, None]
    of_a = (xc - xb) * (y - yb) - (yc - yb) * (x - xb)
    of_b = (xa - xc) * (y - yc) - (ya - yc) * (x - xc)
    whole = (xb - xa) * (yc - ya) - (yb - ya) * (xc - xa)
    of_c = whole - of_a - of_b
    inside = (of_a >= 0) & (of_b >= 0) & (of_c >= 0)
    plane = (of_a * za + of_b * zb + of_c * zc) / (128 * whole)
    part = heights[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    part[inside] = plane[inside]


def lines_of(tiefort, database):
    """Every line of features in the ground, as lists of (east, north), from the GeoPackage that the program writes."""
    import sqlite3

    with scratch("features") as folder:
        folder.mkdir()
        path = folder / "features.gpkg"
        ran = run(tiefort, "export", database, "--format", "features", "--out", path)
        if ran["code"] != 0:
            raise SystemExit(f"the features cannot be exported: {why(ran)}")
        with sqlite3.connect(path) as connection:
            return [places(blob) for (blob,) in connection.execute("SELECT geom FROM lines")]


def places(blob):
    """East and north of the points of a LineStringZ in a GeoPackage's blob."""
    envelope = [0, 32, 48, 48, 64][blob[3] >> 1 & 7]
    wkb = blob[8 + envelope :]
    (count,) = struct.unpack_from("<I", wkb, 5)
    return [struct.unpack_from("<2d", wkb, 9 + 24 * at) for at in range(count)]


# --- compared with the DEM ---


def working_grid(job):
    """Heights of the DEM at the posts of the job's grid from the south, and where none is a void: by rasterio."""
    import numpy
    import rasterio
    from rasterio.transform import Affine
    from rasterio.warp import Resampling, reproject

    area = job["area"]
    spacing = area["spacing_m"]
    (columns, rows), (east, north) = ([int(size // spacing) + 1 for size in area["size_m"]], area["origin_m"])
    # Posts are middles of pixels; rows go down from the north.
    top = north + (rows - 0.5) * spacing
    grid = Affine(spacing, 0, east - spacing / 2, 0, -spacing, top)
    heights = numpy.full((rows, columns), numpy.nan)
    with rasterio.open(job["dem"]["sources"][0]) as source:
        band = source.read(1, masked=True).astype("f8").filled(numpy.nan)
        reproject(band, heights, src_transform=source.transform, src_crs=source.crs, src_nodata=numpy.nan,
                  dst_transform=grid, dst_crs=area.get("crs", source.crs), dst_nodata=numpy.nan,
                  resampling=Resampling.bilinear)
    heights = heights[::-1]
    return {"heights": heights, "known": numpy.isfinite(heights)}


def near_features(lines, job, shape):
    """Posts less than 60 m from a line."""
    import numpy

    area = job["area"]
    spacing, (east, north) = area["spacing_m"], area["origin_m"]
    near = numpy.zeros(shape, bool)
    reach = int(ASIDE_M // spacing) + 1
    for line in lines:
        for (x0, y0), (x1, y1) in zip(line, line[1:]):
            columns = span(x0 - east, x1 - east, spacing, reach, shape[1])
            rows = span(y0 - north, y1 - north, spacing, reach, shape[0])
            x = (numpy.arange(*columns) * spacing + east - x0)[None, :]
            y = (numpy.arange(*rows) * spacing + north - y0)[:, None]
            along = (x * (x1 - x0) + y * (y1 - y0)) / max((x1 - x0) ** 2 + (y1 - y0) ** 2, 1e-9)
            along = numpy.clip(along, 0, 1)
            aside = numpy.hypot(x - along * (x1 - x0), y - along * (y1 - y0))
            near[rows[0] : rows[1], columns[0] : columns[1]] |= aside < ASIDE_M
    return near


def span(one, other, spacing, reach, count):
    """The posts between two places of an axis, with some on either side."""
    low, high = min(one, other) / spacing, max(one, other) / spacing
    return max(0, math.floor(low) - reach), max(0, min(count, math.ceil(high) + reach + 1))


def outside_rms(surface, heights, outside):
    import numpy

    residuals = (surface["heights"] - heights)[outside]
    return float(numpy.sqrt(numpy.mean(residuals**2)))


def show(results):
    head = ["", "km", "triangles", "of features", "missing", "too steep", "fall m", "rising", "lakes m", "below",
            "largest", "4 km", "RMS m", "without", "ratio", "s", "without", "degraded", "left out"]
    rows = []
    for name, of in results.items():
        checks = of["checks"]
        rows.append([
            name, f"{of['km']:.0f}", f"{of['triangles'][0]:,}", f"{of['of_features']:,}",
            f"{checks['edges_missing']} of {checks['edges']:,}",
            f"{checks['stations_steeper']} of {checks['stations']:,}", f"{checks['strip_fall_max_m']:.3f}",
            f"{checks['river_edges_rising']} of {checks['river_edges']:,}", f"{checks['lake_spread_max_m']:.3f}",
            f"{checks['shore_posts_below']} of {checks['shore_posts']}", *map(str, of["largest"]),
            *(f"{rms:.3f}" for rms in of["rms_m"]), f"{of['ratio']:.3f}", *(f"{s:.1f}" for s in of["seconds"]),
            f"{of['remarks']['degraded']:,}", f"{of['remarks']['left_out']:,}",
        ])
    markdown("Roads, rivers and lakes in real ground", head, rows)


# --- a network that grows ---


LENGTH_KM, STEP_KM, TILE_KM = 1000, 20, 10
ORIGIN_M = (500000, 3900000)
CLASSES = ["motorway", "primary", "residential", "track"]
BATCH = 200


def scale():
    """Measure the stages `profile` and `level` on strips of a road grid over 1000 km: time and memory as it grows.

        scripts/bench.py scale             strips of 25, 50 and 100 km
        scripts/bench.py scale 25 50       strips of so many kilometres

    Roads run every 20 km both ways, of four classes, over the built-in terrain at 25 m: 100,000 km of them over 1000
    km x 1000 km. Each strip is 1000 km long; both stages run as units of work (`tiefort task`). The last row is the
    whole, by the straight line through the last two strips.
    """
    parser = parser_of(scale)
    parser.add_argument("km", nargs="*", type=int, default=[25, 50, 100], help="widths of strips")
    options = parser.parse_args()
    strips = [strip(program(options), width) for width in options.km]
    rows = [list(map(float, strip)) for strip in strips]
    if 1 < len(rows):
        before, last = rows[-2:]
        share = (LENGTH_KM - last[0]) / (last[0] - before[0])
        rows.append([b + (b - a) * share for a, b in zip(before, last)])
    head = ["strip km", "roads km", "profile s", "MB", "level s", "MB"]
    cells = [[f"{row[0]:.0f}", *(f"{number:,.1f}" for number in row[1:])] for row in rows]
    markdown("A grid of roads, 1000 km long", head, cells)


def strip(tiefort, width_km):
    """Width, kilometres of road, and seconds and megabytes of both stages."""
    with scratch("feature-scale") as folder:
        folder.mkdir(parents=True)
        roads_km = write_grid(folder / "roads.geojson", width_km)
        rows = math.ceil(width_km / TILE_KM)
        job = folder / "strip.toml"
        job.write_text(
            f'[area]\nname = "strip"\ncrs = "EPSG:32611"\norigin_m = {list(ORIGIN_M)}\n'
            f"size_m = [{LENGTH_KM * 1000}, {width_km * 1000}]\nspacing_m = 25\n"
            f'[dem]\nsource = "sample"\n[features]\nsources = ["roads.geojson"]\n'
            f"[tiles]\ncolumns = {LENGTH_KM // TILE_KM}\nrows = {rows}\n"
        )
        tiles = [f"{row},{column}" for row in range(rows) for column in range(LENGTH_KM // TILE_KM)]
        found = [width_km, roads_km]
        for stage, units in (("profile", tiles), ("level", [])):
            tell(f"{stage} of {width_km} km")
            seconds, peak_mb = 0.0, 0.0
            for at in range(0, max(len(units), 1), BATCH):
                ran = run(tiefort, "task", job, stage, *units[at : at + BATCH], "--out", folder / "strip.tdb")
                if ran["code"] != 0:
                    sys.exit(why(ran))
                seconds, peak_mb = seconds + ran["wall_s"], max(peak_mb, ran["peak_mb"])
            found += [seconds, peak_mb]
        return found


def write_grid(path, width_km):
    """A grid of winding roads as GeoJSON; returns how many kilometres they are."""
    lines = []
    for across, length, count in ((True, width_km, LENGTH_KM // STEP_KM), (False, LENGTH_KM, width_km // STEP_KM + 1)):
        for number in range(count):
            middle = (number + 0.5) * STEP_KM * 1000
            if not across and width_km * 1000 < middle:
                continue
            line = [(t, middle + 300 * math.sin(t / 900 + number)) for t in range(0, length * 1000 + 1, 200)]
            lines.append([(aside, t) if across else (t, aside) for t, aside in line])
    features = [
        {
            "type": "Feature",
            "properties": {"highway": CLASSES[number % len(CLASSES)]},
            "geometry": {
                "type": "LineString",
                "coordinates": [[round(ORIGIN_M[0] + x, 2), round(ORIGIN_M[1] + y, 2)] for x, y in line],
            },
        }
        for number, line in enumerate(lines)
    ]
    crs = {"type": "name", "properties": {"name": "EPSG:32611"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))
    return sum(math.dist(a, b) for line in lines for a, b in zip(line, line[1:])) / 1000


# --- all roads in one load module ---


CROWD_ORIGIN = (505000.0, 3875000.0)
SEGMENTS_PER_ROAD = 10
CROWD_JOB = """[area]
name = "crowd"
crs = "EPSG:32611"
origin_m = [505000.0, 3875000.0]
size_m = [2000, 2000]
spacing_m = 25
[dem]
source = "sample"
seed = 1
[tiles]
rows = 2
columns = 2
[features]
sources = ["roads.shp"]
"""


def write_roads(folder: pathlib.Path, segments: int) -> int:
    """Tracks that wander about in one square of 500 m, as a Shapefile; gives how many there are."""
    random.seed(1)
    roads, words = max(1, segments // SEGMENTS_PER_ROAD), 50
    bounds = struct.pack("<4d", *CROWD_ORIGIN, CROWD_ORIGIN[0] + 2000, CROWD_ORIGIN[1] + 2000)
    with open(folder / "roads.shp", "wb") as file:
        file.write(bytes(100))
        for road in range(roads):
            x, y = random.random() * 500, random.random() * 500
            places = array.array("d")
            for _ in range(SEGMENTS_PER_ROAD + 1):
                x = min(max(x + random.uniform(-15, 15), 0), 500)
                y = min(max(y + random.uniform(-15, 15), 0), 500)
                places.extend((CROWD_ORIGIN[0] + 500 + x, CROWD_ORIGIN[1] + 500 + y))
            content = struct.pack("<i", 3) + bounds + struct.pack("<iii", 1, len(places) // 2, 0) + places.tobytes()
            file.write(struct.pack(">ii", road + 1, len(content) // 2) + content)
            words += 4 + len(content) // 2
        file.seek(0)
        file.write(struct.pack(">i5ii", 9994, 0, 0, 0, 0, 0, words) + struct.pack("<ii", 1000, 3) + bounds + bytes(32))
    field = b"highway\0\0\0\0C" + bytes(4) + bytes([10, 0]) + bytes(14) + b"\r"
    header = struct.pack("<BBBBIHH20x", 3, 26, 1, 1, roads, 65, 11) + field
    (folder / "roads.dbf").write_bytes(header + b" track     " * roads + b"\x1a")
    return roads


def crowd():
    """Builds a job whose roads all lie in one load module, and tells what that took: time, memory, what became of them.

        scripts/bench.py crowd [SEGMENTS]      1,000,000 by default

    Whatever is drawn, the build has to end, within its limits, and to tell of every road.
    """
    parser = parser_of(crowd)
    parser.add_argument("segments", nargs="?", type=int, default=1_000_000)
    options = parser.parse_args()
    tiefort, segments = program(options), options.segments
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "job.toml").write_text(CROWD_JOB)
        roads = write_roads(folder, segments)
        command = [tiefort, "build", "job.toml", "--out", "out.tdb", "--no-html", "--quiet"]
        began = time.monotonic()
        subprocess.run(command, cwd=folder, check=True)
        seconds = time.monotonic() - began
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        report = json.loads((folder / "out.tdb/report.json").read_text())
        told = report["features"]["remarks"]
        print(f"{segments} segments of {roads} roads: {seconds:.1f} s, {used.ru_utime + used.ru_stime:.1f} s of CPU, "
              f"{used.ru_maxrss / 1024:.0f} MB; {told}; {len(report['breaches'])} breaches")
        assert not report["breaches"], "no limit may be exceeded"
        subprocess.run([tiefort, "verify", "out.tdb"], cwd=folder, check=True)
