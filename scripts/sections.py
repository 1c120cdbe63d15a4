#!/usr/bin/env python3
"""Walks at random through the sections of a job, in one folder, and compares every build with a fresh one.

    scripts/sections.py --tiefort target/release/tiefort            5000 steps of each of 4 walks
    scripts/sections.py --tiefort target/release/tiefort --short    500 steps of one walk, two minutes
    scripts/sections.py --tiefort … --seed 7 --steps 40             the first 40 steps of that walk

A step turns one to three sections on, off or over to another value: features, lod, importance, dem.water, tin.pins,
tin, tiles, load_modules, limits. Then the folder of the step before is brought up to date, by `build`, by `worker`
processes or by a fresh build, some of which are killed on the way; or a tile of it is run again first. Afterwards it
holds the files of a build into an empty folder, byte for byte, and no others. A failure prints the walk and the step.

Ends only processes it started.
"""

import argparse
import json
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from crash import Failed, expect, killed_after, product, same

AREA = """[area]
name = "walk"
crs = "EPSG:32611"
origin_m = [505000, 3875000]
size_m = [1000, 2000]
spacing_m = 25
"""
# Each section or key with its values; the first is that it is not there.
CHOICES = {
    "features": ["", '[features]\nsources = ["features.geojson"]\n',
                 '[features]\nsources = ["features.geojson"]\nbuildings = false\nshare_max = 0.2\n',
                 '[features]\nsources = ["lake.geojson"]\n'],
    "lod": ["", "[lod]\nlevels = [{ inner_share = 0.5 }]\n",
            '[lod]\nlevels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]\nborder = "own"\n'],
    "importance": ["", '[importance]\ndefault = 8\nareas = [{ sample = "mountains", class = "range", weight = 1 }]\n',
                   '[importance]\nareas = [{ file = "polygon.geojson", class = "range", weight = 0 }]\n'],
    "water": ["", 'water = "polygon.geojson"\n', 'water = { file = "polygon.geojson", level_m = 700 }\n'],
    "pins": ["", 'pins = "pins.geojson"\n'],
    "tin": ["", 'method = "greedy"\n', 'effort = "fast"\n', 'allocation = "equal"\n', "max_residual_m = 20\n",
            "target_rms_m = 8\n", 'method = "greedy"\npoints = 60\n', "sight = false\n"],
    "tiles": ["", 'order = "raster"\n', 'borders = "regular"\n'],
    "modules": ["", 'outer_border = "fixed"\n', 'edges = "clip"\n'],
    "limits": ["", "mean_per_load_module = 24\n", "per_load_module = 40\npool = 30\n", 'count = "polygons"\n'],
    "seed": ["seed = 1\n", "seed = 2\n"],
}
SHORT_STEPS, STEPS, WALKS = 500, 5000, 4


def corner(east, north):
    return [505000 + east, 3875000 + north]


def collection(*features):
    system = {"type": "name", "properties": {"name": "EPSG:32611"}}
    return json.dumps({"type": "FeatureCollection", "crs": system, "features": list(features)})


def feature(kind, places, **properties):
    places = [corner(*place) for place in places]
    coordinates = {"Point": lambda: places[0], "LineString": lambda: places, "Polygon": lambda: [places + places[:1]]}
    geometry = {"type": kind, "coordinates": coordinates[kind]()}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


LAKE = feature("Polygon", [(550, 1100), (800, 1120), (780, 1400), (560, 1380)], natural="water")
FILES = {
    "features.geojson": collection(
        feature("LineString", [(-100, 300), (400, 420), (1100, 500)], highway="primary"),
        feature("LineString", [(300, 2100), (420, 900), (350, -100)], waterway="stream"),
        feature("LineString", [(-100, 1500), (600, 1600), (1100, 1900)], highway="track", bridge="yes"),
        feature("Polygon", [(700, 700), (740, 700), (740, 730), (700, 730)], building="yes"), LAKE),
    "lake.geojson": collection(LAKE),
    "polygon.geojson": collection(feature("Polygon", [(-50, 600), (500, 650), (450, 1300), (-50, 1250)])),
    "pins.geojson": collection(
        feature("Point", [(325, 325)], pin="add"), feature("Point", [(675, 1525)], pin="height", height_m=720),
        feature("Polygon", [(100, 1500), (400, 1520), (380, 1800)], pin="exclude")),
}


def job_text(chosen):
    at = {name: CHOICES[name][which] for name, which in chosen.items()}
    return (f"{AREA}[dem]\nsource = \"sample\"\n{at['seed']}{at['water']}{at['importance']}{at['features']}"
            f"[tiles]\nrows = 2\ncolumns = 1\n{at['tiles']}[load_modules]\n{at['modules']}[limits]\n{at['limits']}"
            f"[tin]\n{at['tin']}{at['pins']}{at['lod']}")


def content(database):
    """What must be as in a fresh build: bytes of the product, and the names of all files but those of the run."""
    bytes_of = product(database)
    for path in sorted(database.rglob("*")):
        name = str(path.relative_to(database))
        if path.is_file() and name not in ("lock", "report.html"):
            bytes_of.setdefault(name, b"")
    return bytes_of


class Walk:
    """A folder that is brought from job to job, and what fresh builds of these jobs hold."""

    def __init__(self, program, seed):
        self.program, self.seed = str(pathlib.Path(program).resolve()), seed
        self.draw = random.Random(seed)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="tiefort-walk-"))
        self.area = self.folder / "area"
        for name, text in FILES.items():
            (self.folder / name).write_text(text)
        self.chosen = {name: 0 for name in CHOICES}
        self.references, self.counts, self.refused, self.seconds = {}, {}, 0, 0.2

    def start(self, *arguments):
        return subprocess.Popen([self.program, *arguments, "--no-html", "--quiet"], cwd=self.folder, text=True,
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def run(self, *arguments):
        process = self.start(*arguments)
        _, err = process.communicate()
        return process.returncode, err

    def reference(self, text):
        """The content of a fresh build of a job; None where the job is refused."""
        if text not in self.references:
            start = time.monotonic()
            code, err = self.run("build", "job.toml", "--out", "fresh")
            expect(code in (0, 1, 2), f"a fresh build ended with {code}: {err}")
            self.seconds = 0.8 * self.seconds + 0.2 * (time.monotonic() - start)
            self.references[text] = content(self.folder / "fresh") if code < 2 else None
            shutil.rmtree(self.folder / "fresh", ignore_errors=True)
        return self.references[text]

    def turn(self):
        """Other sections, with which the job can be built."""
        while True:
            chosen = dict(self.chosen)
            for name in self.draw.sample(sorted(CHOICES), self.draw.choice((1, 1, 2, 3))):
                others = [which for which in range(len(CHOICES[name])) if which != chosen[name]]
                # Half of the time a section goes rather than changes.
                chosen[name] = 0 if chosen[name] and self.draw.random() < 0.5 else self.draw.choice(others)
            text = job_text(chosen)
            (self.folder / "job.toml").write_text(text)
            if self.reference(text) is not None:
                self.chosen = chosen
                return text
            self.refused += 1

    def killed(self, *arguments):
        return killed_after(self.start(*arguments), self.draw.uniform(0, 1.1 * self.seconds))

    def workers(self):
        """Two processes, of which one may be killed; whether one has ended by itself."""
        arguments = ("worker", "job.toml", "--out", "area", "--workers", "1", "--lease", "2")
        processes = [self.start(*arguments) for _ in range(2)]
        if self.draw.random() < 0.5:
            time.sleep(self.draw.uniform(0, self.seconds))
            processes[0].send_signal(signal.SIGKILL)
        ended = []
        for process in processes:
            _, err = process.communicate()
            if process.returncode != -signal.SIGKILL:
                ended.append(process.returncode)
                expect(process.returncode in (0, 1), f"a worker ended with {process.returncode}: {err}")
        return bool(ended)

    def step(self):
        """One way of bringing the folder up to date."""
        before = (self.folder / "job.toml").read_text() if (self.folder / "job.toml").exists() else None
        if before and self.draw.random() < 0.1:
            tile = f"{self.draw.randrange(2)},0"
            more = ["--release-borders"] if self.draw.random() < 0.5 else []
            code, err = self.run("tile", "job.toml", tile, "--out", "area", *more)
            expect(code in (0, 1), f"tile {tile} ended with {code}: {err}")
            self.count("tile")
        text = self.turn()
        way = self.draw.choice(("build", "build", "build", "kill", "kill", "worker", "kill fresh", "fresh"))
        self.count(way)
        is_done = way == "worker" and self.workers()
        if way == "kill":
            for _ in range(self.draw.choice((1, 2))):
                self.killed("build", "job.toml", "--out", "area")
        elif way == "kill fresh":
            self.killed("build", "job.toml", "--out", "area", "--fresh")
        if not is_done:
            fresh = ["--fresh"] if way == "fresh" else []
            code, err = self.run("build", "job.toml", "--out", "area", *fresh)
            expect(code in (0, 1), f"after {way}, a build ended with {code}: {err}")
        same(self.references[text], content(self.area), f"after {way}")

    def count(self, way):
        self.counts[way] = self.counts.get(way, 0) + 1

    def verify(self):
        done = subprocess.run([self.program, "verify", "area"], cwd=self.folder, capture_output=True, text=True)
        expect(done.returncode in (0, 1), f"verify ended with {done.returncode}: {done.stdout}{done.stderr}")

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)


def walk(program, seed, steps):
    """Walks so many steps; what is to be told, and whether all was well."""
    path, start = Walk(program, seed), time.monotonic()
    try:
        for step in range(steps):
            path.step()
            if step % 10 == 9:
                path.verify()
    except Failed as error:
        return f"FAILED at step {step} (--seed {seed} --steps {step + 1}): {error}\n{job_text(path.chosen)}", False
    finally:
        path.close()
    ways = ", ".join(f"{count} {way}" for way, count in sorted(path.counts.items()))
    jobs = sum(reference is not None for reference in path.references.values())
    told = f"seed {seed}: {steps} steps through {jobs} jobs ({ways}; {path.refused} jobs refused)"
    return f"{told}, {time.monotonic() - start:.0f} s", True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tiefort", required=True, help="the program")
    parser.add_argument("--short", action="store_true", help=f"{SHORT_STEPS} steps of one walk")
    parser.add_argument("--seed", type=int, help="one walk, this one")
    parser.add_argument("--steps", type=int, help="steps of each walk")
    arguments = parser.parse_args()
    steps = arguments.steps or (SHORT_STEPS if arguments.short else STEPS)
    one = arguments.seed if arguments.seed is not None else 1
    seeds = [one] if arguments.short or arguments.seed is not None else range(1, WALKS + 1)
    failed = 0
    for seed in seeds:
        told, well = walk(arguments.tiefort, seed, steps)
        failed += not well
        print(f"sections {told}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
