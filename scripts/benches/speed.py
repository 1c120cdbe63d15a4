"""Time, residuals and memory against the fastest known peer, in rounds."""

import datetime
import json
import os
import pathlib
import platform
import re
import shutil
import statistics
import sys
import time

from benches.common import (DATA, FIGURES, FOLDER, ROOT, evaluate, faults, load, parser_of, prepare_venv, program, put,
                            run, why, write_heights, write_mesh)

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
MESHES = {"peer": FOLDER / "peer.mesh", "untiled": FOLDER / "untiled.ply", "tiled": FOLDER / "tiled.ply"}


def measured(*command):
    """Runs a command of ours: its output, wall and CPU seconds, peak memory in MB."""
    ran = run(*command)
    # 1 is a build with breaches: finished, and none of this script's business.
    if ran["code"] not in (0, 1):
        sys.exit(f"{' '.join(map(str, command))}: {why(ran)}")
    return ran


# --- terrain and jobs ---


def find_dem(tiefort):
    """The raster, and the text of a job on it."""
    job = (ROOT / "tests/jobs/alps.toml").read_text()
    dem = DATA / "ntc_standin" / "bavarian_alps_50km_1979x1979_utm32n.tif"
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
    ran = measured(tiefort, "tin", dem, "--points", POINTS, "--method", "greedy", "--key", "max", *options, "--json",
                   "--out", out)
    ran["refine_s"], ran["refine_cpu_s"] = refine_seconds(ran)
    return ran


def refine_seconds(ran):
    """Wall and CPU seconds of the stage."""
    events = map(json.loads, ran["out"].splitlines())
    return next((event["wall_s"], event["cpu_s"]) for event in events
                if (event.get("event"), event.get("stage")) == ("leave", "refine"))


def run_build(tiefort, job, out):
    """Builds a database from nothing; adds what its report says."""
    shutil.rmtree(out, ignore_errors=True)
    ran = measured(tiefort, "build", job, "--out", out, "--workers", 2, "--json", "--no-html")
    ran["report"] = json.loads(ran["out"].splitlines()[-1])["report"]
    ran["stages_s"] = sum(stage["wall_s"] for stage in ran["report"]["stages"])
    shutil.rmtree(out)
    return ran


def run_peer(heights):
    from pydelatin import Delatin

    cpu, start = time.process_time(), time.perf_counter()
    mesh = Delatin(heights, max_points=POINTS, max_error=0)
    found = {"wall_s": time.perf_counter() - start, "cpu_s": time.process_time() - cpu}
    write_mesh(MESHES["peer"], mesh.vertices, mesh.triangles)
    return found


def one_round(tiefort, dem, heights, jobs):
    """Everything that is compared, once, in turn."""
    database = FOLDER / "area.tdb"
    runs = {"peer": run_peer(heights)}
    runs["untiled"] = run_tin(tiefort, dem, MESHES["untiled"], "--tiles", "1x1", "--workers", 1)
    runs["tiled"] = run_tin(tiefort, dem, MESHES["tiled"], "--tiles", "6x6", "--workers", 2)
    return runs | {name: run_build(tiefort, job, database) for name, job in jobs.items()}


def rms(name, raw, spacing_m):
    """RMS residual of the mesh of the last round, by the evaluator."""
    judged = evaluate(MESHES[name], raw, spacing_m, "--sight-lines", 0)
    assert judged["valid"], f"{name}: {faults(judged)}"
    return judged["rms_m"]


# --- the table ---


def seconds_row(what, rounds, name, seconds, cpu_seconds, bar):
    """A row for the wall seconds that `seconds` finds in a run, over the peer's."""
    peer = [ran["peer"]["wall_s"] for ran in rounds]
    ours = [seconds(ran[name]) for ran in rounds]
    best = min(ours) / min(peer)
    median = statistics.median(mine / theirs for mine, theirs in zip(ours, peer))
    cpu = min(cpu_seconds(ran[name]) for ran in rounds) / min(ran["peer"]["cpu_s"] for ran in rounds)
    cells = [what, f"{min(ours):.3f} s", f"{best:.3f}", f"{median:.3f}", f"{cpu:.3f}"]
    return cells + ["", ""] if bar is None else cells + [f"{bar:.2f}", verdict(best, bar)]


def plain_row(what, ours, found, bar):
    return [what, ours, f"{found:.3f}", "", "", f"{bar:g}", verdict(found, bar)]


def verdict(found, bar):
    return "met" if found <= bar else "MISSED"


def table(rounds, raw, spacing_m, memory_mb):
    peer = [ran["peer"]["wall_s"] for ran in rounds]
    refine, refine_cpu = (lambda ran: ran["refine_s"]), (lambda ran: ran["refine_cpu_s"])
    wall, cpu, stages = (lambda ran: ran["wall_s"]), (lambda ran: ran["cpu_s"]), (lambda ran: ran["stages_s"])
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
    best_s = min(ran["best"]["cpu_s"] for ran in rounds)
    rows.append(plain_row(f"  its processor time, over {BAR_BEST_S} s", f"{best_s:.1f} s", best_s / BAR_BEST_S, 1.0))
    theirs, untiled, tiled = (rms(name, raw, spacing_m) for name in ["peer", "untiled", "tiled"])
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
        best = min((ran[name] for ran in rounds), key=lambda ran: ran["wall_s"])
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


def arguments():
    parser = parser_of(speed)
    parser.add_argument("--rounds", type=int, default=5, help="rounds, each of everything once (default 5)")
    parser.add_argument("--book", action="store_true", help="put the table into the book")
    parser.add_argument("--callgrind", action="store_true", help="also count instructions with valgrind")
    return parser.parse_args()


def busy_note(load_before):
    """What to make of the figures when others were at work before we were."""
    if load_before <= os.cpu_count() / 4:
        return ""
    return "The machine was busy: short runs are disturbed less than long ones, so trust `cpu` before `best`.\n"


def speed():
    """Measure the compiler against the fastest known peer: a table of ratios; exit code 1 when a bar is missed.

        scripts/bench.py speed                 build the release binary, install the peer, measure
        scripts/bench.py speed --rounds 9      more rounds, on a busy machine
        scripts/bench.py speed --book          put the table into the book
        scripts/bench.py speed --callgrind     also count instructions (needs valgrind)

    The peer is `pydelatin` (the hmm algorithm), installed from PyPI into `target/bench/venv`; only the call that
    triangulates is timed. The terrain is the DEM of tests/jobs/alps.toml where the shared data is (TIEFORT_DATA names
    its folder), else the sample terrain at the same size, for which the bars were not set.

    Peer and compiler take turns, round by round, so that both see the same machine. A ratio is ours over the peer's
    triangulation: `best` is the best of all rounds over the best, which other work on the machine disturbs least, and
    is held against the bar; `median` is the median of the rounds' ratios; `cpu` compares seconds of all cores
    together.
    """
    options = arguments()
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv()
    import rasterio

    tiefort = program(options)
    dem, job = find_dem(tiefort)
    jobs = write_jobs(job)
    with rasterio.open(dem) as raster:
        heights, spacing_m = raster.read(1).astype("f4"), (raster.transform.a, -raster.transform.e)
    raw = FOLDER / "speed.heights"
    write_heights(raw, heights[::-1])
    before, note = load(), busy_note(os.getloadavg()[0])
    rounds = [one_round(tiefort, dem, heights, jobs) for _ in range(options.rounds)]
    memory_mb = run_build(tiefort, ROOT / "configs" / "ntc.toml", FOLDER / "ntc.tdb")["peak_mb"]

    today = datetime.date.today().isoformat()
    rows = table(rounds, raw, spacing_m, memory_mb)
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
