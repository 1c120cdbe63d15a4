#!/usr/bin/env python3
"""How fast the reader for simulators answers, against what the project asks of it.

    python3 scripts/bench_reader.py [DIR] [--queries N]

DIR is a terrain database; without it the 50 km of configs/ntc.toml are built in a scratch folder first.
Exit code 1 when a bar is missed. Run it on a quiet machine: heights at random places wait for memory.
"""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parent.parent
HEIGHTS_MILLION_MIN = 5.0
BLOCK_MS_MAX = 5.0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database", nargs="?")
    parser.add_argument("--queries", type=int, default=5_000_000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        database = arguments.database
        if not database:
            database = str(pathlib.Path(scratch) / "ntc.tdb")
            cargo("run", "--release", "--", "build", "configs/ntc.toml", "--out", database, "--quiet")
        database = str(pathlib.Path(database).resolve())
        run = ["run", "--release", "--quiet", "-p", "load-module-reader", "--example", "bench", "--"]
        text = cargo(*run, database, str(arguments.queries)).stdout
    print(text, end="")
    missed = 0
    for line in text.splitlines():
        heights = re.match(r"heights, (.*): ([\d.]+) million a second on one core, ([\d.]+) many at once", line)
        if heights:
            best = max(float(heights[2]), float(heights[3]))
            missed += tell(HEIGHTS_MILLION_MIN <= best, f"heights, {heights[1]}: {best} million, at least 5")
        block = re.match(r"block of 15 x 15: .*median ([\d.]+)", line)
        if block:
            median = float(block[1])
            missed += tell(median < BLOCK_MS_MAX, f"block of 15 x 15 in {median} ms at the median, below 5")
    sys.exit(1 if missed else 0)


def cargo(*words):
    return subprocess.run(["cargo", *words], cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE)


def tell(met, what):
    print(f"{'met   ' if met else 'MISSED'} {what}")
    return not met


if __name__ == "__main__":
    main()
