"""How far the ground is from the best there can be, on smooth surfaces and beside lines between tiles."""

import dataclasses
import math
import subprocess
import sys

from benches import areas
from benches.common import (FIGURES, FOLDER, ROOT, compiled, evaluate, markdown, number, parser_of, prepare_venv,
                            program, put, ratio, skip, tell, why, write_heights)

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


def write_raster(path, heights):
    import rasterio

    profile = {"driver": "GTiff", "width": POSTS, "height": POSTS, "count": 1, "dtype": "float32"}
    profile |= {"crs": "EPSG:32611", "transform": rasterio.Affine(1, 0, 500_000, 0, -1, 4_000_000)}
    with rasterio.open(path, "w", **profile) as raster:
        raster.write(heights[::-1].astype("f4"), 1)


def limit():
    """Measure how far `tiefort tin` is from the best surface of so many triangles: prints a Markdown table.

        scripts/bench.py limit                         all efforts at 2,000 and 8,000 triangles on five surfaces
        scripts/bench.py limit --triangles 500 2000    other numbers of triangles
        scripts/bench.py limit --efforts normal        some efforts only
        scripts/bench.py limit --sight true            other options are handed on to `tiefort tin`
        scripts/bench.py limit --book                  also put the table into the book

    On smooth ground a continuous surface of N triangles has at least an RMS residual of about

        (1 / N) * (integral of (kappa |det H|)^(1/3))^(3/2) / sqrt(area)

    where H is the ground's Hessian and kappa is 1/180 where det H > 0 and 1/90 where det H < 0 (the latter is the best
    mesh that is known, not a proven bound). Eta is a surface's RMS residual over that. The limit holds for large N:
    where N is small or the ground rough for it, eta may fall below 1.

    The limit is one of plain squares, so `--sight false` is asked for unless other options are given.

    Hessians are written down here, meshes are judged by scripts/benches/evaluate.cpp: no code is shared with the
    compiler. The exit code is 1 when the worst eta of an effort is above its bar.
    """
    parser = parser_of(limit)
    parser.add_argument("--triangles", nargs="+", type=int, default=[2000, 8000])
    parser.add_argument("--efforts", nargs="+", choices=list(BARS), default=list(BARS))
    parser.add_argument("--book", action="store_true")
    options, others = parser.parse_known_args()
    tiefort, others = program(options), others or ["--sight", "false"]
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    import numpy

    worst = dict.fromkeys(options.efforts, 0.0)
    rows = []
    for name, heights, determinant in surfaces(numpy):
        raster, mesh = FOLDER / f"{name}.tif", FOLDER / "limit.ply"
        raw = FOLDER / f"{name}.heights"
        write_raster(raster, heights)
        write_heights(raw, heights)
        cells = [name]
        for effort in options.efforts:
            found = []
            for triangles in options.triangles:
                words = ["tin", raster, "--triangles", triangles, "--effort", effort, *others, "--out", mesh]
                subprocess.run([tiefort, *map(str, words)], check=True, capture_output=True)
                judged = evaluate(mesh, raw, (1, 1), "--sight-lines", 0)
                eta = judged["rms_m"] / limit_of(numpy, determinant, judged["triangles"])
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


# --- lines between tiles, and the outer border ---


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


def borders():
    """Measure whether residuals are larger near lines between tiles and near the outer border: prints a Markdown table.

        scripts/bench.py borders                      every real area
        scripts/bench.py borders --only desert        areas with this in their name
        scripts/bench.py borders --effort best        another effort of the optimised method
        scripts/bench.py borders --profile            also residuals by distance from a tile line or the border
        scripts/bench.py borders --book               also put the table into the book

    Near is within 1 km. Ground may be hard where a line happens to run, so each ratio has a control:

    - tile lines: RMS residual near lines of 6 x 6 tiles over that elsewhere; control: the same posts of the same area
    built   as one tile, where no line runs. A second one, for lines that run where the ground is like elsewhere: the
    same tiles,   near lines half a tile aside. - outer border: RMS residual near the border of an area over that
    elsewhere; control: the same posts of an area that is   2 km larger on every side, where they lie inside. Both are
    built as one tile.

    `of control` is what lines and border cost: 1.00 is nothing. Every surface is judged at every post by
    scripts/benches/evaluate.cpp, which shares no code with the compiler. The exit code is 1 when a ratio to its
    control is above 1.03.
    """
    parser = parser_of(borders)
    parser.add_argument("--only", metavar="NAME")
    parser.add_argument("--effort", choices=areas.EFFORTS, default="normal")
    parser.add_argument("--profile", action="store_true")
    parser.add_argument("--book", action="store_true")
    options = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    if not compiled("evaluate"):
        sys.exit("without its evaluator this script has nothing to say")
    tiefort = program(options)
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
