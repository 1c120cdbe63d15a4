#!/usr/bin/env python3
"""Should heights be averaged when the working grid is coarser than the raster? (No.)

    python3 -m venv /tmp/compare && /tmp/compare/bin/pip install numpy rasterio
    /tmp/compare/bin/python scripts/compare_antialias.py DEM.tif…

A raster is resampled to a grid so many times coarser, bilinearly, once as it is and once averaged over a square of
2 h + 1 posts before. Printed is how far the surface through the coarse posts then lies from every post of the raster.
Ground has most of its height in its largest forms, so averaging flattens crests by more than sampling misses.
"""

import sys

import numpy
import rasterio


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


def main():
    for path in sys.argv[1:]:
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


if __name__ == "__main__":
    main()
