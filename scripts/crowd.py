#!/usr/bin/env python3
"""Builds a job whose roads all lie in one load module, and tells what that took: time, memory, what became of them.

    scripts/crowd.py [SEGMENTS [TIEFORT]]      1,000,000 and target/release/tiefort by default

Whatever is drawn, the build has to end, within its limits, and to tell of every road.
"""

import array
import json
import pathlib
import random
import resource
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
ORIGIN = (505000.0, 3875000.0)
SEGMENTS_PER_ROAD = 10
JOB = """[area]
name = "crowd"
crs = "EPSG:32611"
origin_m = [505000.0, 3875000.0]
size_m = [2000, 2000]
spacing_m = 25
[dem]
source = "sample"
seed = 1
[tiles]
rows = 2
columns = 2
[features]
sources = ["roads.shp"]
"""


def write_roads(folder: pathlib.Path, segments: int) -> int:
    """Tracks that wander about in one square of 500 m, as a Shapefile; gives how many there are."""
    random.seed(1)
    roads, words = max(1, segments // SEGMENTS_PER_ROAD), 50
    bounds = struct.pack("<4d", *ORIGIN, ORIGIN[0] + 2000, ORIGIN[1] + 2000)
    with open(folder / "roads.shp", "wb") as file:
        file.write(bytes(100))
        for road in range(roads):
            x, y = random.random() * 500, random.random() * 500
            places = array.array("d")
            for _ in range(SEGMENTS_PER_ROAD + 1):
                x = min(max(x + random.uniform(-15, 15), 0), 500)
                y = min(max(y + random.uniform(-15, 15), 0), 500)
                places.extend((ORIGIN[0] + 500 + x, ORIGIN[1] + 500 + y))
            content = struct.pack("<i", 3) + bounds + struct.pack("<iii", 1, len(places) // 2, 0) + places.tobytes()
            file.write(struct.pack(">ii", road + 1, len(content) // 2) + content)
            words += 4 + len(content) // 2
        file.seek(0)
        file.write(struct.pack(">i5ii", 9994, 0, 0, 0, 0, 0, words) + struct.pack("<ii", 1000, 3) + bounds + bytes(32))
    field = b"highway\0\0\0\0C" + bytes(4) + bytes([10, 0]) + bytes(14) + b"\r"
    header = struct.pack("<BBBBIHH20x", 3, 26, 1, 1, roads, 65, 11) + field
    (folder / "roads.dbf").write_bytes(header + b" track     " * roads + b"\x1a")
    return roads


def main() -> None:
    segments = int(sys.argv[1]) if 1 < len(sys.argv) else 1_000_000
    tiefort = pathlib.Path(sys.argv[2]) if 2 < len(sys.argv) else ROOT / "target/release/tiefort"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "job.toml").write_text(JOB)
        roads = write_roads(folder, segments)
        command = [tiefort.resolve(), "build", "job.toml", "--out", "out.tdb", "--no-html", "--quiet"]
        began = time.monotonic()
        subprocess.run(command, cwd=folder, check=True)
        seconds = time.monotonic() - began
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        report = json.loads((folder / "out.tdb/report.json").read_text())
        told = report["features"]["remarks"]
        print(f"{segments} segments of {roads} roads: {seconds:.1f} s, {used.ru_utime + used.ru_stime:.1f} s of CPU, "
              f"{used.ru_maxrss / 1024:.0f} MB; {told}; {len(report['breaches'])} breaches")
        assert not report["breaches"], "no limit may be exceeded"
        subprocess.run([tiefort.resolve(), "verify", "out.tdb"], cwd=folder, check=True)


if __name__ == "__main__":
    main()
