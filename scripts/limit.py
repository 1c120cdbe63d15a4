#!/usr/bin/env python3
"""Measure how far `tiefort tin` is from the best surface of so many triangles: prints a Markdown table.

    scripts/limit.py                         all efforts at 2,000 and 8,000 triangles on five surfaces
    scripts/limit.py --triangles 500 2000    other numbers of triangles
    scripts/limit.py --efforts normal        some efforts only
    scripts/limit.py --sight true            other options of `tiefort tin`: whatever is not known here is handed on
    scripts/limit.py --book                  also put the table into the book
    scripts/limit.py --binary PATH           another program than target/release/tiefort, which has to be built

On smooth ground a continuous surface of N triangles has at least an RMS residual of about

    (1 / N) * (integral of (kappa |det H|)^(1/3))^(3/2) / sqrt(area)

where H is the ground's Hessian and kappa is 1/180 where det H > 0 and 1/90 where det H < 0 (the latter is the best
mesh that is known, not a proven bound). Eta is a surface's RMS residual over that. The limit holds for large N: where
N is small or the ground rough for it, eta may fall below 1.

The limit is one of plain squares, so `--sight false` is asked for unless other options are given.

Hessians are written down here, meshes are rasterised by NumPy: no code is shared with the compiler. The exit code is 1
when the worst eta of an effort is above its bar.
"""

import argparse
import pathlib
import subprocess
import sys

from book import ROOT, put
from fidelity.workshop import FOLDER, TARGET, markdown, prepare_venv

POSTS = 1001
BARS = {"fast": 2.0, "normal": 1.18, "best": 1.12}


def surfaces(numpy):
    """Heights in metres and the determinant of the Hessian at every post, by name; posts are a metre apart."""
    y, x = numpy.mgrid[0:POSTS, 0:POSTS] - (POSTS - 1) / 2
    squared, narrow = x * x + y * y, 220.0**2
    yield "bowl", 0.01 * squared, numpy.full(x.shape, 4e-4)
    yield "saddle", 0.02 * x * y, numpy.full(x.shape, -4e-4)
    yield "trough", 0.002 * (x * x + 25 * y * y), numpy.full(x.shape, 4e-4)
    hill = 900 * numpy.exp(-squared / (2 * narrow))
    yield "hill", hill, (hill / narrow) ** 2 * (1 - squared / narrow)
    turn = 2 * numpy.pi / 500
    sines, cosines = [function(turn * x) * function(turn * y) for function in (numpy.sin, numpy.cos)]
    yield "waves", 120 * sines, (120 * turn**2) ** 2 * (sines**2 - cosines**2)


def limit_of(numpy, determinant, triangles):
    """The RMS residual in metres below which no surface of so many triangles is expected."""
    kappa = numpy.where(0 < determinant, 1 / 180, 1 / 90)
    area = (POSTS - 1) ** 2
    integral = numpy.cbrt(kappa * numpy.abs(determinant)).mean() * area
    return integral**1.5 / area**0.5 / triangles


def read_ply(numpy, path):
    """Vertices in metres from the south-west post, and triangles, of a binary PLY."""
    head, _, data = path.read_bytes().partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    vertices = numpy.frombuffer(data, "<f4", 3 * counts[0]).reshape(-1, 3).astype("f8")
    faces = numpy.frombuffer(data, [("count", "u1"), ("corners", "<u4", 3)], counts[1], 12 * counts[0])
    return vertices, faces["corners"]


def rms_of(numpy, heights, vertices, triangles):
    """RMS residual over all posts, each under the last triangle that holds it; every post has to lie under one."""
    surface = numpy.full(heights.shape, numpy.nan)
    for a, b, c in vertices[triangles]:
        corners = numpy.array([a, b, c])
        west, south = numpy.ceil(corners[:, :2].min(axis=0)).astype(int)
        east, north = numpy.floor(corners[:, :2].max(axis=0)).astype(int)
        x, y = numpy.arange(west, east + 1)[None, :], numpy.arange(south, north + 1)[:, None]
        cross = lambda p, q: (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
        parts = [cross(b, c), cross(c, a), cross(a, b)]
        inside = (0 <= parts[0]) & (0 <= parts[1]) & (0 <= parts[2])
        height = (parts[0] * a[2] + parts[1] * b[2] + parts[2] * c[2]) / (parts[0] + parts[1] + parts[2])
        surface[south : north + 1, west : east + 1][inside] = height[inside]
    if numpy.isnan(surface).any():
        sys.exit(f"{numpy.isnan(surface).sum()} posts lie under no triangle")
    return ((surface - heights) ** 2).mean() ** 0.5


def write_raster(path, heights):
    import rasterio

    profile = {"driver": "GTiff", "width": POSTS, "height": POSTS, "count": 1, "dtype": "float32"}
    profile |= {"crs": "EPSG:32611", "transform": rasterio.Affine(1, 0, 500_000, 0, -1, 4_000_000)}
    with rasterio.open(path, "w", **profile) as raster:
        raster.write(heights[::-1].astype("f4"), 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", nargs="+", type=int, default=[2000, 8000])
    parser.add_argument("--efforts", nargs="+", choices=list(BARS), default=list(BARS))
    parser.add_argument("--book", action="store_true")
    parser.add_argument("--binary", type=pathlib.Path, default=TARGET / "release" / "tiefort")
    options, others = parser.parse_known_args()
    others = others or ["--sight", "false"]
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    import numpy

    worst = dict.fromkeys(options.efforts, 0.0)
    rows = []
    for name, heights, determinant in surfaces(numpy):
        raster, mesh = FOLDER / f"{name}.tif", FOLDER / "limit.ply"
        write_raster(raster, heights)
        cells = [name]
        for effort in options.efforts:
            found = []
            for triangles in options.triangles:
                words = ["tin", raster, "--triangles", triangles, "--effort", effort, *others, "--out", mesh]
                subprocess.run([options.binary, *map(str, words)], check=True, capture_output=True)
                vertices, corners = read_ply(numpy, mesh)
                eta = rms_of(numpy, heights, vertices, corners) / limit_of(numpy, determinant, len(corners))
                worst[effort] = max(worst[effort], eta)
                found.append(f"{eta:.3f}")
            cells.append(" / ".join(found))
        rows.append(cells)
    counts = " / ".join(f"{count:,}" for count in options.triangles)
    head = f"eta at N = {counts}"
    markdown(head, ["surface", *options.efforts], rows)
    if options.book:
        worst_row = ["the worst", *(f"**{worst[effort]:.3f}**" for effort in options.efforts)]
        lines = [[head, *options.efforts], ["-"] + ["-:"] * len(options.efforts), *rows, worst_row]
        put(ROOT / "docs" / "fidelity.md", "eta", "\n".join(f"| {' | '.join(line)} |" for line in lines))
    missed = [effort for effort, eta in worst.items() if BARS[effort] < eta]
    for effort, eta in worst.items():
        print(f"{'MISSED' if effort in missed else 'met   '} {effort}: worst eta {eta:.3f}, at most {BARS[effort]}")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
