#!/usr/bin/env python3
"""Does memory stay bounded, and the time of a tile the same, however large the area is?

    cargo build --release
    python3 scripts/bench_size.py [--widths 2501,10001,40001] [--rows 681] [--tin 'method = "greedy"'] [--keep FOLDER]
    python3 scripts/bench_size.py --widths 5001,10001,20001 --rows 0 --sources sample --tin 'method = "optimised"'

For each width a raster of so many posts from west to east is made by `tiefort sample`, and a job over it is built with
two workers: once from the raster, at 25 m, and once from the sample terrain itself. With `--rows 0` areas are as high
as they are wide. Tiles are 17 load modules a side (340 posts), as in the founding paper. Printed are processor time of
a tile, the peak of the memory that the process held, the size of the database, and in brackets what `plan` said of
each, over what it came to: between 0.67 and 1.5 is what the project asks for. Exit code 1 when one lies outside.

With `--spacing 125` an area of 1000 km on a side has the tiles and load modules of 40,001 x 40,001 posts at 25 m, and a
twenty-fifth of its posts: what grows with the area, without the time for its heights.
"""

import argparse
import itertools
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from book import FIGURES, put

JOB = """[area]
name = "size"
crs = "EPSG:32611"
origin_m = [505000, 3875000]
size_m = [{wide}, {high}]
spacing_m = {spacing}
[dem]
{dem}
[tiles]
columns = {columns}
rows = {rows}
[tin]
{tin}
"""

TABLE = """| source | posts | tiles | load modules | cpu a tile | memory | disk |
| - | -: | -: | -: | -: | -: | -: |"""


def run(command):
    """Seconds, peak memory in megabytes and processor seconds of a command; its output when it fails."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.monotonic() - start
    if status not in (0, 256):
        sys.exit(f"{' '.join(map(str, command))}\n{output}")
    return seconds, usage.ru_maxrss / 1024, usage.ru_utime + usage.ru_stime


def measure(arguments, folder, posts, source):
    """Builds one job; a line of the table, and whether every forecast was near enough."""
    program, rows = arguments.program, arguments.rows or posts
    side = 500 // arguments.spacing
    modules = [(posts - 1) // side, (rows - 1) // side]
    tiles = [max(1, round(count / 17)) for count in modules]
    dem = 'source = "sample"'
    if source == "raster":
        path = folder / f"dem{posts}.tif"
        if not path.exists():
            run([program, "sample", "--posts", str(posts), "--rows", str(rows), "--spacing", str(arguments.spacing),
                 "--out", path])
        dem = f'sources = ["{path.name}"]'
    job, database = folder / f"{source}{posts}.toml", folder / f"{source}{posts}.tdb"
    job.write_text(JOB.format(wide=modules[0] * 500, high=modules[1] * 500, dem=dem, columns=tiles[0], rows=tiles[1],
                              tin=arguments.tin, spacing=arguments.spacing))
    plan = json.loads(subprocess.check_output([program, "plan", job, "--emit", "json"]))["forecast"]
    _, memory, cpu = run([program, "build", job, "--out", database, "--workers", "2", "--fresh", "--quiet"])
    count = tiles[0] * tiles[1]
    disk = sum(path.stat().st_size for path in database.rglob("*") if path.is_file()) / 2**20
    ratios = [plan["seconds"] / cpu, plan["memory_bytes"] / 2**20 / memory, plan["disk_bytes"] / 2**20 / disk]
    row = (f"| {source} | {posts:,} x {rows:,} | {count:,} | {modules[0] * modules[1]:,} "
           f"| {1000 * cpu / count:.0f} ms ({ratios[0]:.2f}) | {memory:.0f} MB ({ratios[1]:.2f}) "
           f"| {disk:.0f} MB ({ratios[2]:.2f}) |")
    print(row, flush=True)
    return row, all(1 / 1.5 <= ratio <= 1.5 for ratio in ratios)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/tiefort")
    parser.add_argument("--widths", default="2501,10001,40001")
    parser.add_argument("--rows", type=int, default=681)
    parser.add_argument("--spacing", type=int, default=25)
    parser.add_argument("--tin", default='method = "greedy"')
    parser.add_argument("--sources", default="sample,raster")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--book", action="store_true", help="also put the table into the book")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.keep or pathlib.Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        print(TABLE)
        cases = itertools.product(arguments.sources.split(","), map(int, arguments.widths.split(",")))
        measured = [measure(arguments, folder, posts, source) for source, posts in cases]
    if arguments.book:
        put(FIGURES, "size", "\n".join([TABLE, *(row for row, _ in measured)]))
    sys.exit(0 if all(is_near for _, is_near in measured) else 1)


if __name__ == "__main__":
    main()
