#!/usr/bin/env python3
"""Breaks real builds in every way a machine can, and checks that nothing is lost.

    scripts/crash.py --tiefort target/release/tiefort            the whole campaign
    scripts/crash.py --tiefort target/release/tiefort --short    three minutes of it
    scripts/crash.py --tiefort … kill flip                       some of it

kill     SIGKILL at random moments of builds and re-runs; `status` told the truth; the next build ends byte-identical
disk     a file system that is too small, in many sizes
readonly folders that cannot be written to any more, from a random moment on
flip     every byte of a small database flipped (a thousand of its page): `verify` names file and section, `build` mends
gone     every file deleted and truncated
two      two builds of one directory: the second ends with 75
workers  four processes share a directory, one is killed every second
sections a walk at random through the sections of a job in one folder: a step turns one to three of them on, off or to
         another value, then `build`, workers or a fresh build bring the folder up to date, some of which are killed, or
         a tile is run again first; afterwards it holds the files of a build into an empty folder, byte for byte.
         `--seed 7 --steps 40` repeats the beginning of a walk

Ends only processes it started. Needs Linux; `disk` needs the right to mount, `readonly` a user who is not root or the
right to become one.
"""

import argparse
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PRODUCT = ("tiles", "modules", "measured", "survey", "database.json")
REPORTS = ("report.json", "report.html", "breaches.geojson", "breaches.csv")


class Failed(Exception):
    """What should have held and did not."""


def expect(holds, *what):
    if not holds:
        raise Failed(" ".join(str(part) for part in what))


class Scene:
    """A folder with a job in it, and the bytes of an undisturbed build."""

    def __init__(self, program, size_m, tiles, extra=()):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="tiefort-crash-"))
        self.program = str(pathlib.Path(program).resolve())
        text = (ROOT / "tests/jobs/small.toml").read_text()
        changes = [("size_m = [4000, 4000]", f"size_m = [{size_m}, {size_m}]"),
                   ("columns = 2", f"columns = {tiles}"), ("rows = 2", f"rows = {tiles}"), *extra]
        for old, new in changes:
            expect(old in text, "small.toml lacks", old)
            text = text.replace(old, new, 1)
        self.text = text
        self.write_job("job.toml", text)

    def write_job(self, name, text):
        (self.folder / name).write_text(text)

    def start(self, *arguments, **options):
        return subprocess.Popen([self.program, *arguments], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, **options)

    def run(self, *arguments, **options):
        process = self.start(*arguments, **options)
        out, err = process.communicate()
        return process.returncode, out, err

    def build(self, name, job="job.toml"):
        code, _, err = self.run("build", job, "--out", name, "--quiet")
        expect(code in (0, 1), f"building {name} ended with {code}: {err}")
        return product(self.folder / name)

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)


def product(database):
    """The files that must not depend on what happened, by name."""
    found = {}
    for part in PRODUCT:
        path = database / part
        for file in sorted(path.iterdir()) if path.is_dir() else [path] if path.exists() else []:
            found[str(file.relative_to(database))] = file.read_bytes()
    return found


def same(one, other, what):
    names = sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))
    expect(not names, f"{what}: {len(names)} files differ: {names[:8]}")


def no_temporary(database, what):
    left = [str(path) for path in database.rglob(".*")] + [str(path) for path in database.glob("work")]
    expect(not left, f"{what}: left over: {left}")


def check_status(scene, name, before, after, tiles):
    """`status` says of each tile what its file bears out. `before` is None where nothing was built before."""
    database = scene.folder / name
    code, out, err = scene.run("status", name)
    if not (database / "database.json").exists():
        expect(code == 2, f"status of nothing ended with {code}")
        return "nothing"
    rows = [line.split() for line in out.splitlines() if re.fullmatch(r"  [#!fo.x]( [#!fo.x])*", line)]
    expect(len(rows) == tiles, f"status shows {len(rows)} rows: {out}{err}")
    there = product(database)
    if code in (0, 1):
        whole = [wanted for wanted in (before, after) if wanted is not None and wanted == there]
        expect(whole, "status says complete, and the bytes are of no finished build")
        lacking = [report for report in REPORTS if not (database / report).exists()]
        expect(not lacking, f"status says complete, and there is no {lacking}")
        return "complete"
    expect(code == 2 and "incomplete" in out, f"status ended with {code}: {out}{err}")
    for row, marks in enumerate(reversed(rows)):
        for col, mark in enumerate(marks):
            file = f"tiles/r{row:02}c{col:02}.tin"
            if mark == "#":
                expect(there.get(file) == after[file], f"{file} is called done and is not")
            elif mark == "o":
                # A build may have been killed between its last file and `database.json`: then it is the build before.
                known = [after[file], *([before[file]] if before else [])]
                expect(there.get(file) in known, f"{file} is not of the build before")
            else:
                expect(mark == "." and file not in there, f"{file} is called {mark} and is there")
    code, out, _ = scene.run("verify", name)
    expect(code == 2 and "incomplete" in out, "verify accepts an incomplete database")
    return "incomplete"


def killed_after(process, seconds):
    """Kills the process then, unless it has ended; whether it was killed."""
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    process.communicate()
    return process.returncode == -signal.SIGKILL


def campaign_kill(program, short, draw):
    kills_wanted = 12 if short else 200
    scene = Scene(program, 6000, 3)
    other_text = scene.text.replace("per_load_module = 100", "per_load_module = 60")
    scene.write_job("other.toml", other_text)
    start = time.monotonic()
    wanted = {"job.toml": scene.build("reference")}
    undisturbed = time.monotonic() - start
    wanted["other.toml"] = scene.build("other")
    seen, kills, rounds = {}, 0, 0
    while kills < kills_wanted:
        rounds += 1
        shutil.rmtree(scene.folder / "area", ignore_errors=True)
        job, before = "job.toml", None
        if rounds % 2 == 0:
            # An update of a finished database of another limit.
            before = scene.build("area", "other.toml")
        for _ in range(draw.choice((1, 1, 2, 4))):
            process = scene.start("build", job, "--out", "area", "--quiet")
            if not killed_after(process, draw.uniform(0, undisturbed * 1.05)):
                break
            kills += 1
            state = check_status(scene, "area", before, wanted[job], 3)
            seen[state] = seen.get(state, 0) + 1
        same(wanted[job], scene.build("area"), "after kills")
        no_temporary(scene.folder / "area", "after kills")
    tile_kills = 0
    while tile_kills < kills_wanted // 4:
        tile = f"{draw.randrange(3)},{draw.randrange(3)}"
        process = scene.start("tile", "job.toml", tile, "--out", "area", "--quiet")
        if killed_after(process, draw.uniform(0, undisturbed / 3)):
            tile_kills += 1
            code, out, _ = scene.run("status", "area")
            expect(code in (0, 2), f"status ended with {code}: {out}")
            if draw.random() < 0.5:
                code, _, err = scene.run("tile", "job.toml", tile, "--out", "area", "--quiet")
                expect(code == 0, f"the re-run tile cannot be run again: {err}")
            else:
                scene.build("area")
        same(wanted["job.toml"], product(scene.folder / "area"), "after killed re-runs")
        no_temporary(scene.folder / "area", "after killed re-runs")
    scene.close()
    said = f"{kills} kills of builds in {rounds} rounds ({seen}), {tile_kills} of re-runs"
    return f"{said}; a build takes {undisturbed:.2f} s"


def campaign_disk(program, short, draw):
    scene = Scene(program, 6000, 3)
    wanted = scene.build("reference")
    disk = scene.folder / "disk"
    disk.mkdir()
    full, done, kib = 0, 0, 32
    while done == 0:
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kib}k", "tmpfs", str(disk)])
        if mounted.returncode != 0:
            scene.close()
            return "skipped: nothing can be mounted here"
        try:
            if full == 0:
                # What cannot fit is refused before anything is written.
                code, _, err = scene.run("build", "job.toml", "--out", "disk/area", "--quiet")
                expect(code == 2 and "forecast" in err, f"{kib} KiB: exit {code}: {err}")
            code, _, err = scene.run("build", "job.toml", "--out", "disk/area", "--quiet", "--force")
            if code == 0:
                done += 1
            else:
                full += 1
                expect(code == 2 and "no space left" in err, f"{kib} KiB: exit {code}: {err}")
                check_left = [str(path) for path in disk.rglob(".*")]
                expect(not check_left, f"{kib} KiB: left over: {check_left}")
                if full % 3 == 0:
                    subprocess.run(["mount", "-o", "remount,size=64m", str(disk)], check=True)
                    scene.build("disk/area")
                    same(wanted, product(disk / "area"), f"after {kib} KiB were full")
            if code == 0:
                same(wanted, product(disk / "area"), f"{kib} KiB")
        finally:
            subprocess.run(["umount", str(disk)], check=True)
        kib = kib * (2 if short else 1) + (0 if short else 24)
    scene.close()
    return f"full in {full} sizes below {kib} KiB, each named, nothing left half-written"


def campaign_readonly(program, short, draw):
    scene = Scene(program, 6000, 3)
    start = time.monotonic()
    wanted = scene.build("reference")
    undisturbed = time.monotonic() - start
    options = {}
    if os.getuid() == 0:
        options = {"user": 65534, "group": 65534, "extra_groups": []}
        os.chmod(scene.folder, 0o777)
        try:
            scene.run("--version", **options)
        except OSError:
            scene.close()
            return "skipped: another user cannot run the program here"
    refused = 0
    for turn in range(4 if short else 40):
        shutil.rmtree(scene.folder / "area", ignore_errors=True)
        process = scene.start("build", "job.toml", "--out", "area", "--quiet", **options)
        time.sleep(draw.uniform(0, undisturbed))
        area = scene.folder / "area"
        folders = [area, *(path for path in area.glob("*") if path.is_dir())]
        folders = [path for path in folders if path.is_dir()]
        for path in folders:
            path.chmod(0o555)
        _, err = process.communicate()
        if process.returncode != 0:
            refused += 1
            expect(process.returncode == 2 and "not writable" in err, f"exit {process.returncode}: {err}")
        for path in folders:
            path.chmod(0o755)
        code, _, err = scene.run("build", "job.toml", "--out", "area", "--quiet", **options)
        expect(code == 0, f"exit {code}: {err}")
        same(wanted, product(area), "after the folders could be written to again")
        no_temporary(area, "after the folders could be written to again")
    scene.close()
    return f"{refused} of {turn + 1} builds met folders that could not be written to"


def mend(scene, wanted, path, good, what):
    """Builds over a damaged file. Where `database.json` no longer says that the folder is ours, that is refused, and
    nothing is changed."""
    before = product(scene.folder / "area")
    code, _, err = scene.run("build", "job.toml", "--out", "area", "--quiet")
    if path.name == "database.json" and code == 2:
        expect("expected an empty folder or a terrain database" in " ".join(err.split()), f"{what}: {err}")
        same(before, product(scene.folder / "area"), f"{what}, refused")
        path.write_bytes(good)
        return
    expect(code in (0, 1), f"{what}: a build ended with {code}: {err}")
    same(wanted, product(scene.folder / "area"), what)


def tiny(program):
    """The smallest database: one tile of four load modules."""
    return Scene(program, 1000, 1)


def campaign_flip(program, short, draw):
    scene = tiny(program)
    wanted = scene.build("area")
    rebuilds, flips = 0, 0
    files = sorted(path for path in (scene.folder / "area").rglob("*") if path.is_file() and path.name != "lock")
    for path in files:
        good = path.read_bytes()
        step = 199 if short else 1
        if path.suffix == ".html":
            # Megabytes of pictures under one checksum: a sample of them says as much.
            step = len(good) // (10 if short else 1000)
        for at in range(draw.randrange(min(step, max(len(good), 1))), len(good), step):
            bad = bytearray(good)
            bad[at] ^= 1 << draw.randrange(8)
            path.write_bytes(bad)
            code, out, err = scene.run("verify", "area")
            said = out + err
            expect(code == 2 and path.name in said, f"{path.name}, byte {at}: exit {code}: {said}")
            line = next(line for line in said.splitlines() if path.name in line)
            expect(line.count(": ") >= 2 or "format version" in line, f"no section is named: {line}")
            flips += 1
            if flips % (3 if short else 41) == 0:
                mend(scene, wanted, path, good, f"{path.name}, byte {at}, rebuilt")
                rebuilds += 1
            path.write_bytes(good)
        scene.build("area")
    scene.close()
    return f"{flips} flipped bytes of {len(files)} files found and named, {rebuilds} of them rebuilt"


def campaign_gone(program, short, draw):
    scene = Scene(program, 4000, 2)
    wanted = scene.build("area")
    tried = 0
    for name in wanted:
        path = scene.folder / "area" / name
        for length in (None, 0, 1, 63, 64, path.stat().st_size // 2, path.stat().st_size - 1):
            good = path.read_bytes()
            if length is None:
                path.unlink()
            else:
                path.write_bytes(good[:length])
            code, out, err = scene.run("verify", "area")
            expect(code == 2 and path.name in out + err, f"{name} cut to {length}: exit {code}: {out}{err}")
            mend(scene, wanted, path, good, f"{name} cut to {length}")
            tried += 1
            if short and tried % 2:
                break
    scene.close()
    return f"{tried} files deleted or truncated, named and rebuilt"


def campaign_two(program, short, draw):
    scene = Scene(program, 12000, 4)
    wanted = scene.build("reference")
    refused = 0
    for _ in range(2 if short else 10):
        shutil.rmtree(scene.folder / "area", ignore_errors=True)
        first = scene.start("build", "job.toml", "--out", "area", "--quiet")
        lock = scene.folder / "area/database.json"
        while not lock.exists() and first.poll() is None:
            time.sleep(0.005)
        code, _, err = scene.run("build", "job.toml", "--out", "area", "--quiet")
        if first.poll() is None:
            expect(code == 75 and "another run" in err, f"the second build ended with {code}: {err}")
            refused += 1
        if draw.random() < 0.5:
            # The lock dies with its process.
            first.send_signal(signal.SIGKILL)
        first.communicate()
        same(wanted, scene.build("area"), "after two builds at once")
    scene.close()
    expect(refused, "no second build came in time")
    return f"{refused} second builds refused with 75"


def campaign_workers(program, short, draw):
    scene = Scene(program, 8000 if short else 16000, 4 if short else 8)
    start = time.monotonic()
    wanted = scene.build("reference")
    alone = time.monotonic() - start
    arguments = ("worker", "job.toml", "--out", "area", "--lease", "2", "--workers", "1", "--quiet")
    told, killed, seconds = [], 0, 0.0
    for turn in range(1 if short else 5):
        shutil.rmtree(scene.folder / "area", ignore_errors=True)
        start = time.monotonic()
        workers = [scene.start(*arguments) for _ in range(4)]
        while any(worker.poll() is None for worker in workers):
            time.sleep(0.3 if short else 1.0)
            alive = [at for at, worker in enumerate(workers) if worker.poll() is None]
            for at in set(range(4)) - set(alive):
                _, err = workers[at].communicate()
                expect(workers[at].returncode in (0, 1), f"a worker ended with {workers[at].returncode}: {err}")
            if len(alive) == 4:
                victim = draw.choice(alive)
                workers[victim].send_signal(signal.SIGKILL)
                workers[victim].communicate()
                killed += 1
                workers[victim] = scene.start(*arguments)
        seconds += time.monotonic() - start
        same(wanted, product(scene.folder / "area"), "built by four workers")
        no_temporary(scene.folder / "area", "built by four workers")
        code, out, _ = scene.run("verify", "area")
        expect(code == 0, f"verify ended with {code}: {out}")
        told.append(str(turn))
    scene.close()
    return f"{len(told)} builds by 4 workers, {killed} killed, {seconds / len(told):.1f} s each ({alone:.1f} s alone)"


# --- sections of a job that come and go ---


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


def sections(program, short, seed, steps):
    """Walks at random through the sections of a job, in one folder, and compares every build with a fresh one."""
    told = []
    for one in [seed] if short or steps else range(seed, seed + WALKS):
        said, well = walk(program, one, steps or (SHORT_STEPS if short else STEPS))
        expect(well, said)
        told.append(said)
    return "; ".join(told)


CAMPAIGNS = {"kill": campaign_kill, "disk": campaign_disk, "readonly": campaign_readonly, "flip": campaign_flip,
             "gone": campaign_gone, "two": campaign_two, "workers": campaign_workers, "sections": sections}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tiefort", required=True, help="the program")
    parser.add_argument("--short", action="store_true", help="three minutes of it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--steps", type=int, help="steps of a walk through sections")
    parser.add_argument("campaigns", nargs="*", metavar="CAMPAIGN", help="some of: " + ", ".join(CAMPAIGNS))
    arguments = parser.parse_args()
    failed = 0
    for name in arguments.campaigns or CAMPAIGNS:
        start = time.monotonic()
        try:
            if name == "sections":
                said = sections(arguments.tiefort, arguments.short, arguments.seed, arguments.steps)
            else:
                said = CAMPAIGNS[name](arguments.tiefort, arguments.short, random.Random(arguments.seed))
        except Failed as error:
            failed += 1
            said = f"FAILED (seed {arguments.seed}): {error}"
        print(f"{name:<9}{time.monotonic() - start:7.1f} s  {said}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
