"""What a person would pick instead of `tiefort tin`: other programs at as many triangles, judged by one evaluator."""

import dataclasses
import json
import os
import pathlib
import platform
import shutil
import subprocess
import time

from benches import areas
from benches.common import (FOLDER, ROOT, compiled, evaluate, faults, lindstrom_turk, load, markdown, parser_of,
                            prepare_venv, program, put, run, skip, tell, why, write_mesh)

BENCHMARK = ROOT / "docs" / "figures" / "benchmark.md"
PACKAGES = ["meshoptimizer==0.2.30a0", "pyfqmr==0.5.0"]
MARTINI = "@mapbox/martini@0.2.0"
# Name, raster, part of it (columns and rows from the north-west, then their number), triangles, what it is.
GROUNDS = [
    ("mackay", "dem/mackay_idaho_738x919_30m_utm12n.tif", (113, 203, 513, 513), 9_868,
     "Lost River Range, Idaho: 513 x 513 posts of 30 m, public domain"),
    ("desert", "ntc_scape/ntc_1024x1024_25m_assumed.tif", (481, 0, 513, 513), 9_868,
     "Basin and range of the Mojave: 513 x 513 posts of 25 m, public domain"),
    ("alps-1979", "ntc_standin/bavarian_alps_50km_1979x1979_utm32n.tif", None, 152_000,
     "Bavarian Alps: 1979 x 1979 posts of 25.27 m, free with attribution"),
]
# Of this ground four rows stand on README, and of these programs.
README_GROUND = "alps-1979"
README_ROWS = ["tiefort, normal", "tiefort, fast", "meshoptimizer", "greedy insertion (pydelatin)"]
HEAD = ["program", "triangles", "RMS m", "largest m", "seconds", "processor s", "no fold, no gap"]
# Vertices that a program moves off the posts are rounded to these steps of a post.
STEPS = 65_536
MARTINI_JS = """
import Martini from "@mapbox/martini";
import { readFileSync, writeFileSync } from "node:fs";
const [file, out, most] = process.argv.slice(2), data = readFileSync(file);
const side = data.readUInt32LE(0), heights = new Float32Array(data.buffer.slice(data.byteOffset + 8));
const martini = new Martini(side);
const tile = martini.createTile(heights);
// The error that leaves at most so many triangles, by halving; only the last two steps are timed.
let [low, high] = [0, 4096];
for (let turn = 0; turn < 40; turn++) {
  const middle = (low + high) / 2;
  if (tile.getMesh(middle).triangles.length / 3 <= Number(most)) high = middle;
  else low = middle;
}
const start = performance.now();
const mesh = martini.createTile(heights).getMesh(high);
const seconds = (performance.now() - start) / 1000;
const counts = Buffer.alloc(8);
counts.writeUInt32LE(mesh.vertices.length / 2, 0);
counts.writeUInt32LE(mesh.triangles.length / 3, 4);
const bytes = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength);
writeFileSync(out, Buffer.concat([counts, bytes(mesh.vertices), bytes(mesh.triangles)]));
console.log(JSON.stringify({ seconds }));
"""


@dataclasses.dataclass
class Ground:
    """A raster: heights with rows from the south; files of it; triangles to come to."""

    name: str
    heights: object
    spacing_m: tuple
    dem: pathlib.Path
    raw: pathlib.Path
    triangles: int

    def grid(self):
        """Every post as a vertex in posts, and two counter-clockwise triangles a cell."""
        import numpy

        rows, columns = self.heights.shape
        y, x = numpy.mgrid[0:rows, 0:columns]
        vertices = numpy.column_stack([x.ravel(), y.ravel(), self.heights.ravel()]).astype("f4")
        a = (y[:-1, :-1] * columns + x[:-1, :-1]).ravel()
        b, c, d = a + 1, a + columns + 1, a + columns
        return vertices, numpy.concatenate([numpy.column_stack(each) for each in [(a, b, c), (a, c, d)]]).astype("u4")

    def in_metres(self, vertices):
        import numpy

        return vertices * numpy.array([*self.spacing_m, 1], vertices.dtype)

    def in_posts(self, vertices):
        import numpy

        return numpy.asarray(vertices, "f8") / [*self.spacing_m, 1]


# --- programs: each gives seconds, seconds of all cores, vertices in posts, and triangles; or says why not ---


def timed(work):
    """What a call gives, its seconds, and those of all cores."""
    start, cpu = time.perf_counter(), time.process_time()
    found = work()
    return found, time.perf_counter() - start, time.process_time() - cpu


def regular_grid(ground):
    """Every so many posts, as many lines as fit."""
    import numpy

    def work():
        rows, columns = ground.heights.shape
        cells = ((ground.triangles / 2) / ((rows - 1) * (columns - 1))) ** 0.5
        lines = [numpy.rint(numpy.linspace(0, posts - 1, int((posts - 1) * cells) + 1)).astype(int)
                 for posts in (rows, columns)]
        return lines, ground.heights[numpy.ix_(*lines)]

    (lines, heights), seconds, cpu = timed(work)
    y, x = numpy.meshgrid(*lines, indexing="ij")
    _, triangles = dataclasses.replace(ground, heights=heights).grid()
    return seconds, cpu, numpy.column_stack([x.ravel(), y.ravel(), heights.ravel()]), triangles


def greedy(ground):
    """`pydelatin`: insertion of the worst post, as hmm does. A first run tells how many points give the triangles."""
    from pydelatin import Delatin

    heights, points = ground.heights[::-1].copy(), ground.triangles // 2
    points += (ground.triangles - len(Delatin(heights, max_points=points, max_error=0).triangles)) // 2
    mesh, seconds, cpu = timed(lambda: Delatin(heights, max_points=points, max_error=0))
    return seconds, cpu, mesh.vertices, mesh.triangles


def meshoptimizer(ground):
    """`meshopt_simplify` of the triangles between all posts, without a bound for the error."""
    import meshoptimizer as library
    import numpy

    vertices, triangles = ground.grid()
    metres, corners, kept = ground.in_metres(vertices), triangles.ravel(), numpy.zeros(triangles.size, "u4")

    def work():
        return library.simplify(kept, corners, metres, target_index_count=3 * ground.triangles, target_error=1e9)

    count, seconds, cpu = timed(work)
    return seconds, cpu, *used(vertices, kept[:count].reshape(-1, 3))


def quadric(ground):
    """`pyfqmr`: fast quadric collapse with the border kept."""
    import pyfqmr

    vertices, triangles = ground.grid()
    metres = ground.in_metres(vertices)

    def work():
        mesh = pyfqmr.Simplify()
        mesh.setMesh(metres, triangles)
        mesh.simplify_mesh(target_count=ground.triangles, aggressiveness=7, preserve_border=True, verbose=False)
        return mesh.getMesh()

    (found, corners, _), seconds, cpu = timed(work)
    return seconds, cpu, *used(ground.in_posts(found), corners)


def rtin(ground):
    """Right-angled triangles, halved where the error asks for it: Mapbox's martini, in Node."""
    import numpy

    rows, columns = ground.heights.shape
    if rows != columns or (rows - 1) & (rows - 2):
        return "needs 2^n + 1 posts a side"
    folder, out = FOLDER / "martini", FOLDER / "martini.bin"
    if not shutil.which("npm"):
        return "no npm"
    if not (folder / "node_modules" / "@mapbox").exists():
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(["npm", "install", "--silent", "--no-progress", "--prefix", folder, MARTINI], check=True)
    script = folder / "martini.mjs"
    script.write_text(MARTINI_JS)
    ran = run("node", script, ground.raw, out, ground.triangles)
    if ran["code"] != 0:
        return why(ran)
    data, seconds = out.read_bytes(), json.loads(ran["out"])["seconds"]
    count, faces = numpy.frombuffer(data, "<u4", 2)
    places = numpy.frombuffer(data, "<u2", 2 * count, 8).reshape(-1, 2).astype(int)
    corners = numpy.frombuffer(data, "<u4", 3 * faces, 8 + 4 * count).reshape(-1, 3)
    vertices = numpy.column_stack([places, ground.heights[places[:, 1], places[:, 0]]])
    return seconds, seconds, *counter_clockwise(vertices, corners)


def collapse(ground):
    """CGAL's edge collapse by Lindstrom and Turk, through a driver that is compiled here."""
    driver = lindstrom_turk()
    if not driver:
        return "no CGAL"
    out = FOLDER / "collapse.mesh"
    ran = run(driver, ground.raw, *ground.spacing_m, ground.triangles, out)
    if ran["code"] != 0:
        return why(ran)
    return json.loads(ran["out"])["seconds"], ran["cpu_s"], out


def ours(effort):
    """The whole process of `tiefort tin`, reading and writing included, on all cores."""
    def made(ground):
        out = FOLDER / "peers.ply"
        ran = run(ground.tiefort, "tin", ground.dem, "--triangles", ground.triangles, "--effort", effort, "--out", out)
        return (ran["wall_s"], ran["cpu_s"], out) if ran["code"] == 0 else why(ran)
    return made


def used(vertices, triangles):
    """A mesh without the vertices that no triangle has."""
    import numpy

    kept, corners = numpy.unique(triangles, return_inverse=True)
    return vertices[kept], corners.reshape(-1, 3)


def counter_clockwise(vertices, triangles):
    """The triangles, each turned so that it is seen from above."""
    import numpy

    a, b, c = (vertices[triangles[:, at], :2] for at in range(3))
    (x1, y1), (x2, y2) = (b - a).T, (c - a).T
    return vertices, numpy.where((x1 * y2 < x2 * y1)[:, None], triangles[:, ::-1], triangles)


PEERS = {
    "tiefort, normal": ours("normal"), "tiefort, fast": ours("fast"), "edge collapse (CGAL)": collapse,
    "meshoptimizer": meshoptimizer, "quadric collapse (pyfqmr)": quadric, "greedy insertion (pydelatin)": greedy,
    "RTIN (martini)": rtin, "regular grid": regular_grid,
}
# Slow on large rasters: once is enough, and the slowest takes minutes and a gigabyte.
SLOW_POSTS = 1_000_000
SLOWEST = "edge collapse (CGAL)"
SLOW = {SLOWEST, "quadric collapse (pyfqmr)"}


# --- the table ---


def measured(ground, rounds, large):
    """The best of some rounds of each program, in turn, with what the evaluator says of its surface."""
    found = {}
    for turn in range(rounds):
        for name, peer in PEERS.items():
            earlier = found.get(name)
            is_slow = SLOW_POSTS < ground.heights.size
            if earlier and ("skipped" in earlier or is_slow and name in SLOW):
                continue
            tell(f"{ground.name}, round {turn + 1} of {rounds}: {name}")
            made = "minutes: --large" if is_slow and name == SLOWEST and not large else peer(ground)
            if isinstance(made, str):
                skip(f"{ground.name}, {name}", made)
                found[name] = {"skipped": made}
                continue
            seconds, cpu, *mesh = made
            if earlier:
                earlier["seconds"], earlier["cpu"] = min(earlier["seconds"], seconds), min(earlier["cpu"], cpu)
                continue
            path = mesh[0]
            if len(mesh) == 2:
                path = FOLDER / "peers.mesh"
                write_mesh(path, *mesh, steps_per_post=STEPS)
            judged = evaluate(path, ground.raw, ground.spacing_m, "--sight-lines", 0)
            found[name] = {"seconds": seconds, "cpu": cpu, "judged": judged}
    return found


def row(name, found):
    if "skipped" in found:
        return [name, found["skipped"], "", "", "", "", ""]
    judged = found["judged"]
    return [name, f"{judged['triangles']:,}", f"{judged['rms_m']:.3f}", f"{judged['max_m']:.1f}",
            f"{found['seconds']:.2f}", f"{found['cpu']:.2f}", faults(judged).split(",")[0]]


def table(head, rows):
    lines = [head, ["-", *["-:"] * (len(head) - 2), "-" if head is HEAD else "-:"], *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def machine(loads):
    """One line on what was measured where."""
    told = pathlib.Path("/proc/cpuinfo")
    lines = told.read_text().splitlines() if told.exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")] or [platform.machine()]
    is_busy = 0.5 < float(loads.split(",")[0])
    state = "was busy: compare seconds with each other, not with other machines" if is_busy else "was idle"
    return f"{os.cpu_count()} cores, {names[0]}, load {loads} before: the machine {state}."


def peers():
    """What a person would pick instead of `tiefort tin`, at as many triangles, on ground that anyone may have.

        scripts/bench.py peers                    all grounds, three rounds
        scripts/bench.py peers --only mackay      one ground
        scripts/bench.py peers --rounds 1         quicker
        scripts/bench.py peers --large            CGAL's collapse of the large raster, too: minutes, a gigabyte
        scripts/bench.py peers --book             put the tables into the book, and four rows into README

    Programs take turns, round by round, and the least of each counts. Seconds are from heights in memory to the mesh;
    ours are those of the whole process, reading and writing included, on all cores. Every surface is judged at every
    post by scripts/benches/evaluate.cpp, which shares no code with the compiler. What is missing is skipped with a
    word. To add a row, write a function that takes a Ground and gives seconds, seconds of all cores, vertices in posts
    from the south-west one and triangles, and name it in PEERS.
    """
    parser = parser_of(peers)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", metavar="NAME", help="the ground of this name")
    parser.add_argument("--large", action="store_true", help="CGAL on large rasters, too")
    parser.add_argument("--book", action="store_true")
    options = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare_venv(*PACKAGES)
    if not compiled("evaluate"):
        return "without its evaluator this bench has nothing to say"
    before, text = load(), ""
    for name, file, window, triangles, told in GROUNDS:
        if options.only not in (None, name):
            continue
        for given in areas.found(name, file, (triangles,), window):
            ground = Ground(name, given.heights, given.spacing_m, given.dem, given.raw, triangles)
            ground.tiefort = program(options)
            found = measured(ground, options.rounds, options.large)
            rows = [row(peer, found[peer]) for peer in PEERS]
            markdown(told, HEAD, rows)
            text += f"### {told}\n\n{table(HEAD, rows)}\n"
            if options.book and name == README_GROUND:
                put(ROOT / "README.md", "peers", readme(given, found))
    print(f"\n{machine(before)}")
    if options.book and text:
        put(BENCHMARK, "peers", f"{machine(before)}\n\n{text}")
    return 0


def readme(given, found):
    rows, columns = given.heights.shape
    triangles = found["tiefort, normal"]["judged"]["triangles"]
    lines = [[name, f"{found[name]['judged']['rms_m']:.2f} m", f"{found[name]['cpu']:.1f} s"]
             for name in README_ROWS if "judged" in found[name]]
    head = f"{columns} x {rows} posts of the Alps, {triangles:,} triangles"
    return table([head, "RMS residual", "processor time"], lines)
