"""What one triangle, metre of features, object or tile more costs, decade by decade."""

import json
import math
import pathlib
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile

from benches.common import load, markdown, parser_of, program, tell

ORIGIN_M = (500000, 3900000)
CRS = {"type": "name", "properties": {"name": "EPSG:32611"}}


def growth():
    """Builds areas of built-in terrain that grow tenfold in one thing at a time, and tells what each of it costs.

        scripts/bench.py growth                    microseconds of processor time, on one worker
        scripts/bench.py growth --instructions     thousands of instructions instead, by valgrind: an hour, and no noise
        scripts/bench.py growth --only features    one of triangles, features, objects, tiles
        scripts/bench.py growth --short            one decade of each, the least of three builds: a minute

    Features and objects are what a build with them takes more than the same build with as many triangles and none. The
    last column is the cost of one over that of one a decade before; exit code 1 where it is above 1.3. The short form
    runs beside other work and allows 4: what grows with the square is ten times as much.
    """
    parser = parser_of(growth)
    parser.add_argument("--only", choices=SERIES, help="one of the series")
    parser.add_argument("--instructions", action="store_true", help="count instructions with valgrind's callgrind")
    parser.add_argument("--short", action="store_true", help="one decade of each, and no more than four times the cost")
    options = parser.parse_args()
    most, runs, noise = (4.0, 3, 0.2) if options.short else (1.3, 1, 0.05)
    tiefort, rows, grows = program(options), [], False
    for name in [options.only] if options.only else SERIES:
        title, sizes, job_of, is_more = SERIES[name]
        if options.short:
            sizes = sizes[1:] if is_more else sizes[:2]

        def least(size, job_of=job_of):
            return min((cost(tiefort, job_of, size, options.instructions) for _ in range(runs)), key=lambda it: it[0])

        before, none = None, least(0)[0] if is_more else 0.0
        for size in sizes:
            tell(f"{name}: {size:,}")
            whole, report = least(size)
            count = report["triangles"] if name == "triangles" else size * (1000 if name == "features" else 1)
            # A part of the build without is its noise: what costs less is no measure for the next decade.
            each = max(whole - none, noise * none) / count
            # Where sizes are no decade apart, as if they were.
            ratio = None if before is None else (each / before[1]) ** (1 / math.log10(count / before[0]))
            grows |= ratio is not None and most < ratio
            rows.append([f"{title}: {size:,}", f"{each * 1e6:,.3f}", "" if ratio is None else f"{ratio:.2f}"])
            before = (count, each)
    unit = "thousand instructions each" if options.instructions else "microseconds each"
    markdown(f"What one more costs (load {load()})", ["growing", unit, "over a decade before"], rows)
    return 1 if grows else 0


def cost(tiefort, job_of, size, is_counted):
    """Seconds of processor time, or thousands of millions of instructions, of a build; and its report."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "job.toml").write_text(job_of(folder, size))
        command = [tiefort, "build", "job.toml", "--out", "out.tdb", "--no-html", "--quiet", "--workers", "1"]
        if is_counted:
            command = [shutil.which("valgrind") or sys.exit("--instructions needs valgrind"), "--tool=callgrind",
                       "--callgrind-out-file=/dev/null", *command]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(command, check=False, cwd=folder, capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode not in (0, 1):
            sys.exit(done.stderr)
        report = json.loads((folder / "out.tdb/report.json").read_text())
        if is_counted:
            return int(re.search(r"Collected : (\d+)", done.stderr)[1]) / 1e9, report
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, report


def job(km, mean, spacing_m, tiles, more=""):
    rows, columns = tiles
    return (
        f'[area]\nname = "growth"\ncrs = "EPSG:32611"\norigin_m = {list(ORIGIN_M)}\n'
        f"size_m = [{km[0] * 1000:.0f}, {km[1] * 1000:.0f}]\nspacing_m = {spacing_m}\n"
        f'[dem]\nsource = "sample"\n[tin]\nmethod = "optimised"\neffort = "fast"\n[tiles]\nrows = {rows}\n'
        f"columns = {columns}\n[limits]\nmean_per_load_module = {mean}\nper_load_module = {3 * mean}\n"
        f"per_4km_square = {128 * mean}\n{more}"
    )


def with_triangles(_folder, mean):
    """4 km x 4 km at 7.8 m, 4,096 posts a load module, more of them in the ground."""
    return job((4, 4), mean, 7.8125, (2, 2))


def with_features(folder, km):
    """300 km2, through which so many kilometres of roads of four classes wind, in places close to one another."""
    random.seed(1)
    lines = []
    for number in range(km):
        x, y, turn = random.uniform(500, 14000), random.uniform(500, 18500), random.uniform(0, 2 * math.pi)
        line = [(x, y)]
        for _ in range(25):
            turn += random.uniform(-0.4, 0.4)
            x, y = x + 40 * math.cos(turn), y + 40 * math.sin(turn)
            line.append((x, y))
        tags = {"highway": ["motorway", "primary", "residential", "track"][number % 4]}
        lines.append(feature(tags | ({"bridge": "yes"} if number % 25 == 0 else {}), "LineString", line))
    write(folder / "more.geojson", lines)
    more = '[features]\nsources = ["more.geojson"]\n' if km else ""
    return job((15, 20), 125, 25, (4, 4), more)


def with_objects(folder, count):
    """300 km2 with so many houses."""
    random.seed(1)
    houses = []
    for _ in range(count):
        x, y = random.uniform(20, 14950), random.uniform(20, 19950)
        east, north = random.uniform(6, 15), random.uniform(6, 15)
        ring = [(x, y), (x + east, y), (x + east, y + north), (x, y + north), (x, y)]
        houses.append(feature({"building": "yes"}, "Polygon", ring))
    write(folder / "more.geojson", houses)
    more = ('[objects]\nsources = ["more.geojson"]\n[objects.limits]\nper_load_module = 3000\n'
            "per_4km_square = 100000\n") if count else ""
    return job((15, 20), 32, 25, (4, 4), more)


def with_tiles(_folder, tiles):
    """Tiles of 2 km x 2 km at 25 m."""
    rows = round(math.sqrt(tiles))
    return job((2 * (tiles // rows), 2 * rows), 32, 25, (rows, tiles // rows))


def feature(tags, kind, line):
    line = [[round(ORIGIN_M[0] + x, 2), round(ORIGIN_M[1] + y, 2)] for x, y in line]
    geometry = {"type": kind, "coordinates": line if kind == "LineString" else [line]}
    return {"type": "Feature", "properties": tags, "geometry": geometry}


def write(path, features):
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": CRS, "features": features}))


# What grows, through which sizes, by which job, and whether it is what a build takes more than without any.
SERIES = {
    "triangles": ("triangles a load module", [32, 320, 2000], with_triangles, False),
    "features": ("km of features", [4, 40, 400], with_features, True),
    "objects": ("objects", [500, 5000, 50000], with_objects, True),
    "tiles": ("tiles", [4, 40, 400], with_tiles, False),
}
