"""What benches share: a Python with packages, C++ programs, files, runs, tables, and what the book shows."""

import argparse
import contextlib
import hashlib
import inspect
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import venv

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FIGURES = ROOT / "docs" / "figures" / "README.md"
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
FOLDER = TARGET / "bench"
VENV = FOLDER / "venv"
PACKAGES = ["pydelatin==0.4.0", "numpy", "rasterio"]
SOURCES = pathlib.Path(__file__).resolve().parent
DATA = pathlib.Path(os.environ.get("TIEFORT_DATA", ROOT / ".." / "shared" / "data")).resolve()

# A process of its own, small, so that the peak it reports is its child's and not that of our arrays.
LAUNCHER = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
done = subprocess.run(sys.argv[1:], capture_output=True, text=True)
wall_s = time.perf_counter() - start
used = resource.getrusage(resource.RUSAGE_CHILDREN)
json.dump({"code": done.returncode, "out": done.stdout, "err": done.stderr, "wall_s": wall_s,
           "cpu_s": used.ru_utime + used.ru_stime, "peak_mb": used.ru_maxrss * 1024 / 1e6}, sys.stdout)
"""


def tell(text):
    """Says something to the user; tables go to stdout."""
    print(text, file=sys.stderr, flush=True)


def skip(what, why):
    tell(f"SKIPPED {what}: {why}")


# --- programs ---


def parser_of(bench):
    """A parser of the arguments of a bench, whose documentation tells what it measures; `--tiefort` names a program."""
    parser = argparse.ArgumentParser(prog=f"bench.py {bench.__name__}", description=inspect.cleandoc(bench.__doc__),
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tiefort", metavar="PATH", type=pathlib.Path, default=TARGET / "release" / "tiefort",
                        help="the program to measure (default: target/release/tiefort, built if it is missing)")
    return parser


def program(options):
    """The program to measure."""
    if options.tiefort == TARGET / "release" / "tiefort" and not options.tiefort.exists():
        subprocess.run(["cargo", "build", "--release", "-p", "tiefort"], cwd=ROOT, check=True)
    return options.tiefort.resolve(strict=True)


def load():
    """How busy the machine is, over 1, 5 and 15 minutes."""
    return ", ".join(f"{load:.2f}" for load in os.getloadavg())


def prepare_venv(*more):
    """Installs the packages, and goes on in the Python that has them."""
    if pathlib.Path(sys.prefix) == VENV:
        return
    python = VENV / ("Scripts" if os.name == "nt" else "bin") / "python"
    if not python.exists():
        venv.create(VENV, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES, *more],
                   check=True)
    sys.stdout.flush()
    sys.exit(subprocess.run([python, *sys.orig_argv[1:]]).returncode)


def compiled(name, *flags):
    """The program made of a C++ file of this folder, compiled when it is not the newest; None when it cannot be."""
    source, program = SOURCES / f"{name}.cpp", FOLDER / name
    if program.exists() and source.stat().st_mtime < program.stat().st_mtime:
        return program
    if not shutil.which("g++"):
        return skip(name, "no g++")
    FOLDER.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(["g++", "-O2", "-std=c++17", *flags, "-o", program, source], capture_output=True, text=True)
    if done.returncode != 0:
        return skip(name, f"g++ does not compile it\n{done.stderr}")
    return program


def lindstrom_turk():
    """The driver of CGAL's edge collapse; its headers are installed where that is permitted."""
    if not pathlib.Path("/usr/include/CGAL/Surface_mesh_simplification").exists():
        if os.name == "nt" or os.geteuid() != 0 or not shutil.which("apt-get"):
            return skip("Lindstrom-Turk", "libcgal-dev is not installed, and this user may not install it")
        tell("installing libcgal-dev")
        for words in [["update", "--quiet"], ["install", "--yes", "--no-install-recommends", "libcgal-dev"]]:
            if subprocess.run(["apt-get", *words], stdout=subprocess.DEVNULL).returncode != 0:
                return skip("Lindstrom-Turk", f"apt-get {words[0]} did not work")
    return compiled("lindstrom_turk", "-DNDEBUG")


def run(*command):
    """Runs a command: exit code, output, wall and CPU seconds, peak memory in MB (of the command alone)."""
    command = [str(word) for word in command]
    launched = subprocess.run([sys.executable, "-S", "-c", LAUNCHER, *command], capture_output=True, check=True)
    return json.loads(launched.stdout)


def last_line(text):
    lines = text.strip().splitlines()
    return lines[-1] if lines else ""


def why(ran):
    """The message of a command that ended with an error, in a line."""
    lines = [line for line in ran["err"].splitlines() if line.strip()]
    found = [line for line in lines if line.startswith("error")] or lines[-1:]
    return f"exit code {ran['code']}: {found[0] if found else 'no message'}"


# --- files ---


def write_heights(path, heights):
    """Heights, rows from the south, as the C++ programs read them."""
    rows, columns = heights.shape
    path.write_bytes(struct.pack("<II", columns, rows) + heights.astype("<f4").tobytes())


def write_mesh(path, vertices, triangles, steps_per_post=1):
    """A mesh in posts from the south-west one, as the evaluator reads it."""
    import numpy

    vertices, triangles = numpy.asarray(vertices, "<f8"), numpy.asarray(triangles, "<u4")
    head = struct.pack("<8sIII", b"MESHPOST", steps_per_post, len(vertices), len(triangles))
    path.write_bytes(head + vertices.tobytes() + triangles.tobytes())


def evaluate(mesh, heights, spacing_m, *options):
    """What the evaluator says of a mesh file, as a dictionary."""
    ran = run(compiled("evaluate"), mesh, heights, *spacing_m, *options)
    if ran["code"] not in (0, 1):
        sys.exit(f"the evaluator cannot read {mesh}: {why(ran)}")
    return json.loads(ran["out"])


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


@contextlib.contextmanager
def scratch(name):
    """A folder for one thing at a time, gone afterwards: a database of a large area is not small."""
    path = FOLDER / name
    shutil.rmtree(path, ignore_errors=True)
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


# --- tables ---


def faults(judged):
    """`yes`, or what is wrong with a surface: the first few of its faults."""
    if judged["valid"]:
        return "yes"
    found = [f"{count} {name.replace('_', ' ')}" for name, count in judged["faults"].items() if count]
    return "NO: " + ", ".join(found[:2]) + (f", {len(found) - 2} more kinds" if 2 < len(found) else "")


def number(value, digits):
    return "" if value is None else f"{value:,.{digits}f}"


def ratio(value, of, digits=3):
    return "" if value is None or not of else f"{value / of:.{digits}f}"


def markdown(title, head, rows):
    """A table as Markdown, padded so that it can be read as it is."""
    cells = [[str(cell) for cell in row] for row in [head, *rows]]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    padded = [
        "| " + " | ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:]))]) + " |"
        for row in cells
    ]
    rule = "| " + " | ".join(["-" * widths[0], *("-" * (w - 1) + ":" for w in widths[1:])]) + " |"
    print("\n".join([f"\n### {title}\n", padded[0], rule, *padded[1:]]), flush=True)


def put(page, name, text):
    """Replaces the figures of that name on a page; `text` is Markdown."""
    places = re.compile(rf"(<!-- figures: {re.escape(name)}, [^\n]*-->\n).*?(<!-- end of figures -->)", re.DOTALL)
    after, count = places.subn(lambda found: f"{found[1]}\n{text.strip()}\n\n{found[2]}", page.read_text())
    assert count == 1, f"{page}: found {count} places for the figures {name}, expected one"
    page.write_text(after)
