#!/usr/bin/env python3
"""Run what the tutorial runs, and write what it prints and draws into the book; then the figures of the sample area.

    scripts/write_book.py                    both
    scripts/write_book.py --only tutorial    or: sample
    scripts/write_book.py --tiefort PATH     with this program [default: target/release/tiefort, built if missing]

Blocks of text below a line `<!-- output of: COMMAND -->` are what the command prints.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from book import FIGURES, ROOT, put
from compare_methods import program

TUTORIAL = ROOT / "docs" / "tutorial.md"
PICTURES = ROOT / "docs" / "pictures"
PICTURE_BYTES_MAX = 300_000
OUTPUT = re.compile(r"(<!-- output of: (.*?) -->\n```text\n).*?(```)", re.DOTALL)
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.DOTALL | re.MULTILINE)


def shell(command, folder):
    """What a command prints, run in a folder with the program on the path."""
    ran = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=folder, capture_output=True, text=True)
    if ran.returncode not in (0, 1):
        sys.exit(f"{command}\n{ran.stdout}{ran.stderr}")
    return ran.stdout


def keep(path, name):
    """A picture of the book, which must be small."""
    size = path.stat().st_size
    assert size <= PICTURE_BYTES_MAX, f"{name}: {size} bytes, expected at most {PICTURE_BYTES_MAX}"
    shutil.copy(path, PICTURES / name)


def tutorial(folder):
    """Runs the blocks of the tutorial one after the other, but for the viewer's."""
    page = TUTORIAL.read_text()
    for block in BLOCK.findall(page):
        if "tiefort view" not in block:
            shell(block, folder)
    page = OUTPUT.sub(lambda found: f"{found[1]}{shell(found[2], folder)}{found[3]}", page)
    TUTORIAL.write_text(page)
    for name in ["relief.png", "perspective.png", "density.png"]:
        keep(folder / name, name)


def sample(folder):
    """Builds the sample area, and puts what came out into the page of figures."""
    shell(f"tiefort build '{ROOT}/configs/ntc.toml' --out ntc.tdb --quiet", folder)
    report = json.loads((folder / "ntc.tdb" / "report.json").read_text())
    size = sum(path.stat().st_size for path in (folder / "ntc.tdb").rglob("*") if path.is_file())
    modules = sum(path.stat().st_size for path in (folder / "ntc.tdb" / "modules").iterdir())
    module, window, features = report["per_load_module"], report["per_4km"], report["features"]
    wall, cpu = (sum(stage[key] for stage in report["stages"]) for key in ("wall_s", "cpu_s"))
    rows = [
        ("triangles", f"{report['triangles']:,}"),
        ("largest load module", f"{module['max']} of {module['limit']}"),
        ("mean of load modules", f"{module['mean']:.2f} of {module['mean_limit']:g}"),
        ("largest 4 km square", f"{window['max']:,} of {window['limit']:,}"),
        ("breaches", str(len(report["breaches"]))),
        ("RMS residual", f"{report['residual']['rms_m']:.3f} m"),
        *((f"RMS residual, {row['name']}", f"{row['residual']['rms_m']:.3f} m") for row in report["classes"][:2]),
        *((f"{row['name']} in the ground", f"{row['line_km'] + row['strip_km'] + row['channel_km']:.1f} km of "
           f"{row['wanted_km']:.1f} km") for row in features["classes"] if row["wanted_km"]),
        ("lakes", str(sum(row["lakes"] for row in features["classes"]))),
        ("load modules on the disk", f"{modules / 1e6:.1f} MB"),
        ("the whole database", f"{size / 1e6:.1f} MB"),
        ("time on the clock, with workers", f"{wall:.1f} s, {report['workers']}"),
        ("processor time", f"{cpu:.1f} s"),
    ]
    put(FIGURES, "sample", "| | |\n| - | -: |\n" + "".join(f"| {name} | {value} |\n" for name, value in rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=["tutorial", "sample"])
    parser.add_argument("--tiefort")
    arguments = parser.parse_args()
    tiefort = pathlib.Path(program(arguments.tiefort)).resolve()
    os.environ["PATH"] = f"{tiefort.parent}:{os.environ['PATH']}"
    for part in [tutorial, sample]:
        if arguments.only in (None, part.__name__):
            with tempfile.TemporaryDirectory() as folder:
                part(pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
