#!/usr/bin/env python3
"""Compares readers of rasters, coordinate systems and resampling with GDAL and PROJ. Exit code 1 when anything differs.

    python3 -m venv /tmp/compare && /tmp/compare/bin/pip install rasterio pyproj
    cargo build --release -p source-files --examples
    /tmp/compare/bin/python scripts/compare.py sources [--variants]
    /tmp/compare/bin/python scripts/compare.py crs
    /tmp/compare/bin/python scripts/compare.py warp
    /tmp/compare/bin/python scripts/compare.py antialias DEM.tif…

sources    every raster below TIEFORT_DATA, post by post: GeoTIFF, DTED, HGT (also in .gz and .zip), Esri ASCII, raw
           grids. A file is `equal` when size, coordinate system, place of every post, voids and every sample agree;
           `refused` when ours gives a named error. With --variants, files of every supported combination of type,
           compression, predictor, byte order and layout are written by rasterio and compared, too.
crs        1000 places in the area of use of each system: by EPSG code, by the well-known text that ESRI and GDAL write
           into .prj files, and by the GeoKeys of GeoTIFFs whose system has no code. A millimetre differs.
warp       heights, shift and time on one core of resampling real rasters. The shift is that of our heights against
           GDAL's by least squares over the slopes, in posts of the grid; 0.02 posts differ. GDAL lets its projected
           places be an eighth of a post off, several hundredths on average; its heights are compared in strips so
           narrow that this vanishes, its time is that of the whole.
antialias  should heights be averaged when the working grid is coarser than the raster? (No.) A raster is resampled to a
           coarser grid, once as it is and once averaged over a square of 2 h + 1 posts before; printed is how far the
           surface through the coarse posts then lies from every post of the raster.
"""

import argparse
import gzip
import itertools
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time

import numpy
import pyproj
import rasterio
from rasterio.transform import Affine
from rasterio.warp import Resampling, reproject

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATA = pathlib.Path(os.environ.get("TIEFORT_DATA", ROOT.parent / "shared" / "data"))
EXAMPLES = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "examples"

ENDINGS = {".tif", ".dt0", ".dt1", ".dt2", ".gz", ".zip", ".asc", ".txt", ".flt", ".bil", ".hgt"}
# What a file without a coordinate system is said to be in, so that ours reads it.
ASSUMED = "EPSG:32612"


def ours(program, path, crs):
    run = subprocess.run([program, path, *([crs] if crs else [])], capture_output=True, check=False)
    facts = run.stderr.decode()
    if run.returncode != 0:
        return None, f"CRASHED: {facts.strip().splitlines()[0]}"
    if facts.startswith("refused:"):
        return None, facts.splitlines()[0]
    return numpy.frombuffer(run.stdout, "<f8"), facts.split()


def opened(path, folder):
    """What rasterio can open: it has no gzip of formats that are told by their content, so that is undone first."""
    if path.suffix == ".gz":
        plain = pathlib.Path(folder) / path.stem
        plain.write_bytes(gzip.decompress(path.read_bytes()))
        return plain
    return path


def compare(program, path):
    with tempfile.TemporaryDirectory() as folder, rasterio.open(opened(path, folder)) as theirs:
        samples, facts = ours(program, path, None if theirs.crs else ASSUMED)
        if samples is None:
            return facts
        band = theirs.read(1).astype("f8")
        valid = theirs.read_masks(1) != 0
        band[~valid | numpy.isnan(band)] = numpy.nan
        east_step, north_step = theirs.transform.a, theirs.transform.e
        south_row = theirs.height - 0.5 if north_step < 0 else 0.5
        west, south = theirs.transform.c + 0.5 * east_step, theirs.transform.f + south_row * north_step
        epsg = theirs.crs.to_epsg() if theirs.crs else int(ASSUMED[5:])
        wanted = [theirs.width, theirs.height, epsg, west, south, east_step, abs(north_step),
                  int(numpy.isnan(band).sum()), theirs.scales[0], theirs.offsets[0]]
        names = ["width", "height", "epsg", "west", "south", "east step", "north step", "voids", "scale", "offset"]
        for name, want, found in zip(names, wanted, facts):
            if abs(float(found) - want) > 1e-9 * max(1.0, abs(want)):
                return f"DIFFERS: {name} is {found}, rasterio has {want}"
        if north_step > 0:
            band = band[::-1]
        differing = ~((band.ravel() == samples) | (numpy.isnan(band.ravel()) & numpy.isnan(samples)))
        if differing.any():
            return f"DIFFERS: {int(differing.sum())} of {samples.size} posts"
        driver = theirs.driver
    notes = f", {facts[12]} notes" if facts[12] != "0" else ""
    return f"equal: {driver}, {samples.size} posts, {facts[7]} void, {1000 * float(facts[11]):.1f} ms{notes}"


def variants(folder):
    """Writes files of every supported combination of type, compression, predictor, order and layout."""
    random = numpy.random.default_rng(7)
    ramp = numpy.add.outer(numpy.arange(93), 3 * numpy.arange(117)) + random.integers(0, 40, (93, 117))
    compressions = {"none": [1], "deflate": [1, 2, 3], "lzw": [1, 2, 3], "zstd": [1, 2, 3], "packbits": [1]}
    layouts = {"strip": {"blockysize": 7}, "one": {"blockysize": 93},
               "tile": {"tiled": True, "blockxsize": 32, "blockysize": 16}}
    types = ["uint8", "uint16", "int16", "int32", "float32", "float64"]
    for kind, (compression, predictors), layout, endian in itertools.product(
            types, compressions.items(), layouts, ["LITTLE", "BIG"]):
        for predictor in predictors:
            if predictor == 3 and "float" not in kind:
                continue
            data = (ramp % 256 if kind == "uint8" else ramp * 3 - (0 if kind[0] == "u" else 400)).astype(kind)
            if "float" in kind:
                data = (data / 7).astype(kind)
            profile = dict(driver="GTiff", width=117, height=93, count=1, dtype=kind, crs="EPSG:32611",
                           transform=Affine(12.5, 0, 500000, 0, -30, 4000000), endianness=endian,
                           nodata=data[3, 5].item(), **layouts[layout])
            if compression != "none":
                profile["compress"] = compression
            if predictor != 1:
                profile["predictor"] = predictor
            path = folder / f"{kind}_{compression}_{predictor}_{layout}_{endian}.tif"
            with rasterio.open(path, "w", **profile) as out:
                out.write(data, 1)
            yield path
    odd = {"south_up": Affine(10, 0, 5e5, 0, 10, 4e6), "rotated": Affine(10, 1, 5e5, 1, -10, 4e6)}
    for name, transform in odd.items():
        path = folder / f"{name}.tif"
        with rasterio.open(path, "w", driver="GTiff", width=117, height=93, count=1, dtype="int16", crs="EPSG:32611",
                           transform=transform) as out:
            out.write(ramp.astype("int16"), 1)
        yield path


def sources(program, data, with_variants):
    bad = 0

    def report(path, name):
        nonlocal bad
        result = compare(program, path).replace(str(path) + ": ", "")
        bad += result.startswith(("DIFFERS", "CRASHED"))
        return f"{name}  {result}"

    for path in sorted(path for path in data.rglob("*") if path.suffix in ENDINGS):
        print(report(path, path.relative_to(data)))
    if with_variants:
        with tempfile.TemporaryDirectory() as folder:
            lines = [report(path, path.name) for path in variants(pathlib.Path(folder))]
        equal = sum("  equal" in line for line in lines)
        print(f"variants: {equal} of {len(lines)} equal")
        print(*[line for line in lines if "  equal" not in line], sep="\n")
    return bad


# --- coordinate systems ---


CODES = [4326, 4269, 4258, 3857, 3395, 5070, 3035, 3034, 2154, 6350, 3310, 2193, 3577, 28355, 7855, 31982, 3979, 3005,
         3413, 3031, 5041, 5042, 32661, 2229, 2263, 26910, 26919, 25829, 25832, 25835, 4485, 4647, 3067, 3006, 2180,
         6339, 6414, 32601, 32611, 32632, 32660, 32701, 32733, 32760, 3763, 3812]
OWN = {
    "transverse mercator": "+proj=tmerc +lat_0=10 +lon_0=-116.5 +k=0.9999 +x_0=200000 +y_0=-50000 +datum=WGS84",
    "utm without a code": "+proj=tmerc +lat_0=0 +lon_0=-117 +k=0.9996 +x_0=500000 +y_0=0 +datum=NAD83",
    "lambert, 2 parallels": "+proj=lcc +lat_0=38 +lon_0=-116 +lat_1=36 +lat_2=41 +x_0=1e6 +y_0=2e5 +datum=NAD83",
    "lambert, 1 parallel": "+proj=lcc +lat_0=38 +lon_0=-116 +lat_1=38 +k_0=0.9998 +x_0=1e6 +y_0=2e5 +datum=WGS84",
    "lambert in feet": "+proj=lcc +lat_0=33.5 +lon_0=-118 +lat_1=34 +lat_2=35.5 +x_0=609601.2192 +datum=NAD83"
                       " +units=us-ft",
    "albers": "+proj=aea +lat_0=23 +lon_0=-110 +lat_1=29.5 +lat_2=45.5 +x_0=0 +y_0=0 +datum=WGS84",
    "albers, south": "+proj=aea +lat_0=-32 +lon_0=-60 +lat_1=-5 +lat_2=-42 +x_0=0 +y_0=0 +ellps=GRS80 +towgs84=0,0,0",
}


def placed(program, system, places):
    text = "\n".join(f"{lon} {lat}" for lon, lat in places)
    run = subprocess.run([program, system], input=text, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        return run.stderr.split("refused: ")[-1].splitlines()[0]
    return numpy.array([[float(word) for word in line.split()] for line in run.stdout.splitlines()])


def compare_system(program, name, system, crs, box):
    random.seed(name)
    places = [(random.uniform(box[0], box[2]), random.uniform(box[1], box[3])) for _ in range(1000)]
    found = placed(program, system, places)
    if isinstance(found, str):
        print(f"refused  {name}: {found}")
        return 0
    if crs.is_geographic:
        expected = numpy.array(places)
        unit = 111319.0
    else:
        expected = numpy.column_stack(pyproj.Proj(crs)(*numpy.array(places).T))
        unit = crs.axis_info[0].unit_conversion_factor
    off = numpy.abs(found[:, :2] - expected).max() * unit * 1000
    back = numpy.abs(found[:, 2:] - numpy.array(places)).max() * 111319000.0
    worst = max(off, back)
    verdict = "equal " if worst < 1 else "DIFFERS"
    print(f"{verdict}  {name}: {off:.6f} mm there, {back:.6f} mm back")
    return int(not worst < 1)


def crs(program):
    bad = 0
    for code in CODES:
        crs = pyproj.CRS.from_epsg(code)
        area = crs.area_of_use
        west, east = (area.west, area.east) if area.west < area.east else (area.west, 180.0)
        box = (west, max(area.south, -89.9), east, min(area.north, 89.9))
        bad += compare_system(program, f"EPSG:{code} {crs.name}", f"EPSG:{code}", crs, box)
    with tempfile.TemporaryDirectory() as folder:
        for name, definition in OWN.items():
            crs = pyproj.CRS.from_proj4(definition)
            box = (-70, -45, -50, -10) if "south" in name else (-119, 32, -113, 42)
            for dialect in ["WKT1_ESRI", "WKT1_GDAL"]:
                bad += compare_system(program, f"{name}, {dialect}", crs.to_wkt(dialect), crs, box)
            path = pathlib.Path(folder) / f"{name}.tif"
            with rasterio.open(path, "w", driver="GTiff", width=2, height=2, count=1, dtype="int16", crs=definition,
                               transform=Affine(10, 0, 5e5, 0, -10, 4e6)) as out:
                out.write(numpy.zeros((1, 2, 2), "int16"))
            bad += compare_system(program, f"{name}, GeoKeys", str(path), crs, box)
    return bad


# --- resampling ---


CASES = [  # file, EPSG code, east, north, columns, rows, spacing
    ("ntc_standin/bavarian_alps_50km_1979x1979_utm32n.tif", 32632, 657250, 5264750, 1981, 1981, 25),
    ("ntc_standin/bavarian_alps_50km_1979x1979_utm32n.tif", 25832, 657250, 5264750, 1981, 1981, 25),
    ("dem/alps_north_n47e011_1arcsec_3600x1800.tif", 32632, 655000, 5264000, 2401, 1801, 25),
    ("formats/dted/w121/n36.dt1", 32610, 690000, 3990000, 1281, 1601, 62.5),
    ("formats/hgt/N38W029.SRTMGL3.hgt.zip", 32626, 330000, 4210000, 1201, 1601, 62.5),
    ("formats/geotiff/native/grandcanyon_webmercator_512.tif", 32612, 303000, 3990500, 470, 470, 62.5),
    ("formats/geotiff/variants/geographic_nad83_f32_nodata-9999.tif", 32612, 287000, 4866000, 420, 340, 31.25),
]


def theirs(path, epsg, east, north, cols, rows, spacing, how, wide):
    """The heights, and the seconds to read and to warp, in strips of `wide` columns."""
    started = time.perf_counter()
    with rasterio.open(path) as source:
        band = source.read(1)
        read = time.perf_counter() - started
        out = numpy.full((rows, cols), numpy.nan, "f4")
        started = time.perf_counter()
        for west in range(0, cols, wide):
            strip = numpy.full((rows, min(wide, cols - west)), numpy.nan, "f4")
            to = Affine(spacing, 0, east + (west - 0.5) * spacing, 0, -spacing, north + (rows - 0.5) * spacing)
            reproject(band, strip, src_transform=source.transform, src_crs=source.crs, src_nodata=source.nodata,
                      dst_transform=to, dst_crs=f"EPSG:{epsg}", dst_nodata=numpy.nan, num_threads=1,
                      resampling=Resampling.cubic if how == "cubic" else Resampling.bilinear)
            out[:, west:west + wide] = strip
        return out, read, time.perf_counter() - started


def shift(ours, other):
    """By how many posts, east and north, ours has to be moved to lie on the other."""
    north, east = numpy.gradient(other)
    off = other - ours
    good = ~numpy.isnan(north) & ~numpy.isnan(east) & ~numpy.isnan(off)
    slopes = numpy.column_stack([east[good], -north[good]])
    return numpy.linalg.lstsq(slopes, off[good], rcond=None)[0], numpy.sqrt(numpy.mean(off[good] ** 2)), good.sum()


def warp(program, data):
    bad = 0
    for case in CASES:
        for how in ["bilinear", "cubic"]:
            path, epsg, east, north, cols, rows, spacing = case
            words = [program, how, *map(str, [epsg, east, north, cols, rows, spacing]), str(data / path)]
            run = subprocess.run(words, capture_output=True, check=True)
            ours = numpy.frombuffer(run.stdout, "<f4").reshape(rows, cols)
            own = [float(word) for word in run.stderr.split()]
            _, read, warp = theirs(data / path, *case[1:], how, cols)
            other, _, _ = theirs(data / path, *case[1:], how, 32)
            (x, y), rms, count = shift(ours.astype("f8"), other.astype("f8"))
            bad += not max(abs(x), abs(y)) < 0.02
            print(f"{pathlib.Path(path).name} to EPSG:{epsg}, {how}: shift {x:+.5f} {y:+.5f} posts, RMS {rms:.3f} m")
            print(f"    {count} posts; ours {own[0]:.3f} s to read + {own[1]:.3f} s to resample, "
                  f"GDAL {read:.3f} s + {warp:.3f} s")
    return bad


def bilinear(heights, rows, cols):
    """Heights at every pair of a row and a column, in posts."""
    near = [numpy.clip(numpy.floor(at).astype(int), 0, size - 2) for at, size in zip((rows, cols), heights.shape)]
    up, right = (rows - near[0])[:, None], (cols - near[1])[None, :]
    corner = [[heights[numpy.ix_(near[0] + i, near[1] + j)] for j in (0, 1)] for i in (0, 1)]
    south = corner[0][0] * (1 - right) + corner[0][1] * right
    north = corner[1][0] * (1 - right) + corner[1][1] * right
    return south * (1 - up) + north * up


def averaged(heights, reach):
    """Each post the mean of the square that reaches so many posts around it."""
    if reach == 0:
        return heights
    side = 2 * reach + 1
    padded = numpy.pad(heights, reach, mode="edge")
    sums = numpy.zeros((padded.shape[0] + 1, padded.shape[1] + 1))
    sums[1:, 1:] = padded.cumsum(0).cumsum(1)
    return (sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]) / side**2


def antialias(paths):
    for path in paths:
        heights = rasterio.open(path).read(1).astype(float)
        for ratio in (1.25, 2, 3, 5, 8):
            rows, cols = (numpy.arange(0, size - 1, ratio) for size in heights.shape)
            inner = [numpy.arange(0, int(at[-1])) for at in (rows, cols)]
            found = []
            for reach in sorted({0, int((ratio - 1) / 2), round(ratio / 2)}):
                coarse = bilinear(averaged(heights, reach), rows, cols)
                off = bilinear(coarse, inner[0] / ratio, inner[1] / ratio) - heights[: len(inner[0]), : len(inner[1])]
                found.append(f"h = {reach}: RMS {numpy.sqrt((off ** 2).mean()):6.3f} m, max {abs(off).max():4.0f} m")
            print(path.rsplit("/", 1)[-1][:32], f"{ratio} times coarser:", "; ".join(found))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["sources", "crs", "warp", "antialias"])
    parser.add_argument("dems", nargs="*")
    parser.add_argument("--variants", action="store_true")
    parser.add_argument("--examples", type=pathlib.Path, default=EXAMPLES, help="the folder of the built examples")
    options = parser.parse_args()
    if options.what == "antialias":
        return antialias(options.dems)
    if options.what == "crs":
        return 1 if crs(options.examples / "place_points") else 0
    if options.what == "warp":
        return 1 if warp(options.examples / "resample_posts", DATA) else 0
    return 1 if sources(options.examples / "read_posts", DATA, options.variants) else 0


if __name__ == "__main__":
    sys.exit(main())
