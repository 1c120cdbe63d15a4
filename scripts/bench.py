#!/usr/bin/env python3
"""Measure the compiler against the fastest known peer: prints one table of ratios, exits with 1 when a bar is missed.

    scripts/bench.py                 build the release binary, install the peer, measure
    scripts/bench.py --rounds 9      more rounds, on a busy machine
    scripts/bench.py --book          put the table into the book
    scripts/bench.py --callgrind     also count instructions (needs valgrind)

The peer is `pydelatin` (the hmm algorithm), installed from PyPI into `target/bench/venv`; only the call that
triangulates is timed. The terrain is the DEM of tests/jobs/alps.toml where the shared data is (TIEFORT_DATA names its
folder), else the sample terrain at the same size, for which the bars were not set.

Peer and compiler take turns, round by round, so that both see the same machine. A ratio is ours over the peer's
triangulation: `best` is the best of all rounds over the best, which other work on the machine disturbs least, and is
held against the bar; `median` is the median of the rounds' ratios; `cpu` compares seconds of all cores together.
"""

import argparse
import datetime
import functools
import json
import os
import pathlib
import platform
import re
import shutil
import statistics
import subprocess
import sys
import time
import venv

from book import FIGURES, ROOT, put

FOLDER = ROOT / "target" / "bench"
VENV = FOLDER / "venv"
PACKAGES = ["pydelatin==0.4.0", "numpy", "tifffile", "imagecodecs"]

POINTS = 76_500
PAPER = f'method = "paper"\npoints = {POINTS}\nkey = "max"\nallocation = "equal"'
# A sample terrain as large as the alps, its posts off the working grid too.
SAMPLE = {"posts": 1979, "spacing_m": 25.25, "origin_m": [505_000, 3_875_000], "crs": "EPSG:32611"}

# What is held: the time of a run over that of the peer's triangulation, residuals, memory.
BAR_UNTILED, BAR_TILED, BAR_TIN = 0.36, 0.10, 0.35
BAR_PAPER = {"clip": 0.50, "constrained": 0.40}
BAR_FAST, BAR_NORMAL, BAR_BEST_S = 1.40, 6.50, 40
BAR_RMS_UNTILED, BAR_RMS_TILED = 1.005, 1.02
BAR_MEMORY_MB = 200

# A process of its own, small, so that the peak it reports is its child's and not that of our arrays.
LAUNCHER = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
done = subprocess.run(sys.argv[1:], capture_output=True, text=True)
wall_s = time.perf_counter() - start
used = resource.getrusage(resource.RUSAGE_CHILDREN)
json.dump({"code": done.returncode, "out": done.stdout, "err": done.stderr, "wall_s": wall_s,
           "cpu_s": used.ru_utime + used.ru_stime, "peak_mb": used.ru_maxrss * 1024 / 1e6}, sys.stdout)
"""


def measured(*command):
    """Runs a command of ours: its output, wall and CPU seconds, peak memory in MB."""
    command = [str(word) for word in command]
    launched = subprocess.run([sys.executable, "-S", "-c", LAUNCHER, *command], capture_output=True, check=True)
    run = json.loads(launched.stdout)
    # 1 is a build with breaches: finished, and none of this script's business.
    if run["code"] not in (0, 1):
        sys.exit(f"{' '.join(command)}: exit code {run['code']}\n{run['err']}")
    return run


# --- terrain and jobs ---


def find_dem(tiefort):
    """The raster, and the text of a job on it."""
    job = (ROOT / "tests/jobs/alps.toml").read_text()
    shared = pathlib.Path(os.environ.get("TIEFORT_DATA", ROOT / ".." / "shared" / "data")).resolve()
    dem = shared / "ntc_standin" / "bavarian_alps_50km_1979x1979_utm32n.tif"
    if not dem.exists():
        print(f"no {dem.name} in the shared data: the sample terrain stands in", file=sys.stderr)
        dem = FOLDER / "sample.tif"
        measured(tiefort, "sample", "--posts", SAMPLE["posts"], "--spacing", SAMPLE["spacing_m"], "--out", dem)
        east_m, north_m = (metres + 10 * 25 for metres in SAMPLE["origin_m"])
        job = replaced(job, r"crs = .*", f'crs = "{SAMPLE["crs"]}"')
        job = replaced(job, r"origin_m = .*", f"origin_m = [{east_m}, {north_m}]")
    return dem, replaced(job, r"sources = .*", f"sources = [{json.dumps(str(dem))}]")


def replaced(text, pattern, by):
    text, count = re.subn(pattern, lambda _: by, text)
    assert count == 1, f"{pattern} stands {count} times in tests/jobs/alps.toml, expected once"
    return text


def write_jobs(job):
    """Job files by name: this project's method at its fastest, and the paper's with either kind of edge."""
    paper = replaced(job, r'method = "optimised"', PAPER)
    texts = {"default": replaced(job, r'method = "optimised"', 'method = "optimised"\neffort = "fast"'), "normal": job,
             "best": replaced(job, r'method = "optimised"', 'method = "optimised"\neffort = "best"')}
    for edges in ["clip", "constrained"]:
        texts[f"paper-{edges}"] = f'{paper}\n[load_modules]\nedges = "{edges}"\n'
    paths = {name: FOLDER / f"{name}.toml" for name in texts}
    for name, text in texts.items():
        paths[name].write_text(text)
    return paths


# --- what runs ---


def run_tin(tiefort, dem, out, *options):
    """Makes a mesh; adds the seconds of the stage `refine` to what was measured."""
    run = measured(tiefort, "tin", dem, "--points", POINTS, "--method", "greedy", "--key", "max", *options,
                   *json_flag(tiefort), "--out", out)
    run["refine_s"], run["refine_cpu_s"] = refine_seconds(run, int(options[options.index("--workers") + 1]))
    return run


@functools.cache
def json_flag(tiefort):
    """`--json` where `tin` offers it."""
    offered = "--json" in measured(tiefort, "tin", "--help")["out"]
    return ["--json"] if offered else []


def refine_seconds(run, workers):
    """Wall and CPU seconds of the stage, from its event or else from the line that people read (hundredths)."""
    for line in run["out"].splitlines():
        event = json.loads(line)
        if (event.get("event"), event.get("stage")) == ("leave", "refine"):
            return event["wall_s"], event["cpu_s"]
    found = re.search(r"^refine .*? ([\d.]+) s  (\d+) % busy", run["err"], re.MULTILINE)
    if not found:
        sys.exit(f"tin did not say how long it refined:\n{run['err']}")
    wall_s = float(found[1])
    return wall_s, wall_s * workers * float(found[2]) / 100


def run_build(tiefort, job, out):
    """Builds a database from nothing; adds what its report says."""
    shutil.rmtree(out, ignore_errors=True)
    run = measured(tiefort, "build", job, "--out", out, "--workers", 2, "--json", "--no-html")
    run["report"] = json.loads(run["out"].splitlines()[-1])["report"]
    run["stages_s"] = sum(stage["wall_s"] for stage in run["report"]["stages"])
    shutil.rmtree(out)
    return run


def run_peer(heights):
    from pydelatin import Delatin

    cpu, start = time.process_time(), time.perf_counter()
    mesh = Delatin(heights, max_points=POINTS, max_error=0)
    run = {"wall_s": time.perf_counter() - start, "cpu_s": time.process_time() - cpu}
    # Its y axis points north, a raster's rows go south.
    vertices = mesh.vertices.astype("f8")
    vertices[:, 1] = heights.shape[0] - 1 - vertices[:, 1]
    return run | {"mesh": (vertices, mesh.triangles)}


def one_round(tiefort, dem, heights, jobs):
    """Everything that is compared, once, in turn."""
    mesh, database = FOLDER / "mesh.ply", FOLDER / "area.tdb"
    runs = {"peer": run_peer(heights)}
    runs["untiled"] = run_tin(tiefort, dem, mesh, "--tiles", "1x1", "--workers", 1)
    runs["untiled"]["mesh"] = read_ply(mesh, heights.shape)
    runs["tiled"] = run_tin(tiefort, dem, mesh, "--tiles", "6x6", "--workers", 2)
    runs["tiled"]["mesh"] = read_ply(mesh, heights.shape)
    return runs | {name: run_build(tiefort, job, database) for name, job in jobs.items()}


# --- residuals, by an evaluator of its own ---


def read_ply(path, shape):
    """Vertices (column, row from the north, height) and triangles of a mesh that `tin` wrote."""
    import numpy

    header, body = path.read_bytes().split(b"end_header\n", 1)
    count = {kind: int(found) for kind, found in re.findall(r"element (\w+) (\d+)", header.decode())}
    vertices = numpy.frombuffer(body, "<f4", 3 * count["vertex"]).reshape(-1, 3).astype("f8")
    faces = numpy.frombuffer(body, [("corners", "u1"), ("v", "<i4", 3)], count["face"], vertices.size * 4)
    assert (faces["corners"] == 3).all(), "a mesh has triangles only"
    # The far corners are vertices, so the extent gives the spacing.
    spacing_m = vertices[:, :2].max(axis=0) / [shape[1] - 1, shape[0] - 1]
    columns, rows = numpy.rint(vertices[:, :2] / spacing_m).T
    return numpy.column_stack([columns, shape[0] - 1 - rows, vertices[:, 2]]), faces["v"]


def rms(mesh, heights):
    """Root mean square over every post: each is put into the closed triangles that hold it, by whole numbers."""
    import numpy

    vertices, triangles = mesh
    corners = vertices[triangles]
    places, z = corners[:, :, :2].astype("i8"), corners[:, :, 2]
    low, high = places.min(axis=1), places.max(axis=1)
    size = high - low + 1
    boxes = size.prod(axis=1)
    estimate = numpy.full(heights.shape, numpy.nan)
    # In parts of about a million posts, so that memory stays small.
    parts = numpy.searchsorted(boxes.cumsum(), numpy.arange(0, boxes.sum(), 1_000_000), "left")
    for part in numpy.split(numpy.arange(len(triangles)), numpy.unique(parts[1:])):
        if not len(part):
            continue
        owner = numpy.repeat(part, boxes[part])
        place = numpy.arange(len(owner)) - numpy.repeat(boxes[part].cumsum() - boxes[part], boxes[part])
        posts = low[owner] + numpy.column_stack([place % size[owner, 0], place // size[owner, 0]])
        a, b, c = (places[owner, corner] - posts for corner in range(3))
        areas = numpy.column_stack([cross(b, c), cross(c, a), cross(a, b)])
        inside = (areas >= 0).all(axis=1) | (areas <= 0).all(axis=1)
        posts, areas, owner = posts[inside], areas[inside], owner[inside]
        estimate[posts[:, 1], posts[:, 0]] = (areas * z[owner]).sum(axis=1) / areas.sum(axis=1)
    assert not numpy.isnan(estimate).any(), "a mesh covers every post"
    columns, rows = vertices[:, 0].astype("i8"), vertices[:, 1].astype("i8")
    assert (estimate[rows, columns] == heights[rows, columns]).all(), "vertices stand on the DEM"
    return float(numpy.sqrt(numpy.mean((estimate - heights) ** 2)))


def cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


# --- the table ---


def seconds_row(what, rounds, name, seconds, cpu_seconds, bar):
    """A row for the wall seconds that `seconds` finds in a run, over the peer's."""
    peer = [run["peer"]["wall_s"] for run in rounds]
    ours = [seconds(run[name]) for run in rounds]
    best = min(ours) / min(peer)
    median = statistics.median(mine / theirs for mine, theirs in zip(ours, peer))
    cpu = min(cpu_seconds(run[name]) for run in rounds) / min(run["peer"]["cpu_s"] for run in rounds)
    cells = [what, f"{min(ours):.3f} s", f"{best:.3f}", f"{median:.3f}", f"{cpu:.3f}"]
    return cells + ["", ""] if bar is None else cells + [f"{bar:.2f}", verdict(best, bar)]


def plain_row(what, ours, found, bar):
    return [what, ours, f"{found:.3f}", "", "", f"{bar:g}", verdict(found, bar)]


def verdict(found, bar):
    return "met" if found <= bar else "MISSED"


def table(rounds, heights, memory_mb):
    peer = [run["peer"]["wall_s"] for run in rounds]
    refine, refine_cpu = (lambda run: run["refine_s"]), (lambda run: run["refine_cpu_s"])
    wall, cpu, stages = (lambda run: run["wall_s"]), (lambda run: run["cpu_s"]), (lambda run: run["stages_s"])
    rows = [
        ["", "ours", "best", "median", "cpu", "bar", ""],
        ["pydelatin, triangulation", f"{min(peer):.3f} s", "1", "1", "1", "", ""],
        seconds_row("tin, refine, 1 worker", rounds, "untiled", refine, refine_cpu, BAR_UNTILED),
        seconds_row("tin 6x6, refine, 2 workers", rounds, "tiled", refine, refine_cpu, BAR_TILED),
        seconds_row("tin 6x6, whole process, 2 workers", rounds, "tiled", wall, cpu, BAR_TIN),
    ]
    for edges in ["clip", "constrained"]:
        name = f"paper-{edges}"
        rows.append(seconds_row(f"build, paper, {edges}", rounds, name, wall, cpu, BAR_PAPER[edges]))
        rows.append(seconds_row("  sum of its stages", rounds, name, stages, cpu, None))
    rows.append(seconds_row("build, optimised, fast", rounds, "default", wall, cpu, BAR_FAST))
    rows.append(seconds_row("  sum of its stages", rounds, "default", stages, cpu, None))
    rows.append(seconds_row("build, optimised, normal", rounds, "normal", wall, cpu, BAR_NORMAL))
    rows.append(seconds_row("build, optimised, best", rounds, "best", wall, cpu, None))
    best_s = min(run["best"]["cpu_s"] for run in rounds)
    rows.append(plain_row(f"  its processor time, over {BAR_BEST_S} s", f"{best_s:.1f} s", best_s / BAR_BEST_S, 1.0))
    theirs, untiled, tiled = (rms(rounds[-1][name]["mesh"], heights) for name in ["peer", "untiled", "tiled"])
    rows.append(["RMS of pydelatin", f"{theirs:.4f} m", "1", "", "", "", ""])
    rows.append(plain_row("RMS of tin, over pydelatin's", f"{untiled:.4f} m", untiled / theirs, BAR_RMS_UNTILED))
    rows.append(plain_row("RMS of tin 6x6, over untiled", f"{tiled:.4f} m", tiled / untiled, BAR_RMS_TILED))
    share = memory_mb / BAR_MEMORY_MB
    rows.append(plain_row("peak memory of build ntc, over 200 MB", f"{memory_mb:.1f} MB", share, 1.0))
    return rows


def aligned(rows):
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        cells = [row[0].ljust(widths[0])] + [cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:])]
        yield "  ".join([*cells, row[-1]]).rstrip()


def stages(rounds):
    """Where the best build of each job spent its time."""
    for name in ["paper-clip", "paper-constrained", "default"]:
        best = min((run[name] for run in rounds), key=lambda run: run["wall_s"])
        parts = ", ".join(f"{stage['name']} {stage['wall_s']:.3f}" for stage in best["report"]["stages"])
        yield f"stages of {name}: {parts} s"


def print_instructions(tiefort, dem):
    """Millions of instructions of one worker, counted by callgrind: the same on a busy machine. Meshes are read to
    written, on the whole raster by worst posts, and of 2,000 points on a small one by every effort."""
    small = dem.with_name("tiefort_size_bavarian_alps_460x376_utm32n.tif")
    greedy = ["--points", POINTS, "--method", "greedy", "--key", "max"]
    runs = {"tin": [dem, *greedy, "--tiles", "1x1"], "tin 6x6": [dem, *greedy, "--tiles", "6x6"]}
    if small.exists():
        optimised = {f"tin, 460 x 376, {effort}": effort for effort in ["fast", "normal", "best"]}
        runs |= {what: [small, "--points", 2000, "--effort", effort] for what, effort in optimised.items()}
    out = FOLDER / "callgrind.out"
    rows = [["callgrind", "million instructions", ""]]
    for what, words in runs.items():
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", tiefort, "tin", *words,
                   "--workers", 1, "--out", FOLDER / "mesh.ply"]
        counted = re.search(r"Collected : (\d+)", measured(*command)["err"])
        rows.append([what, f"{int(counted[1]) / 1e6:,.0f}", ""])
    print("\n".join(["", *aligned(rows)]))


def processor():
    """The name of the processor; ratios differ between processors, as caches and memory do."""
    told = pathlib.Path("/proc/cpuinfo")
    found = re.search(r"model name\s*: (.*)", told.read_text()) if told.exists() else None
    return found[1] if found else platform.processor() or platform.machine()


# --- start ---


def prepare_venv():
    """Installs the peer, and goes on in the Python that has it."""
    python = VENV / ("Scripts" if os.name == "nt" else "bin") / "python"
    if pathlib.Path(sys.prefix) == VENV:
        return
    if not python.exists():
        venv.create(VENV, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES], check=True)
    sys.stdout.flush()
    sys.exit(subprocess.run([python, *sys.argv]).returncode)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="rounds, each of everything once (default 5)")
    parser.add_argument("--no-build", action="store_true", help="take the binary as it is")
    parser.add_argument("--binary", type=pathlib.Path, default=ROOT / "target" / "release" / "tiefort",
                        help="the binary to measure; with another than the default, --no-build is implied")
    parser.add_argument("--book", action="store_true", help="put the table into the book")
    parser.add_argument("--callgrind", action="store_true", help="also count instructions with valgrind")
    return parser.parse_args()


def load():
    return ", ".join(f"{load:.2f}" for load in os.getloadavg())


def busy_note(load_before):
    """What to make of the figures when others were at work before we were."""
    if load_before <= os.cpu_count() / 4:
        return ""
    return "The machine was busy: short runs are disturbed less than long ones, so trust `cpu` before `best`.\n"


def main():
    options = arguments()
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    import tifffile

    tiefort = options.binary.resolve()
    if not options.no_build and tiefort == ROOT / "target" / "release" / "tiefort":
        subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, check=True)
    dem, job = find_dem(tiefort)
    jobs = write_jobs(job)
    heights = tifffile.imread(dem).astype("f4")
    before, note = load(), busy_note(os.getloadavg()[0])
    rounds = [one_round(tiefort, dem, heights, jobs) for _ in range(options.rounds)]
    memory_mb = run_build(tiefort, ROOT / "configs" / "ntc.toml", FOLDER / "ntc.tdb")["peak_mb"]

    today = datetime.date.today().isoformat()
    rows = table(rounds, heights.astype("f8"), memory_mb)
    lines = [
        f"{today}: {dem.name}, {POINTS:,} points, {options.rounds} rounds, {os.cpu_count()} cores",
        processor(),
        f"load of the machine before {before}, after {load()}\n{note}",
        *aligned(rows),
        "",
        *stages(rounds),
    ]
    text = "\n".join(lines) + "\n"
    print(text, end="")
    if options.book:
        put(FIGURES, "speed", f"```text\n{text}```")
    if options.callgrind:
        print_instructions(tiefort, dem)
    sys.exit(1 if any(row[-1] == "MISSED" for row in rows) else 0)


if __name__ == "__main__":
    main()
