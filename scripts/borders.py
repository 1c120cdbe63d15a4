#!/usr/bin/env python3
"""Measure whether residuals are larger near lines between tiles and near the outer border: prints a Markdown table.

    scripts/borders.py                      every real area
    scripts/borders.py --only desert        areas with this in their name
    scripts/borders.py --effort best        another effort of the optimised method
    scripts/borders.py --profile            also the residual by distance from a tile line, and from the outer border
    scripts/borders.py --book               also put the table into the book
    scripts/borders.py --binary PATH        another program than target/release/tiefort, which has to be built

Near is within 1 km. Ground may be hard where a line happens to run, so each ratio has a control:

- tile lines: RMS residual near lines of 6 x 6 tiles over that elsewhere; control: the same posts of the same area built
  as one tile, where no line runs. A second one, for lines that run where the ground is like elsewhere: the same tiles,
  near lines half a tile aside.
- outer border: RMS residual near the border of an area over that elsewhere; control: the same posts of an area that is
  2 km larger on every side, where they lie inside. Both are built as one tile.

`of control` is what lines and border cost: 1.00 is nothing. Every surface is judged at every post by
scripts/fidelity/evaluate.cpp, which shares no code with the compiler. The exit code is 1 when a ratio to its control is
above 1.03.
"""

import argparse
import dataclasses
import math
import pathlib
import sys

from book import FIGURES, put
from fidelity import areas
from fidelity.workshop import (FOLDER, TARGET, compiled, markdown, number, prepare_venv, ratio, skip, tell, why,
                               write_heights)

TILES = 6
BAR = 1.03
LARGER_M = 2000
HEAD = ["area", "RMS m", "tile lines", "as one tile", "of control", "half a tile aside", "outer border",
        "inside a larger area", "of control"]
# Ends of the bands of distance from a line, in metres.
BANDS_M = (0, 50, 125, 250, 500, 1000)


def residuals_of(tiefort, area, tiles, effort):
    """Surface less ground at every post of a build; None when it cannot be built."""
    import numpy

    path = FOLDER / "area.residuals"
    tin = {"method": "optimised", "effort": effort}
    job = areas.changed(area.job, tiles={"columns": tiles, "rows": tiles}, tin=tin)
    options = ["--sight-lines", 0, "--residuals", path]
    ran = areas.build(tiefort, area, job, page=False, options=options)
    if "report" not in ran:
        return skip(area.name, why(ran))
    return numpy.fromfile(path, "<f4", offset=8).reshape(area.heights.shape).astype("f8")


def inner(area):
    """The same area without its outermost 2 km, and how many posts those are."""
    posts = int(LARGER_M // area.spacing_m[0])
    place = area.job["area"]
    smaller = {"origin_m": [start + LARGER_M for start in place["origin_m"]],
               "size_m": [length - 2 * LARGER_M for length in place["size_m"]]}
    heights = area.heights[posts:-posts, posts:-posts]
    raw = FOLDER / "inner-area.heights"
    write_heights(raw, heights)
    return dataclasses.replace(area, job=areas.changed(area.job, area=smaller), heights=heights, raw=raw), posts


def tile_lines(job, axis, aside=0.0):
    """Posts at which tiles meet along an axis."""
    posts_a_module = int(areas.MODULE_M // job["area"]["spacing_m"])
    modules = int(job["area"]["size_m"][axis] // areas.MODULE_M)
    return [math.ceil((tile + aside) * modules / TILES) * posts_a_module for tile in range(1, TILES)]


def distances(job, shape, aside=0.0):
    """Posts from every post to the nearest tile line."""
    import numpy

    rows, columns = (numpy.abs(numpy.arange(posts)[:, None] - tile_lines(job, axis, aside)).min(axis=1)
                     for posts, axis in zip(shape, (1, 0)))
    return numpy.minimum(rows[:, None], columns[None, :])


def rms(residuals, where):
    return float((residuals[where] ** 2).mean() ** 0.5)


def near_over_elsewhere(residuals, near):
    return rms(residuals, near) / rms(residuals, ~near)


def measure(tiefort, area, effort):
    """The figures of an area, by name; None when it cannot be built."""
    import numpy

    tell(f"{area.name}: {TILES} x {TILES} tiles")
    tiled = residuals_of(tiefort, area, TILES, effort)
    tell(f"{area.name}: one tile")
    whole = residuals_of(tiefort, area, 1, effort)
    small, aside = inner(area)
    tell(f"{area.name}: one tile, without its outermost 2 km")
    cut = residuals_of(tiefort, small, 1, effort)
    if tiled is None or whole is None or cut is None:
        return None
    within = areas.NEAR_SEAMS_M / area.spacing_m[0]
    away = distances(area.job, tiled.shape)
    near, shifted = away <= within, distances(area.job, tiled.shape, 0.5) <= within
    same = whole[aside:-aside, aside:-aside]
    rows, columns = (numpy.minimum(numpy.arange(posts), numpy.arange(posts)[::-1]) for posts in cut.shape)
    inside = numpy.minimum(rows[:, None], columns[None, :])
    border = inside <= within
    return {
        "rms_m": rms(tiled, ~numpy.isnan(tiled)),
        "lines": near_over_elsewhere(tiled, near),
        "lines_control": near_over_elsewhere(whole, near),
        "shifted": near_over_elsewhere(tiled, shifted),
        "border": near_over_elsewhere(cut, border),
        "border_control": near_over_elsewhere(same, border),
        "profile": by_distance(tiled, whole, away, area.spacing_m[0]),
        "border_profile": by_distance(cut, same, inside, area.spacing_m[0]),
    }


def by_distance(residuals, control, away, spacing_m):
    """RMS residual over that of the control, by distance from a line; None where no post lies so far."""
    ends = [metres / spacing_m for metres in BANDS_M] + [away.max() + 1]
    bands = [(begin <= away) & (away < end) for begin, end in zip(ends, ends[1:])]
    return [rms(residuals, band) / rms(control, band) if band.any() else None for band in bands]


def cells(name, found):
    return [
        name, number(found["rms_m"], 3), number(found["lines"], 3), number(found["lines_control"], 3),
        f"**{ratio(found['lines'], found['lines_control'])}**", number(found["shifted"], 3),
        number(found["border"], 3), number(found["border_control"], 3),
        f"**{ratio(found['border'], found['border_control'])}**",
    ]


def profiles(results):
    words = [f"{begin} to {end} m" for begin, end in zip(BANDS_M, BANDS_M[1:])] + [f"{BANDS_M[-1]} m and more"]
    for key, title in [("profile", "RMS residual over that of the control, by distance from a tile line"),
                       ("border_profile", "RMS residual over that of the control, by distance from the outer border")]:
        rows = [[name, *(number(share, 3) for share in found[key])] for name, found in results.items()]
        markdown(title, ["area", *words], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="NAME")
    parser.add_argument("--effort", choices=areas.EFFORTS, default="normal")
    parser.add_argument("--profile", action="store_true")
    parser.add_argument("--book", action="store_true")
    parser.add_argument("--binary", type=pathlib.Path, default=TARGET / "release" / "tiefort")
    options = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    if not compiled("evaluate"):
        sys.exit("without its evaluator this script has nothing to say")
    tiefort = options.binary.resolve(strict=True)
    wanted = lambda name: options.only is None or options.only in name
    results = {}
    for area in areas.areas(tiefort, False, wanted, areas.REAL):
        found = measure(tiefort, area, options.effort)
        if found:
            results[area.name] = found
            tell("  ".join(cells(area.name, found)))
    if not results:
        sys.exit("nothing was measured: no area has such a name, or its raster is missing")
    rows = [cells(*item) for item in results.items()]
    markdown("RMS residual within 1 km, over that elsewhere", HEAD, rows)
    if options.profile:
        profiles(results)
    if options.book:
        lines = [HEAD, ["-"] + ["-:"] * (len(HEAD) - 1), *rows]
        put(FIGURES, "borders", "\n".join(f"| {' | '.join(line)} |" for line in lines))
    missed = [f"{name}, {what}" for name, found in results.items() for what in ("lines", "border")
              if BAR < found[what] / found[f"{what}_control"]]
    print(f"\nabove {BAR} of their control: {', '.join(missed) or 'none'}")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
