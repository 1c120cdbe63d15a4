#!/usr/bin/env python3
"""The founding paper's Table 1 on a raster of today, beside the paper's own figures.

    scripts/compare_methods.py                   the extract of the shared data that is as large as the paper's
    scripts/compare_methods.py dem.tif           any raster
    scripts/compare_methods.py --book            put the table into the book
    scripts/compare_methods.py --tiefort PATH    with this program [default: target/release/tiefort, built if missing]

Figures are those of `tiefort compare`. The paper's ground was another one (the National Training Center, posts 30 m
apart, heights in whole metres), so its figures are told to show the order of the methods, not to be met.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys

from book import ROOT, put

EXTRACT = "ntc_standin/tiefort_size_mackay_idaho_460x376_utm12n.tif"

# Polis and McKeown (1993), Table 1: RMS, largest residual, equivalent points.
PAPER = {
    ("vip", 2500): ("48.5342", "216", "90"),
    ("vip", 5000): ("36.2015", "143", "107"),
    ("lattice", 2794): ("6.25136", "81", "1332"),
    ("lattice", 5188): ("2.94568", "31", "3719"),
    ("iterative", 2500): ("4.08376", "28", ""),
    ("iterative", 5000): ("2.26767", "19", ""),
}
HEAD = ["method", "points", "RMS m", "max m", "mean m", "equivalent", "covers", "s",
        "paper: RMS", "max", "equivalent"]


def program(given):
    """The program to ask."""
    if given:
        return pathlib.Path(given)
    found = ROOT / "target" / "release" / "tiefort"
    if not found.exists():
        subprocess.run(["cargo", "build", "--release", "-p", "tiefort"], cwd=ROOT, check=True)
    return found


def compared(tiefort, dem, points, methods=()):
    """What `compare` finds."""
    command = [str(tiefort), "compare", str(dem), "--points", points, "--format", "json"]
    if methods:
        command += ["--methods", ",".join(methods)]
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)


def cells(row, posts):
    """A row of the table."""
    if "refused" in row:
        return [row["method"], f"{row['asked']:,}", row["refused"]["expected"], *[""] * 8]
    equivalent = row["equivalent_points"]
    more_than = row["equivalent_points_more_than"]
    says = f"{equivalent:,}" if equivalent else f"> {more_than:,}" if more_than else ""
    figures = [f"{row['rms_m']:.3f}", f"{row['max_m']:.1f}", f"{row['mean_abs_m']:.3f}", says]
    share = f"{100 * row['covered'] / posts:.1f} %"
    paper = PAPER.get((row["method"], row["asked"]), ("", "", ""))
    return [row["method"], f"{row['points']:,}", *figures, share, f"{row['seconds']:.2f}", *paper]


def table(rows):
    """Rows as Markdown."""
    lines = [HEAD, ["-"] + ["-:"] * (len(HEAD) - 1), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def notes(rows):
    """What the table cannot say."""
    for row in rows:
        rms_m = row.get("iterative_rms_m_without_border_points")
        if rms_m:
            border, points = row["border_points"], row["points"]
            left = f"the iterative method with the {points - border:,} that are left of {points:,}"
            yield f"VIP takes the {border:,} posts of the border first; {left} has RMS {rms_m:.3f} m.\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dem", nargs="?")
    parser.add_argument("--tiefort")
    parser.add_argument("--book", action="store_true")
    arguments = parser.parse_args()
    data = pathlib.Path(os.environ.get("TIEFORT_DATA", ROOT.parent / "shared" / "data"))
    dem = pathlib.Path(arguments.dem) if arguments.dem else data / EXTRACT
    if not dem.exists():
        print(f"skipped: {dem} is not there; name a raster", file=sys.stderr)
        return 0
    tiefort = program(arguments.tiefort)
    found = compared(tiefort, dem, "2500,5000")
    lattice = compared(tiefort, dem, "2794,5188", ["lattice"])
    rows = sorted(found["rows"] + lattice["rows"], key=lambda row: row["asked"] or 1 << 60)
    size = f"{found['columns_of_posts']} x {found['rows_of_posts']} posts, {found['spacing_m']:g} m apart"
    text = f"{dem.name}, {size}\n\n" + table([cells(row, found["posts"]) for row in rows]) + "\n" + "".join(notes(rows))
    print(text, end="")
    if arguments.book:
        put(ROOT / "docs" / "paper.md", "table 1", text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
