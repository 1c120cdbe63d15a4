#!/usr/bin/env python3
"""Measure roads, rivers and lakes in real ground: what they cost, how true they are, and what the rest of it loses.

    scripts/bench_features.py                   every extract that is there
    scripts/bench_features.py --only baja       those whose name has this in it
    scripts/bench_features.py --json all.json   every figure, for a program

Each extract is built twice, from the job that `tiefort init` writes for its DEM and vectors: once as it is, and once
without features and with as many triangles as the first build left beside them. Both surfaces are read from the
load-module files by scripts/read_slm.py and compared with the DEM as rasterio resamples it, at the posts that lie
60 m or more from every feature; nothing of the compiler takes part. Also counted from the files alone: triangles of
load modules and of 4 km squares against their limits.

The table has a row for each check of the report, and the ratio of both RMS residuals. Exit code 1 when a check fails
or the ratio of an extract marked * is above 1.05. Missing data is skipped loudly.
"""

import argparse
import json
import math
import os
import pathlib
import struct
import sys
import tomllib

from bench import ROOT
from fidelity.areas import toml
from fidelity.workshop import DATA, FOLDER, markdown, prepare_venv, run, scratch, skip, tell, why

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


def main():
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
        result = measured(options.tiefort, name, files, kinds)
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tiefort", default=ROOT / "target" / "release" / "tiefort", help="the program")
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


if __name__ == "__main__":
    sys.exit(main())
