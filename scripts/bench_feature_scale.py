#!/usr/bin/env python3
"""Measure the stages `profile` and `level` on strips of a road grid over 1000 km: time and memory as it grows.

    scripts/bench_feature_scale.py             strips of 25, 50 and 100 km
    scripts/bench_feature_scale.py 25 50       strips of so many kilometres

Roads run every 20 km both ways, of four classes, over the built-in terrain at 25 m: 100,000 km of them over 1000 km
x 1000 km. Each strip is 1000 km long; both stages run as units of work (`tiefort task`). The last row is the whole,
by the straight line through the last two strips.
"""

import argparse
import json
import math
import sys

from bench import ROOT
from fidelity.workshop import markdown, run, scratch, tell, why

LENGTH_KM, STEP_KM, TILE_KM = 1000, 20, 10
ORIGIN_M = (500000, 3900000)
CLASSES = ["motorway", "primary", "residential", "track"]
BATCH = 200


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("km", nargs="*", type=int, default=[25, 50, 100], help="widths of strips")
    parser.add_argument("--tiefort", default=ROOT / "target" / "release" / "tiefort", help="the program")
    options = parser.parse_args()
    strips = [measured(options.tiefort, width) for width in options.km]
    rows = [list(map(float, strip)) for strip in strips]
    if 1 < len(rows):
        before, last = rows[-2:]
        share = (LENGTH_KM - last[0]) / (last[0] - before[0])
        rows.append([b + (b - a) * share for a, b in zip(before, last)])
    head = ["strip km", "roads km", "profile s", "MB", "level s", "MB"]
    cells = [[f"{row[0]:.0f}", *(f"{number:,.1f}" for number in row[1:])] for row in rows]
    markdown("A grid of roads, 1000 km long", head, cells)


def measured(tiefort, width_km):
    """Width, kilometres of road, and seconds and megabytes of both stages."""
    with scratch("feature-scale") as folder:
        folder.mkdir(parents=True)
        roads_km = write_roads(folder / "roads.geojson", width_km)
        rows = math.ceil(width_km / TILE_KM)
        job = folder / "strip.toml"
        job.write_text(
            f'[area]\nname = "strip"\ncrs = "EPSG:32611"\norigin_m = {list(ORIGIN_M)}\n'
            f"size_m = [{LENGTH_KM * 1000}, {width_km * 1000}]\nspacing_m = 25\n"
            f'[dem]\nsource = "sample"\n[features]\nsources = ["roads.geojson"]\n'
            f"[tiles]\ncolumns = {LENGTH_KM // TILE_KM}\nrows = {rows}\n"
        )
        tiles = [f"{row},{column}" for row in range(rows) for column in range(LENGTH_KM // TILE_KM)]
        found = [width_km, roads_km]
        for stage, units in (("profile", tiles), ("level", [])):
            tell(f"{stage} of {width_km} km")
            seconds, peak_mb = 0.0, 0.0
            for at in range(0, max(len(units), 1), BATCH):
                ran = run(tiefort, "task", job, stage, *units[at : at + BATCH], "--out", folder / "strip.tdb")
                if ran["code"] != 0:
                    sys.exit(why(ran))
                seconds, peak_mb = seconds + ran["wall_s"], max(peak_mb, ran["peak_mb"])
            found += [seconds, peak_mb]
        return found


def write_roads(path, width_km):
    """A grid of winding roads as GeoJSON; returns how many kilometres they are."""
    lines = []
    for across, length, count in ((True, width_km, LENGTH_KM // STEP_KM), (False, LENGTH_KM, width_km // STEP_KM + 1)):
        for number in range(count):
            middle = (number + 0.5) * STEP_KM * 1000
            if not across and width_km * 1000 < middle:
                continue
            line = [(t, middle + 300 * math.sin(t / 900 + number)) for t in range(0, length * 1000 + 1, 200)]
            lines.append([(aside, t) if across else (t, aside) for t, aside in line])
    features = [
        {
            "type": "Feature",
            "properties": {"highway": CLASSES[number % len(CLASSES)]},
            "geometry": {
                "type": "LineString",
                "coordinates": [[round(ORIGIN_M[0] + x, 2), round(ORIGIN_M[1] + y, 2)] for x, y in line],
            },
        }
        for number, line in enumerate(lines)
    ]
    crs = {"type": "name", "properties": {"name": "EPSG:32611"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))
    return sum(math.dist(a, b) for line in lines for a, b in zip(line, line[1:])) / 1000


if __name__ == "__main__":
    main()
