#!/usr/bin/env python3
"""Compare our readers of rasters with rasterio (GDAL), post by post.

    python3 -m venv /tmp/compare && /tmp/compare/bin/pip install rasterio
    cargo build --release -p source-files --example read_posts
    /tmp/compare/bin/python scripts/compare_sources.py target/release/examples/read_posts DATA_FOLDER [--variants]

Every raster below the folder is read by both: GeoTIFF, DTED, HGT (also in .gz and .zip), Esri ASCII, raw grids. A file
is `equal` when size, coordinate system, place of every post, voids and every sample agree; `refused` when ours gives a
named error. With --variants, files of every supported combination of type, compression, predictor, byte order and
layout are written by rasterio and compared too. Exit code 1 when any file differs.
"""

import gzip
import itertools
import pathlib
import subprocess
import sys
import tempfile

import numpy
import rasterio
from rasterio.transform import Affine

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


def main():
    program, data = sys.argv[1], pathlib.Path(sys.argv[2])
    bad = 0

    def report(path, name):
        nonlocal bad
        result = compare(program, path).replace(str(path) + ": ", "")
        bad += result.startswith(("DIFFERS", "CRASHED"))
        return f"{name}  {result}"

    for path in sorted(path for path in data.rglob("*") if path.suffix in ENDINGS):
        print(report(path, path.relative_to(data)))
    if "--variants" in sys.argv:
        with tempfile.TemporaryDirectory() as folder:
            lines = [report(path, path.name) for path in variants(pathlib.Path(folder))]
        equal = sum("  equal" in line for line in lines)
        print(f"variants: {equal} of {len(lines)} equal")
        print(*[line for line in lines if "  equal" not in line], sep="\n")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
