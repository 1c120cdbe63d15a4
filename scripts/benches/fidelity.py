"""How true the ground is at an equal number of triangles, against peers."""

import json
import os
import pathlib
import sys
import time

from benches import areas
from benches.areas import EFFORT_HEAD, EFFORT_ROWS, best_paper, effort_cells
from benches.common import (FIGURES, FOLDER, compiled, digest, evaluate, faults, lindstrom_turk, load, markdown,
                            number, parser_of, prepare_venv, program, put, ratio, run, skip, tell, why, write_mesh)

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


# --- what is asked ---


# Lines of sight are judged on the desert window at 9,868 triangles.
SIGHT_INPUT = "desert-window 5000"
# The 50 km area of 320,000 triangles: seconds by effort, and memory.
LARGE_AREA = "ntc-even"
BAR_SECONDS = {"fast": 1.0, "normal": 8.0, "best": 40.0}
BAR_MEMORY_MB = 400
ROWS_HELD = ("fast", "normal", "best", "normal, on posts", "fast, sight", "normal, sight", "best, sight")


def held(results):
    """Prints every bar as a table; the names of those that are missed."""
    rows = [*rasters(results["rasters"]), *limited(results["areas"]), *seams(results["tiles"]),
            *efforts(results["efforts"])]
    if not rows:
        return []
    print("\n## Bars")
    markdown("at most, unless it says at least", ["what", "found", "bar", ""], [
        [what, f"{found:.3f}", f"{'at least ' if least else ''}{bar:g}", "met" if met(found, bar, least) else "MISSED"]
        for what, found, bar, least in rows
    ])
    return [what for what, found, bar, least in rows if not met(found, bar, least)]


def met(found, bar, least):
    return bar <= found if least else found <= bar


def rasters(inputs):
    for name, results in inputs.items():
        if "fast" not in results and "normal" not in results:
            continue
        invalid = sum(not results[row]["judged"]["valid"] for row in ROWS_HELD if row in results)
        yield f"{name}: our meshes that are no valid surface", invalid, 0, False
        yield from over(name, results, "normal", "greedy", 0.45)
        yield from over(name, results, "normal", "Lindstrom-Turk", 0.80)
        yield from over(name, results, "fast", "Lindstrom-Turk", 1.02)
        yield from over(name, results, "normal, on posts", "Lindstrom-Turk", 1.0)
        yield from seconds_over(name, results, "normal", "Lindstrom-Turk", 0.1)
        yield from seconds_over(name, results, "fast", "Lindstrom-Turk", 0.01)
        if name == SIGHT_INPUT:
            yield from sight(name, results)


def over(name, results, ours, peer, bar):
    if ours in results and peer in results:
        found = results[ours]["judged"]["rms_m"] / results[peer]["judged"]["rms_m"]
        yield f"{name}: RMS of {ours}, of {peer}", found, bar, False


def seconds_over(name, results, ours, peer, bar):
    if ours in results and peer in results:
        yield f"{name}: seconds of {ours}, of {peer}", results[ours]["seconds"] / results[peer]["seconds"], bar, False


def sight(name, results):
    aimed, normal = (results.get(row, {}).get("judged") for row in ("normal, sight", "normal"))
    if normal:
        yield f"{name}: agreement of normal, %", 100 * normal["sight"]["agreement"], 95.5, True
        slope = normal["slope_rms_degrees"] / results["greedy"]["judged"]["slope_rms_degrees"]
        yield f"{name}: slope RMS of normal, of greedy", slope, 0.65, False
    if aimed:
        yield f"{name}: agreement of normal, sight, %", 100 * aimed["sight"]["agreement"], 96.0, True
        share = aimed["sight"]["tin_visible"] / aimed["sight"]["dem_visible"]
        yield f"{name}: visible share of normal, sight, away from the DEM's", abs(share - 1.0), 0.05, False
    if aimed and normal:
        yield f"{name}: RMS of normal, sight, of normal", aimed["rms_m"] / normal["rms_m"], 1.06, False


def limited(jobs):
    for name, results in jobs.items():
        paper, grid = best_paper(results), results.get("regular grid")
        for effort, bar in [("fast", 0.60), ("normal", 0.45), ("best", 0.43)]:
            ours = results.get(effort)
            if not ours or not paper:
                continue
            yield f"{name}: RMS of {effort}, of paper + clip", ours["rms_m"] / paper["rms_m"], bar, False
            yield f"{name}: largest residual of {effort}, of paper + clip", ours["max_m"] / paper["max_m"], 1.0, False
            yield f"{name}: breaches of {effort}", ours["breaches"], 0, False
            if effort == "normal":
                yield f"{name}: RMS of normal, of the regular grid", ours["rms_m"] / grid["rms_m"], 0.23, False
            if name == LARGE_AREA:
                yield f"{name}: seconds of {effort}", ours["seconds"], BAR_SECONDS[effort], False
                yield f"{name}: MB of {effort}", ours["peak_mb"], BAR_MEMORY_MB, False


def seams(jobs):
    for name, results in jobs.items():
        for tiles, result in results.items():
            found = result["judged"].get("seams", {})
            if tiles == "6 x 6, global" and found.get("posts"):
                yield f"{name}: RMS near tile lines, of elsewhere", found["rms_m"] / found["others_rms_m"], 1.03, False


# What an effort may have of the residual that an earlier program's has: which, of which, at most.
OF_BEFORE = [("fast", "before, fast", 0.95), ("normal", "before, normal", 1.0), ("best", "before, normal", 0.94),
             ("normal, sight = false", "before, normal", 0.97)]
# Share of lines of sight that `normal` keeps beyond what it kept before.
MORE_SIGHT = 0.005


def efforts(jobs):
    for name, results in jobs.items():
        for ours, earlier, bar in OF_BEFORE:
            if ours in results and earlier in results:
                found = results[ours]["rms_m"] / results[earlier]["rms_m"]
                yield f"{name}: RMS of {ours}, of {earlier}", found, bar, False
        now, before = results.get("normal"), results.get("before, normal")
        if not now or not before:
            continue
        now, before = now["judged"], before["judged"]
        for eye, kept in before["agreement_at_m"].items():
            gained = 100 * (now["agreement_at_m"][eye] - kept)
            yield f"{name}: lines of sight at {eye} m gained by normal, points", gained, 100 * MORE_SIGHT, True
        thin = [100 * judged["least_angle_below"]["5"] for judged in (now, before)]
        yield f"{name}: angles below 5 degrees of normal, %, at most as before", thin[0], thin[1], False


# --- what the book shows ---


# Rows of a raster and of an area as they are called there, and as they are called here.
RASTER_ROWS = {"greedy": "greedy insertion (`pydelatin`)", "Lindstrom-Turk": "edge collapse (CGAL, Lindstrom-Turk)",
               "fast": "`fast`", "normal, sight": "`normal` (default)", "best, sight": "`best`",
               "normal": "`normal`, `sight = false`"}
AREA_ROWS = {"regular grid": "regular grid of 125 m", "paper + clip": "the paper's method, clipped",
             "fast": "`fast`", "normal, sight": "`normal` (default)", "best, sight": "`best`",
             "normal": "`normal`, `sight = false`"}
SHORT_HEAD = "| {} | RMS m | largest m | lines of sight | slope RMS | s |\n| - | -: | -: | -: | -: | -: |\n"


def short_row(name, result, rms_m, max_m):
    judged = result["judged"]
    sight, slope = 100 * judged["sight"]["agreement"], judged["slope_rms_degrees"]
    seconds = f"{result['seconds']:.2f}" if result.get("seconds") else ""
    return f"| {name} | {rms_m:.3f} | {max_m:.1f} | {sight:.1f} % | {slope:.2f}° | {seconds} |\n"


def of_raster(results):
    some = next(iter(results.values()))["judged"]
    text = SHORT_HEAD.format(f"the desert window, 460 x 376 posts, {some['triangles']:,} triangles")
    for name, shown in RASTER_ROWS.items():
        if name in results:
            judged = results[name]["judged"]
            text += short_row(shown, results[name], judged["rms_m"], judged["max_m"])
    return text


def of_area(name, results):
    best = min((key for key in results if key.startswith("paper + clip")), key=lambda key: results[key]["rms_m"])
    results = results | {"paper + clip": results[best]}
    text = SHORT_HEAD.format(f"the whole {name}, 6 x 6 tiles, 32 triangles a load module, all limits")
    for key, shown in AREA_ROWS.items():
        if key in results:
            text += short_row(shown, results[key], results[key]["rms_m"], results[key]["max_m"])
    return text


def of_efforts(areas):
    """What each effort costs and gains, area after area."""
    text = ""
    for name, results in areas.items():
        lines = [[name, *EFFORT_HEAD[1:]], ["-", *["-:"] * (len(EFFORT_HEAD) - 1)]]
        normal, rows = results.get("normal"), [short_row for short_row in EFFORT_ROWS if short_row in results]
        lines += [effort_cells(f"`{short_row}`", results[short_row], normal) for short_row in rows]
        text += "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n\n"
    return text


def write_book(results):
    """Puts the tables where README and the book have them."""
    if results["efforts"]:
        put(FIGURES, "efforts", of_efforts(results["efforts"]))
    if not results["rasters"] or not results["areas"]:
        return
    raster = [found for name, found in results["rasters"].items() if name.startswith("desert-window")][-1]
    text = of_raster(raster) + "\n" + "\n".join(of_area(*item) for item in results["areas"].items())
    put(FIGURES, "fidelity", text)


# --- start ---


def arguments():
    parser = parser_of(fidelity)
    parser.add_argument("--quick", action="store_true", help="the desert window and the desert job only")
    parser.add_argument("--large", action="store_true", help="Lindstrom-Turk on rasters above 500,000 posts, too")
    parser.add_argument("--only", metavar="NAME", help="inputs and jobs with this in their name")
    parser.add_argument("--tables", default="123", metavar="DIGITS", help="which of the four tables (default 123)")
    parser.add_argument("--reuse-peer", action="store_true", help="keep what Lindstrom-Turk made and took earlier")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="also write every figure here")
    parser.add_argument("--book", action="store_true",
                        help="also put the figures of the desert into the book")
    parser.add_argument("--before", type=pathlib.Path, metavar="PROGRAM", help="an earlier program, for table 4")
    return parser.parse_args()


def fidelity():
    """Measure how true the ground is at an equal number of triangles, against peers: prints Markdown tables.

        scripts/bench.py fidelity                  everything but the largest collapse
        scripts/bench.py fidelity --quick          the desert window and the desert job only
        scripts/bench.py fidelity --large          Lindstrom-Turk on large rasters too: minutes, a gigabyte
        scripts/bench.py fidelity --only desert    inputs and jobs whose name has this in it
        scripts/bench.py fidelity --json all.json  every figure, for a program
        scripts/bench.py fidelity --quick --book   put the figures of the desert into the book
        scripts/bench.py fidelity --tables 4 --book                put what each effort costs and gains into the book
        scripts/bench.py fidelity --tables 4 --before PROGRAM      hold it against an earlier program, too

    1. Equal triangles, no load modules, per raster: greedy insertion (`pydelatin`) of so many points gives the number
    of    triangles; CGAL's Lindstrom-Turk edge collapse and `tiefort tin --triangles` are asked for the same. 2. Equal
    triangles, all limits, per job: `optimised` against the regular 125 m grid and against the paper's method with
    clipped edges, brought by bisection over its points to the mean the limits allow. Points are shared equally among
    tiles, the paper's practice, and by need; ratios and bars take the better of the two. 3. What cutting an area into
    tiles costs, and sharing triangles equally among them. 4. What each effort costs and gains on every real area:
    residual, lines of sight for eyes at 1, 2.5 and 10 m, angles    below 5 degrees, processor time of the build
    without its page. Only where it is asked for.

    Every mesh and every database is judged by scripts/benches/evaluate.cpp, which shares no code with the compiler
    (its own test: scripts/benches/selftest.py). Where Lindstrom-Turk folds over, the topmost triangle counts.

    Seconds of table 1 are from heights in memory to the mesh. Greedy and Lindstrom-Turk are timed around the call;
    ours are the seconds that the program prints for its stages after `read` (refining, merging, measuring: all but
    reading and writing), with one worker. Short runs are repeated and the best counts. Seconds of tables 2 and 3 are
    those of the whole process, reading and publishing included, on all cores; MB is its peak memory.

    Table 4 needs 10 minutes on two cores, twice that with an earlier program.

    Faults of a mesh are told in short; --json has them all. Missing rasters, programs or options are skipped loudly.
    The exit code is 1 when a bar is missed.
    """
    options = arguments()
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    tiefort = program(options)
    if not compiled("evaluate"):
        sys.exit("without its evaluator this script has nothing to say")
    wanted = lambda name: options.only is None or options.only in name
    before, results = load(), {"rasters": {}, "areas": {}, "tiles": {}, "efforts": {}}

    if "1" in options.tables:
        print("## 1. Equal triangles, no load modules")
        collapse = lindstrom_turk()
        for ground in areas.inputs(tiefort, options.quick, wanted):
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
    missed = held(results)
    print(f"\n{os.cpu_count()} cores; load of the machine before {before}, after {load()}")
    if options.json:
        options.json.write_text(json.dumps(results | {"missed": missed}, indent=1))
    if options.book:
        write_book(results)
    sys.exit(1 if missed else 0)
