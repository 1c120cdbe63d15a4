#!/usr/bin/env python3
"""Measure how true the ground is at an equal number of triangles, against peers: prints Markdown tables.

    scripts/bench_fidelity.py                  everything but the largest collapse
    scripts/bench_fidelity.py --quick          the desert window and the desert job only
    scripts/bench_fidelity.py --large          Lindstrom-Turk on large rasters too: minutes, a gigabyte
    scripts/bench_fidelity.py --only desert    inputs and jobs whose name has this in it
    scripts/bench_fidelity.py --json all.json  every figure, for a program
    scripts/bench_fidelity.py --quick --book   put the figures of the desert into README and the book
    scripts/bench_fidelity.py --tables 4 --book                put what each effort costs and gains into the book
    scripts/bench_fidelity.py --tables 4 --before PROGRAM      hold it against an earlier program, too

1. Equal triangles, no load modules, per raster: greedy insertion (`pydelatin`) of so many points gives the number of
   triangles; CGAL's Lindstrom-Turk edge collapse and `tiefort tin --triangles` are asked for the same.
2. Equal triangles, all limits, per job: `optimised` against the regular 125 m grid and against the paper's method with
   clipped edges, brought by bisection over its points to the mean the limits allow. Points are shared equally among
   tiles, the paper's practice, and by need; ratios and bars take the better of the two.
3. What cutting an area into tiles costs, and sharing triangles equally among them.
4. What each effort costs and gains on every real area: residual, lines of sight for eyes at 1, 2.5 and 10 m, angles
   below 5 degrees, processor time of the build without its page. Only where it is asked for.

Every mesh and every database is judged by scripts/fidelity/evaluate.cpp, which shares no code with the compiler (its
own test: scripts/fidelity/selftest.py). Where Lindstrom-Turk folds over, the topmost triangle counts.

Seconds of table 1 are from heights in memory to the mesh. Greedy and Lindstrom-Turk are timed around the call; ours
are the seconds that the program prints for its stages after `read` (refining, merging, measuring: all but reading and
writing), with one worker. Short runs are repeated and the best counts. Seconds of tables 2 and 3 are those of the
whole process, reading and publishing included, on all cores; MB is its peak memory.

Table 4 needs 10 minutes on two cores, twice that with an earlier program.

Faults of a mesh are told in short; --json has them all. Missing rasters, programs or options are skipped loudly. The
exit code is 1 when a bar is missed.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import time

from bench import ROOT, load
from fidelity import areas, bars, headline, terrain
from fidelity.workshop import (FOLDER, TARGET, compiled, digest, evaluate, faults, lindstrom_turk, markdown, number,
                               prepare_venv, ratio, run, skip, tell, why, write_mesh)

# Short runs are repeated until they took so long together, or so often.
REPEAT_S, REPEAT_MAX = 2.0, 5

# Our rows: options beside --triangles.
OURS = {
    "fast": ["--effort", "fast", "--sight", "false"],
    "normal": ["--effort", "normal", "--sight", "false"],
    "best": ["--effort", "best", "--sight", "false"],
    "normal, on posts": ["--effort", "normal", "--sight", "false", "--lattice", "post"],
    "fast, sight": ["--effort", "fast", "--sight", "true"],
    "normal, sight": ["--effort", "normal", "--sight", "true"],
    "best, sight": ["--effort", "best", "--sight", "true"],
}
# What a binary without --triangles and --effort is asked for instead, so that the rest can be tried.
STAND_INS = {
    "greedy, max": ["--method", "greedy", "--key", "max"],
    "greedy, sse": ["--method", "greedy", "--key", "sse"],
}
HEAD = ["", "triangles", "RMS m", "of greedy", "of L-T", "max m", "seconds", "of greedy", "valid", "sight %",
        "visible %", "slope RMS"]


# --- what runs ---


def best_of(once):
    """Repeats a short run; the one of fewest seconds."""
    runs = [once()]
    while sum(one["seconds"] for one in runs) < REPEAT_S and len(runs) < REPEAT_MAX and "error" not in runs[0]:
        runs.append(once())
    return min(runs, key=lambda one: one["seconds"])


def run_greedy(ground, points):
    from pydelatin import Delatin

    # Rows from the north, as it expects; its y axis then points north, too.
    heights = ground.heights[::-1].copy()

    def once():
        start = time.perf_counter()
        mesh = Delatin(heights, max_points=points, max_error=0)
        return {"seconds": time.perf_counter() - start, "mesh": mesh}

    found = best_of(once)
    path = FOLDER / "greedy.mesh"
    write_mesh(path, found["mesh"].vertices, found["mesh"].triangles)
    return {"seconds": found["seconds"], "file": path}


def run_lindstrom_turk(program, ground, triangles, reuse):
    """One run: it takes seconds to minutes. With `reuse`, that of an earlier call on the same heights counts."""
    path = FOLDER / f"{ground.name}-{triangles}.mesh"
    note = path.with_suffix(".json")
    same = {"heights": digest(ground.raw), "program": digest(program)}
    if reuse and path.exists() and note.exists():
        found = json.loads(note.read_text())
        if all(found[key] == value for key, value in same.items()):
            return {"seconds": found["seconds"], "file": path, "earlier": True}
    ran = run(program, ground.raw, *ground.spacing_m, triangles, path)
    if ran["code"] != 0:
        return {"error": why(ran)}
    seconds = json.loads(ran["out"])["seconds"]
    note.write_text(json.dumps(same | {"seconds": seconds}))
    return {"seconds": seconds, "file": path, "peak_mb": ran["peak_mb"]}


def run_ours(tiefort, ground, options):
    """`tiefort tin`; its seconds are those of its stages after reading."""
    path = FOLDER / "ours.ply"

    def once():
        ran = run(tiefort, "tin", ground.dem, *options, "--workers", 1, "--json", "--out", path)
        if ran["code"] != 0:
            return {"seconds": 0.0, "error": why(ran)}
        events = [json.loads(line) for line in ran["out"].splitlines()]
        stages = {event["stage"]: event["wall_s"] for event in events if event["event"] == "leave"}
        seconds = sum(wall_s for stage, wall_s in stages.items() if stage != "read")
        return {"seconds": seconds, "process_s": ran["wall_s"], "peak_mb": ran["peak_mb"], "file": path}

    return best_of(once)


def our_rows(tiefort, points, triangles):
    """Options of our runs by name: those this binary knows."""
    known = run(tiefort, "tin", "--help")["out"]
    if "--triangles" not in known:
        skip("equal triangles", "this binary's tin has no --triangles; greedy insertion of the same points stands in")
        return {name: [*options, "--points", points] for name, options in STAND_INS.items()}
    rows = {}
    for name, options in OURS.items():
        missing = [option for option in options if option.startswith("--") and option not in known]
        if missing:
            skip(name, f"this binary's tin has no {', '.join(missing)}")
        else:
            rows[name] = [*options, "--triangles", triangles]
    return rows


# --- the first table ---


def compare(tiefort, collapse, ground, points, options):
    """The table of a raster at the triangles that greedy insertion of `points` gives; its rows by name."""
    results = {}

    def judge(name, made):
        if "error" in made:
            return skip(f"{ground.name}, {name}", made["error"])
        judged = evaluate(made.pop("file"), ground.raw, ground.spacing_m)
        results[name] = made | {"judged": judged}

    judge("greedy", run_greedy(ground, points))
    triangles = results["greedy"]["judged"]["triangles"]
    if collapse and (options.large or not ground.large):
        tell(f"{ground.name}: Lindstrom-Turk to {triangles:,} triangles")
        judge("Lindstrom-Turk", run_lindstrom_turk(collapse, ground, triangles, options.reuse_peer))
    elif collapse:
        skip(f"{ground.name}, Lindstrom-Turk", f"{ground.heights.size:,} posts take minutes and a gigabyte: --large")
    for name, words in our_rows(tiefort, points, triangles).items():
        tell(f"{ground.name}: {name}")
        judge(name, run_ours(tiefort, ground, words))
    seen = results["greedy"]["judged"]["sight"]["dem_visible"]
    title = f"{ground.name}, {points:,} points (the DEM shows {100 * seen:.1f} % of lines of sight)"
    markdown(title, HEAD, [cells(name, results) for name in results])
    return results


def cells(name, results):
    result = results[name]
    judged, greedy = result["judged"], results["greedy"]
    collapse = results.get("Lindstrom-Turk")
    sight = judged["sight"]
    return [
        name, f"{judged['triangles']:,}", number(judged["rms_m"], 3), ratio(judged["rms_m"], greedy["judged"]["rms_m"]),
        ratio(judged["rms_m"], collapse and collapse["judged"]["rms_m"]), number(judged["max_m"], 1),
        number(result["seconds"], 3) + (" (earlier)" if result.get("earlier") else ""),
        ratio(result["seconds"], greedy["seconds"], 2), faults(judged), number(100 * sight["agreement"], 1),
        number(100 * sight["tin_visible"], 1), number(judged["slope_rms_degrees"], 2),
    ]


# --- start ---


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the desert window and the desert job only")
    parser.add_argument("--large", action="store_true", help="Lindstrom-Turk on rasters above 500,000 posts, too")
    parser.add_argument("--only", metavar="NAME", help="inputs and jobs with this in their name")
    parser.add_argument("--tables", default="123", metavar="DIGITS", help="which of the four tables (default 123)")
    parser.add_argument("--reuse-peer", action="store_true", help="keep what Lindstrom-Turk made and took earlier")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="also write every figure here")
    parser.add_argument("--book", action="store_true",
                        help="also put the figures of the desert into README and the book")
    parser.add_argument("--before", type=pathlib.Path, metavar="PROGRAM", help="an earlier program, for table 4")
    parser.add_argument("--no-build", action="store_true", help="take the binary as it is")
    parser.add_argument("--binary", type=pathlib.Path, default=TARGET / "release" / "tiefort",
                        help="the binary to measure; with another than the default, --no-build is implied")
    return parser.parse_args()


def binary(options):
    """The program to measure, built if it is this project's own."""
    if not options.no_build and options.binary == TARGET / "release" / "tiefort":
        subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, check=True)
    if not options.binary.exists():
        sys.exit(f"{options.binary}: no such program; leave --no-build out to build it")
    return options.binary.resolve()


def main():
    options = arguments()
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    tiefort = binary(options)
    if not compiled("evaluate"):
        sys.exit("without its evaluator this script has nothing to say")
    wanted = lambda name: options.only is None or options.only in name
    before, results = load(), {"rasters": {}, "areas": {}, "tiles": {}, "efforts": {}}

    if "1" in options.tables:
        print("## 1. Equal triangles, no load modules")
        collapse = lindstrom_turk()
        for ground in terrain.inputs(tiefort, options.quick, wanted):
            for points in ground.points:
                found = compare(tiefort, collapse, ground, points, options)
                results["rasters"][f"{ground.name} {points}"] = found
    if "2" in options.tables or "3" in options.tables:
        for area in areas.areas(tiefort, options.quick, wanted):
            if "2" in options.tables:
                print("\n## 2. Equal triangles, all limits")
                results["areas"][area.name] = areas.compare(tiefort, area)
            if "3" in options.tables:
                print("\n## 3. The cost of tiles")
                results["tiles"][area.name] = areas.tiling(tiefort, area)

    if "4" in options.tables:
        print("\n## 4. What each effort costs and gains")
        before_program = options.before and options.before.resolve(strict=True)
        for area in areas.areas(tiefort, options.quick, wanted, areas.REAL):
            results["efforts"][area.name] = areas.efforts(tiefort, area, before_program)

    if not any(results.values()):
        sys.exit("nothing was measured: no input or job has such a name, or its raster is missing")
    missed = bars.tell(results)
    print(f"\n{os.cpu_count()} cores; load of the machine before {before}, after {load()}")
    if options.json:
        options.json.write_text(json.dumps(results | {"missed": missed}, indent=1))
    if options.book:
        headline.write(results)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
