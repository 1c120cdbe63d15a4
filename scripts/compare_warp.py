#!/usr/bin/env python3
"""Compare our resampling between coordinate systems with GDAL's, on real rasters: heights, shift and time on one core.

    python3 -m venv /tmp/compare && /tmp/compare/bin/pip install rasterio
    cargo build --release -p source-files --example resample_posts
    /tmp/compare/bin/python scripts/compare_warp.py target/release/examples/resample_posts DATA_FOLDER

The shift is that of our heights against GDAL's by least squares over the slopes, in posts of the grid. Exit code 1
when one is 0.02 posts or more. GDAL interpolates its projected places along each line and lets them be an eighth of a
post off, which is several hundredths on average; its heights are compared in strips so narrow that this vanishes, its
time is that of the whole.
"""

import pathlib
import subprocess
import sys
import time

import numpy
import rasterio
from rasterio.transform import Affine
from rasterio.warp import Resampling, reproject

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


def main():
    program, data, bad = sys.argv[1], pathlib.Path(sys.argv[2]), 0
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
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
