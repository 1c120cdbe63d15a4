#!/usr/bin/env python3
"""The founding paper's experiment: its arithmetic, its Table 2, and what broke which limit at every number of points.

    scripts/paper.py                         configs/paper.toml: 76,500 points, 90,000, and a total of 93,471
    scripts/paper.py --job mine.toml         any job with method = "paper" and clipped edges
    scripts/paper.py --points 1000,2000      other numbers of points
    scripts/paper.py --book                  also put Table 2 and what became of limits into the book
    scripts/paper.py --tiefort PATH          with this program [default: target/release/tiefort, built if missing]

The paper began with 90,000 points, found limits broken and took 15 % off: 76,500. With 101 x 101 corners of load
modules and 1,200 points on the border that are no corners, that is 87,901; its Table 2 sums to 93,471 points, which it
does not explain, so both totals are run.
"""

import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

from book import ROOT, put
from compare_methods import program

START, CUT = 90_000, 0.85
TABLE_2_TOTAL = 93_471
# Polis and McKeown (1993), Table 2: posts, points, RMS, largest residual.
PAPER_TABLE_2 = {
    "mountains": ("1,313,410", "28,532", "5.26791", "52"),
    "plains": ("2,587,215", "64,939", "0.86912", "24"),
    "overall": ("3,900,625", "93,471", "2.99929", "52"),
}


def built(tiefort, job, points):
    """The report of the job with so many points; its files are found where the job's are."""
    text, count = re.subn(r"(?m)^points *=.*$", f"points = {points}", job.read_text())
    if count != 1:
        sys.exit(f"{job}: expected one line `points = …`")
    with tempfile.TemporaryDirectory(dir=job.parent, prefix=".paper-") as folder:
        # Beside the job, so that its relative paths lead where they did.
        changed = job.parent / f"{pathlib.Path(folder).name}.toml"
        changed.write_text(text)
        try:
            out = pathlib.Path(folder) / "out.tdb"
            ran = subprocess.run([str(tiefort), "build", str(changed), "--out", str(out), "--quiet"],
                                 capture_output=True, text=True)
            if ran.returncode not in (0, 1):
                sys.exit(ran.stderr)
            return json.loads((out / "report.json").read_text())
        finally:
            changed.unlink()


def limits(name, module, window):
    """One line of what was used of each limit."""
    return (f"  {name:<28} largest load module {module['max']:>4} of {module['limit']} ({module['over']:>4} over)   "
            f"mean {module['mean']:6.2f} of {module['mean_limit']:g}   "
            f"largest 4 km square {window['max']:>5} of {window['limit']} ({window['over']:>4} over)")


def tell(report, asked):
    points, before = report["points"], report.get("before_removals")
    fixed = f"{points['corner']:,} corners + {points['border']:,} on the border"
    total = asked + points["corner"] + points["border"]
    print(f"{asked:,} selected + {fixed} = {total:,}; in the load modules: {points['total']:,}")
    removed = f"after {before['removed']:,} points made room" if before else "as cut"
    if before:
        print(limits("before points made room", before["per_load_module"], before["per_4km"]))
    print(limits(removed, report["per_load_module"], report["per_4km"]))
    for row in report["classes"]:
        residual = row["residual"]
        print(f"  {row['name']:<12}{row['posts']:>12,} posts{row['points']:>9,} points   "
              f"RMS {residual['rms_m']:.5f} m   largest {residual['max_m']:.1f} m")
    residual, posts = report["residual"], sum(row["posts"] for row in report["classes"])
    print(f"  {'overall':<12}{posts:>12,} posts{points['total']:>9,} points   RMS {residual['rms_m']:.5f} m by posts, "
          f"{report['overall_point_weighted_rms_m']:.5f} m by points   largest {residual['max_m']:.1f} m")
    print(f"  breaches: {len(report['breaches'])}\n")


def table_2(report):
    """The residuals of mountains, plains and all, beside the paper's."""
    text = "| ground | posts | points | RMS m | largest m | paper: posts | points | RMS m | largest m |\n"
    text += "| - | -: | -: | -: | -: | -: | -: | -: | -: |\n"
    rows = {row["name"]: [row["posts"], row["points"], row["residual"]] for row in report["classes"]}
    rows = {"mountains": rows["mountains"], "plains": rows["default"],
            "overall": [sum(row["posts"] for row in report["classes"]), report["points"]["total"], report["residual"]]}
    for name, (posts, points, residual) in rows.items():
        text += (f"| {name} | {posts:,} | {points:,} | {residual['rms_m']:.5f} | {residual['max_m']:.1f} "
                 f"| {' | '.join(PAPER_TABLE_2[name])} |\n")
    overall = report["overall_point_weighted_rms_m"]
    return f"{text}\nOverall, weighted by points as the paper does: {overall:.5f} m.\n"


def cuts(runs):
    """What was above which limit at every number of points, before and after points made room."""
    text = "| points asked for | limit | largest before | over | largest after | over |\n"
    text += "| -: | - | -: | -: | -: | -: |\n"
    for asked, report in runs:
        before = report.get("before_removals") or report
        for name, key in [("load module", "per_load_module"), ("4 km square", "per_4km")]:
            first, last = before[key], report[key]
            text += (f"| {asked:,} | {name}, {last['limit']:,} | {first['max']:,} | {first['over']:,} "
                     f"| {last['max']:,} | {last['over']:,} |\n")
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--job", type=pathlib.Path, default=ROOT / "configs" / "paper.toml")
    parser.add_argument("--points")
    parser.add_argument("--book", action="store_true")
    parser.add_argument("--tiefort")
    arguments = parser.parse_args()
    tiefort = program(arguments.tiefort)
    if arguments.points:
        runs = [int(points) for points in arguments.points.split(",")]
    else:
        runs = [START, round(START * CUT)]
    found = []
    for asked in runs:
        report = built(tiefort, arguments.job, asked)
        found.append((asked, report))
        tell(report, asked)
    if arguments.book:
        page = ROOT / "docs" / "paper.md"
        put(page, "table 2", table_2(report))
        put(page, "cuts", cuts(found))
    if not arguments.points:
        fixed = report["points"]["corner"] + report["points"]["border"]
        tell(built(tiefort, arguments.job, TABLE_2_TOTAL - fixed), TABLE_2_TOTAL - fixed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
