#!/usr/bin/env python3
"""Holds that two programs make the same bytes: builds jobs with both, exports them in every format, compares hashes.

    scripts/same_bytes.py OLD NEW                      tests/jobs/small.toml and configs/ntc.toml
    scripts/same_bytes.py OLD NEW JOB.toml FOLDER …    other jobs; of a folder of rasters and vectors `init` makes one
    scripts/same_bytes.py OLD NEW … --save hashes.json OLD may be such a file in place of a program

Compared are `tiles/`, `modules/` and `database.json`, and every file of every export; what differs is listed, and the
exit code says whether anything does. A job has at most `--modules` load modules on a side exported (default 8).
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FORMATS = {
    "modules": "modules", "ply": "m.ply", "obj": "m.obj", "glb": "m.glb", "geotiff": "m.tif", "gpkg": "m.gpkg",
    "features": "f.gpkg", "openflight": "openflight", "3dtiles": "3dtiles", "quantized-mesh": "terrain",
    "3tz": "m.3tz", "mbtiles": "m.mbtiles", "terrain-rgb": "m.pmtiles", "usd": "usd",
    "heightmap": "heightmap", "gazebo": "gazebo",
}


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return done.returncode, done.stdout, done.stderr


def files_of(path):
    """Hashes of a file, or of the files below a folder, by name."""
    files = [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.is_file())
    return {str(file.relative_to(path.parent)): hashlib.blake2b(file.read_bytes()).hexdigest()[:24] for file in files}


def job_of(program, given, folder):
    if given.is_file():
        return given
    files = [path for path in sorted(given.iterdir()) if path.suffix in (".tif", ".pbf", ".geojson", ".shp", ".gpkg")]
    job = folder / f"{given.name}.toml"
    code, _, told = run(program, "init", *files, "--out", job)
    assert code == 0, told
    return job


def hashes_of_job(program, given, folder, modules):
    job, database = job_of(program, given, folder), folder / "area.tdb"
    code, _, told = run(program, "build", job, "--out", database, "--quiet")
    hashes = {"build": str(code)}
    assert database.exists(), told
    for part in ("tiles", "modules", "database.json"):
        hashes |= files_of(database / part)
    area = json.loads((database / "database.json").read_text())["area"]
    last = min(modules, area["module_rows"]) - 1, min(modules, area["module_cols"]) - 1
    for name, out in FORMATS.items():
        block = [] if name in ("features", "quantized-mesh", "mbtiles") else ["--modules", f"0,0..{last[0]},{last[1]}"]
        code, _, told = run(program, "export", database, "--format", name, "--out", folder / out, *block)
        hashes[f"export {name}"] = str(code) if code == 0 else f"{code}: {told.splitlines()[0]}"
        if (folder / out).exists():
            hashes |= files_of(folder / out)
    return hashes


def hashes_of(program, jobs, modules):
    if str(program).endswith(".json"):
        return json.loads(Path(program).read_text())
    found = {}
    for given in jobs:
        with tempfile.TemporaryDirectory() as scratch:
            found[str(given)] = hashes_of_job(str(Path(program).resolve()), given, Path(scratch), modules)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("jobs", nargs="*", type=Path)
    parser.add_argument("--save", type=Path, help="where to write the hashes of NEW")
    parser.add_argument("--modules", type=int, default=8)
    given = parser.parse_args()
    jobs = given.jobs or [ROOT / "tests/jobs/small.toml", ROOT / "configs/ntc.toml"]
    new = hashes_of(given.new, jobs, given.modules)
    if given.save:
        given.save.write_text(json.dumps(new, indent=1))
    old = hashes_of(given.old, jobs, given.modules)
    differing = 0
    for job in map(str, jobs):
        names = sorted(old[job].keys() | new[job].keys())
        other = [name for name in names if old[job].get(name) != new[job].get(name)]
        print(f"{job}: {len(names)} compared, {len(other)} differ")
        for name in other[:20]:
            print(f"  {name}: {old[job].get(name)} != {new[job].get(name)}")
        differing += len(other)
    sys.exit(differing > 0)


if __name__ == "__main__":
    main()
