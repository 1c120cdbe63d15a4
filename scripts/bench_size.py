#!/usr/bin/env python3
"""Does memory stay bounded, and the time of a tile the same, however large the area is?

    cargo build --release
    python3 scripts/bench_size.py [--widths 2501,10001,40001] [--rows 681] [--tin 'method = "greedy"'] [--keep FOLDER]

For each width a raster of so many posts from west to east is made by `tiefort sample`, and a job over it is built with
two workers: once from the raster, at 25 m, and once from the sample terrain itself. Tiles are 17 load modules a side
(340 posts), as in the founding paper. Printed are the time of a tile, the peak of the memory that the process held, and
what `plan` said of both. Memory of the whole area (manifest, counts, TINs) grows with it; that of the heights does not.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

JOB = """[area]
name = "size"
crs = "EPSG:32611"
origin_m = [505000, 3875000]
size_m = [{wide}, {high}]
spacing_m = 25
[dem]
{dem}
[tiles]
columns = {columns}
rows = {rows}
[tin]
{tin}
"""


def run(command):
    """Seconds and peak memory in megabytes of a command; its output when it fails."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.monotonic() - start
    if status not in (0, 256):
        sys.exit(f"{' '.join(map(str, command))}\n{output}")
    return seconds, usage.ru_maxrss / 1024, usage.ru_utime + usage.ru_stime


def measure(program, folder, posts, rows, tin, source):
    modules = [(posts - 1) // 20, (rows - 1) // 20]
    tiles = [max(1, round(count / 17)) for count in modules]
    dem = 'source = "sample"'
    if source == "raster":
        path = folder / f"dem{posts}.tif"
        if not path.exists():
            made = run([program, "sample", "--posts", str(posts), "--rows", str(rows), "--out", path])
            print(f"  sample: {made[0]:.1f} s, {made[1]:.0f} MB of memory, {path.stat().st_size >> 20} MB of file")
        dem = f'sources = ["{path.name}"]'
    job = folder / f"{source}{posts}.toml"
    job.write_text(JOB.format(wide=modules[0] * 500, high=modules[1] * 500, dem=dem, columns=tiles[0], rows=tiles[1],
                              tin=tin))
    plan = json.loads(subprocess.check_output([program, "plan", job, "--emit", "json"]))["forecast"]
    seconds, memory, cpu = run([program, "build", job, "--out", folder / f"{source}{posts}.tdb", "--workers", "2",
                                "--fresh", "--quiet"])
    count = tiles[0] * tiles[1]
    forecast = plan["memory_bytes"] / 2**20
    print(f"{source:7} {posts:6} posts wide, {count:5} tiles, {modules[0] * modules[1]:7} load modules: "
          f"{1000 * cpu / count:7.1f} ms of cpu a tile, {memory:6.0f} MB (forecast {forecast:6.0f}, "
          f"ratio {forecast / memory:4.2f}), {seconds:6.1f} s (forecast of one worker {plan['seconds']:6.1f}, "
          f"cpu {cpu:6.1f}, ratio {plan['seconds'] / cpu:4.2f})", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/tiefort")
    parser.add_argument("--widths", default="2501,10001,40001")
    parser.add_argument("--rows", type=int, default=681)
    parser.add_argument("--tin", default='method = "greedy"')
    parser.add_argument("--sources", default="sample,raster")
    parser.add_argument("--keep", type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.keep or pathlib.Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for source in arguments.sources.split(","):
            for posts in map(int, arguments.widths.split(",")):
                measure(arguments.program, folder, posts, arguments.rows, arguments.tin, source)


if __name__ == "__main__":
    main()
