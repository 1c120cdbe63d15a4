"""What the program needs as an area grows, and how fast a database answers a simulator, over HTTP and from Python."""

import array
import http.client
import itertools
import json
import os
import pathlib
import random
import re
import resource
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from benches.common import FIGURES, ROOT, load, parser_of, program, put

SIZE_JOB = """[area]
name = "size"
crs = "EPSG:32611"
origin_m = [505000, 3875000]
size_m = [{wide}, {high}]
spacing_m = {spacing}
[dem]
{dem}
[tiles]
columns = {columns}
rows = {rows}
[tin]
{tin}
"""

SIZE_HEAD = """| source | posts | tiles | load modules | cpu a tile | memory | disk |
| - | -: | -: | -: | -: | -: | -: |"""


def used(command):
    """Seconds, peak memory in megabytes and processor seconds of a command; its output when it fails."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.monotonic() - start
    if status not in (0, 256):
        sys.exit(f"{' '.join(map(str, command))}\n{output}")
    return seconds, usage.ru_maxrss / 1024, usage.ru_utime + usage.ru_stime


def sized(arguments, folder, posts, source):
    """Builds one job; a line of the table, and whether every forecast was near enough."""
    tiefort, rows = program(arguments), arguments.rows or posts
    side = 500 // arguments.spacing
    modules = [(posts - 1) // side, (rows - 1) // side]
    tiles = [max(1, round(count / 17)) for count in modules]
    dem = 'source = "sample"'
    if source == "raster":
        path = folder / f"dem{posts}.tif"
        if not path.exists():
            used([tiefort, "sample", "--posts", str(posts), "--rows", str(rows), "--spacing", str(arguments.spacing),
                 "--out", path])
        dem = f'sources = ["{path.name}"]'
    job, database = folder / f"{source}{posts}.toml", folder / f"{source}{posts}.tdb"
    job.write_text(SIZE_JOB.format(wide=modules[0] * 500, high=modules[1] * 500, dem=dem, columns=tiles[0],
                                   rows=tiles[1], tin=arguments.tin, spacing=arguments.spacing))
    plan = json.loads(subprocess.check_output([tiefort, "plan", job, "--emit", "json"]))["forecast"]
    _, memory, cpu = used([tiefort, "build", job, "--out", database, "--workers", "2", "--fresh", "--quiet"])
    count = tiles[0] * tiles[1]
    disk = sum(path.stat().st_size for path in database.rglob("*") if path.is_file()) / 2**20
    ratios = [plan["seconds"] / cpu, plan["memory_bytes"] / 2**20 / memory, plan["disk_bytes"] / 2**20 / disk]
    row = (f"| {source} | {posts:,} x {rows:,} | {count:,} | {modules[0] * modules[1]:,} "
           f"| {1000 * cpu / count:.0f} ms ({ratios[0]:.2f}) | {memory:.0f} MB ({ratios[1]:.2f}) "
           f"| {disk:.0f} MB ({ratios[2]:.2f}) |")
    print(row, flush=True)
    return row, all(1 / 1.5 <= ratio <= 1.5 for ratio in ratios)


def size():
    """Does memory stay bounded, and the time of a tile the same, however large the area is?

        cargo build --release
        scripts/bench.py size [--widths 2501,10001,40001] [--rows 681] [--tin 'method = "greedy"']
        scripts/bench.py size --widths 5001,10001,20001 --rows 0 --sources sample --tin 'method = "optimised"'

    For each width a raster of so many posts from west to east is made by `tiefort sample`, and a job over it is built
    with two workers: once from the raster, at 25 m, and once from the sample terrain itself. With `--rows 0` areas are
    as high as they are wide. Tiles are 17 load modules a side (340 posts), as in the founding paper. Printed are
    processor time of a tile, the peak of the memory that the process held, the size of the database, and in brackets
    what `plan` said of each, over what it came to: between 0.67 and 1.5 is what the project asks for. Exit code 1 when
    one lies outside.

    With `--spacing 125` an area of 1000 km on a side has the tiles and load modules of 40,001 x 40,001 posts at 25 m,
    and a twenty-fifth of its posts: what grows with the area, without the time for its heights.
    """
    parser = parser_of(size)
    parser.add_argument("--widths", default="2501,10001,40001")
    parser.add_argument("--rows", type=int, default=681)
    parser.add_argument("--spacing", type=int, default=25)
    parser.add_argument("--tin", default='method = "greedy"')
    parser.add_argument("--sources", default="sample,raster")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--book", action="store_true", help="also put the table into the book")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.keep or pathlib.Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        print(SIZE_HEAD)
        cases = itertools.product(arguments.sources.split(","), map(int, arguments.widths.split(",")))
        measured = [sized(arguments, folder, posts, source) for source, posts in cases]
    if arguments.book:
        put(FIGURES, "size", "\n".join([SIZE_HEAD, *(row for row, _ in measured)]))
    sys.exit(0 if all(is_near for _, is_near in measured) else 1)


# --- the reader for simulators ---


HEIGHTS_MILLION_MIN = 5.0
BLOCK_MS_MAX = 5.0


def reader():
    """How fast the reader for simulators answers, against what the project asks of it.

        scripts/bench.py reader [DIR] [--queries N]

    DIR is a terrain database; without it the 50 km of configs/ntc.toml are built in a scratch folder first.
    Exit code 1 when a bar is missed. Run it on a quiet machine: heights at random places wait for memory.
    """
    parser = parser_of(reader)
    parser.add_argument("database", nargs="?")
    parser.add_argument("--queries", type=int, default=5_000_000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        database = arguments.database
        if not database:
            database = str(pathlib.Path(scratch) / "ntc.tdb")
            cargo("run", "--release", "--", "build", "configs/ntc.toml", "--out", database, "--quiet")
        database = str(pathlib.Path(database).resolve())
        run = ["run", "--release", "--quiet", "-p", "load-module-reader", "--example", "bench", "--"]
        text = cargo(*run, database, str(arguments.queries)).stdout
    print(text, end="")
    missed = 0
    for line in text.splitlines():
        heights = re.match(r"heights, (.*): ([\d.]+) million a second on one core, ([\d.]+) many at once", line)
        if heights:
            best = max(float(heights[2]), float(heights[3]))
            missed += bar(HEIGHTS_MILLION_MIN <= best, f"heights, {heights[1]}: {best} million, at least 5")
        block = re.match(r"block of 15 x 15: .*median ([\d.]+)", line)
        if block:
            median = float(block[1])
            missed += bar(median < BLOCK_MS_MAX, f"block of 15 x 15 in {median} ms at the median, below 5")
    sys.exit(1 if missed else 0)


def cargo(*words):
    return subprocess.run(["cargo", *words], cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE)


def bar(met, what):
    print(f"{'met   ' if met else 'MISSED'} {what}")
    return not met


# --- the service ---


COUNT = 10_000


def resident_mib(pid):
    """Memory of a process in MiB."""
    with open(f"/proc/{pid}/status", encoding="ascii") as status:
        line = next(line for line in status if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


class Service:
    def __init__(self, program, database):
        words = [program, "serve", database, "--port", "0", "--assume-datum", "EGM96"]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.host = self.process.stdout.readline().strip().removeprefix("http://").rstrip("/")
        self.connection = http.client.HTTPConnection(self.host)

    def ask(self, method, path, body=None, kind="application/json", connection=None):
        connection = connection or self.connection
        connection.request(method, path, body, {"Content-Type": kind} if body else {})
        response = connection.getresponse()
        return response.status, response.read()

    def memory(self):
        return resident_mib(self.process.pid)

    def end(self):
        start = time.perf_counter()
        self.process.send_signal(signal.SIGINT)
        self.process.wait()
        return time.perf_counter() - start


def timed(times, act):
    """Milliseconds of each of some calls."""
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        act()
        spent.append(1000 * (time.perf_counter() - start))
    return spent


def told(what, spent):
    print(f"{what}: median {statistics.median(spent):.1f} ms, first {spent[0]:.1f}, worst {max(spent):.1f}")
    return statistics.median(spent)


def heights(service, area):
    random.seed(1)
    low, size = area["origin_m"], area["size_m"]
    places = [[low[axis] + random.random() * size[axis] for axis in (0, 1)] for _ in range(COUNT)]
    text = json.dumps({"positions": places})
    raw = array.array("d", [metres for place in places for metres in place]).tobytes()

    def asked(body, kind):
        status, answer = service.ask("POST", "/heights", body, kind)
        assert status == 200, answer[:500]
        return answer

    kinds = ("application/json", "application/octet-stream")
    medians = []
    for body, kind in zip((text, raw), kinds):
        medians.append(told(f"{COUNT} heights as {kind}", timed(50, lambda: asked(body, kind))))
    found = json.loads(asked(text, kinds[0]))["heights"]
    assert array.array("d", asked(raw, kinds[1])).tolist() == found, "JSON and raw numbers differ"
    lines = array.array("d")
    for one, other, low, high in zip(places, places[1:], found, found[1:]):
        far = [one[axis] + max(-5000, min(5000, other[axis] - one[axis])) for axis in (0, 1)]
        lines.extend([*one, low + 5, *far, high + 5])
        if len(lines) == 6 * 1000:
            break
    body = lines.tobytes()
    looks = timed(20, lambda: service.ask("POST", "/line-of-sight", body, kinds[1]))
    told("1000 lines of sight of up to 7 km as raw numbers", looks)
    return max(medians), raw


def tiles(service):
    """What a globe asks for first, and every tile of the finest level."""
    told("layer.json", timed(3, lambda: service.ask("GET", "/layer.json")))
    told("tileset.json", timed(3, lambda: service.ask("GET", "/tileset.json")))
    layer = json.loads(service.ask("GET", "/layer.json")[1])
    level, [range_] = layer["maxzoom"], layer["available"][-1]
    names = [
        f"/{level}/{col}/{row}.terrain"
        for col in range(range_["startX"], range_["endX"] + 1)
        for row in range(range_["startY"], range_["endY"] + 1)
    ]
    spent = [timed(1, lambda: service.ask("GET", name))[0] for name in names]
    told(f"{len(names)} tiles of level {level}, each", spent)
    return names


def stream(service, raw, names, gigabytes):
    """Requests until so much was sent and received; memory before and after."""
    warm = 2 * len(names)
    sent = asked = 0
    before = None
    start = time.perf_counter()
    while sent < gigabytes * 2**30:
        name = names[asked % len(names)]
        for method, path, body in (("POST", "/heights", raw), ("GET", name, None), ("GET", "/modules", None)):
            status, answer = service.ask(method, path, body, "application/octet-stream")
            assert status == 200, (path, answer[:200])
            sent += len(body or b"") + len(answer)
        asked += 1
        if asked == warm:
            before, sent, start = service.memory(), 0, time.perf_counter()
    after = service.memory()
    seconds = time.perf_counter() - start
    print(f"{gigabytes} GB of requests in {seconds:.0f} s ({3 * (asked - warm)} requests): "
          f"memory {before:.0f} MiB before, {after:.0f} MiB after")
    return after - before


def crowd(service, count):
    """Clients that connect and send half a request."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    host, port = service.host.rsplit(":", 1)
    clients = []
    before = service.memory()
    start = time.perf_counter()
    for _ in range(count):
        try:
            client = socket.create_connection((host, int(port)), timeout=10)
            client.sendall(b"GET / HTTP/1.1\r\nHost: ")
            clients.append(client)
        except OSError:
            break
    spent = time.perf_counter() - start
    other = http.client.HTTPConnection(service.host, timeout=30)
    answer = timed(1, lambda: service.ask("GET", "/databases.json", connection=other))
    print(f"{len(clients)} connections in {spent:.1f} s: another is answered after {answer[0]:.0f} ms, "
          f"memory {before:.0f} to {service.memory():.0f} MiB")
    for client in clients:
        client.close()
    return answer[0] < 2000


def large_body(service):
    """A body of 1 GB, told before and sent without being told."""
    host, port = service.host.rsplit(":", 1)
    before = service.memory()
    for head in (b"Content-Length: 1073741824", b"Transfer-Encoding: chunked"):
        with socket.create_connection((host, int(port)), timeout=30) as client:
            client.sendall(b"POST /heights HTTP/1.1\r\nHost: " + service.host.encode() + b"\r\n" + head + b"\r\n\r\n")
            sent = 0
            piece = b"100000\r\n" + bytes(2**20) + b"\r\n"
            try:
                while sent < 2**30:
                    client.sendall(piece)
                    sent += len(piece)
            except OSError:
                pass
            try:
                answer = client.recv(64).split(b"\r\n")[0].decode()
            except OSError:
                answer = "connection ended"
            print(f"1 GB as {head.decode()}: {answer or 'connection ended'} after {sent / 2**20:.0f} MiB, "
                  f"memory {before:.0f} to {service.memory():.0f} MiB")


def serve():
    """Measures `tiefort serve` on loopback: 10,000 heights, a stream of requests, memory, 10,000 connections, large
    bodies.

        scripts/bench.py serve DATABASE [--gigabytes 2] [--connections 10000]

    Needs Python 3.9 and nothing else. Ends with 1 when heights take 20 ms or more, when memory grows by more than 64
    MiB over the stream, or when the service does not answer beside clients that only connect.
    """
    parser = parser_of(serve)
    parser.add_argument("database")
    parser.add_argument("--gigabytes", type=float, default=2)
    parser.add_argument("--connections", type=int, default=10_000)
    arguments = parser.parse_args()
    service = Service(program(arguments), arguments.database)
    faults = []
    try:
        area = json.loads(service.ask("GET", "/databases.json")[1])["databases"][0]
        print(f"{area['load_modules'][0]} x {area['load_modules'][1]} load modules, {area['triangles']} triangles; "
              f"memory {service.memory():.0f} MiB at the start")
        slowest, raw = heights(service, area)
        print(f"memory {service.memory():.0f} MiB with all load modules held")
        if 20 <= slowest:
            faults.append(f"{COUNT} heights take {slowest:.1f} ms")
        names = tiles(service)
        print(f"memory {service.memory():.0f} MiB with the area on the globe")
        grown = stream(service, raw, names, arguments.gigabytes)
        if 64 < grown:
            faults.append(f"memory grew by {grown:.0f} MiB")
        large_body(service)
        if not crowd(service, arguments.connections):
            faults.append("no answer beside a crowd")
        print(f"SIGINT ends it after {service.end():.2f} s")
    finally:
        service.process.kill()
    for fault in faults:
        print(f"WRONG {fault}")
    return 1 if faults else 0


# --- the Python package ---


def fastest(rounds, work, clock=time.perf_counter):
    """Seconds of the fastest of some rounds."""
    times = []
    for _ in range(rounds):
        start = clock()
        work()
        times.append(clock() - start)
    return min(times)


def hills(posts, seed):
    """Hills of many sizes."""
    import numpy as np

    rng = np.random.default_rng(seed)
    row, col = np.mgrid[0:posts, 0:posts].astype(np.float32)
    heights = np.zeros((posts, posts), np.float32)
    for octave in range(7):
        scale = 400 / 2**octave
        a, b, c, d = rng.uniform(0, 7, 4)
        heights += scale / 4 * np.sin(row / scale + a + np.sin(col / scale + b)) * np.cos(col / scale + c + d)
    return heights


def bar_told(name, found, bar, met):
    """Print one figure."""
    print(f"{name:<44}{found:>14}{bar:>18}  {'met' if met else 'MISSED'}")


def meshes(rounds, posts):
    """Time what Python adds, and two threads."""
    import tiefort

    pair = [hills(posts, seed) for seed in (1, 2)]
    points = posts * posts // 50
    ratios = []
    for _ in range(rounds):
        start = time.perf_counter()
        mesh = tiefort.tin(pair[0], triangles=2 * points, spacing_m=25.0, workers=1)
        ratios.append((time.perf_counter() - start) / mesh.seconds)
    bar_told(
        f"array of {posts} x {posts} to mesh, over the library",
        f"{min(ratios):.3f}",
        "at most 1.05",
        min(ratios) <= 1.05,
    )

    def one(dem):
        tiefort.tin(dem, triangles=2 * points, spacing_m=25.0, workers=1)

    def both():
        threads = [threading.Thread(target=one, args=(dem,)) for dem in pair]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    alone = fastest(rounds, lambda: [one(dem) for dem in pair])
    together = fastest(rounds, both)
    cpu = [time.process_time()]
    for work in (lambda: [one(dem) for dem in pair], both):
        work()
        cpu.append(time.process_time())
    print(f"  two threads take {(cpu[2] - cpu[1]) / (cpu[1] - cpu[0]):.2f} times the processor time of one")
    bar_told("two threads on two arrays, over one", f"{alone / together:.2f}", "at least 1.7", 1.7 <= alone / together)


def questions(rounds, database):
    """Time heights and lines of sight."""
    import numpy as np

    west, south, east, north = database.bounds
    rng = np.random.default_rng(1)
    million = 1_000_000
    along = np.linspace(0, 60, million)
    drive = np.column_stack(
        (
            (west + east) / 2 + 0.4 * (east - west) * np.sin(along),
            (south + north) / 2 + 0.4 * (north - south) * np.sin(1.3 * along),
        )
    )
    random = np.column_stack((rng.uniform(west, east, million), rng.uniform(south, north, million)))
    database.heights(random[:10])
    for name, places, bar in (("along a drive", drive, 0.15), ("at random places", random, 0.25)):
        seconds = fastest(rounds, lambda places=places: database.heights(places), time.process_time)
        bar_told(f"a million heights {name}", f"{seconds:.3f} s", f"under {bar} s", seconds < bar)
    count = 50_000
    eyes = random[:count]
    angle, reach = rng.uniform(0, 2 * np.pi, count), rng.uniform(100, 4000, count)
    targets = eyes + np.column_stack((np.cos(angle), np.sin(angle))) * reach[:, None]
    targets = np.clip(targets, (west, south), (east, north))
    a, b = (np.column_stack((ends, database.heights(ends) + 2.5)) for ends in (eyes, targets))
    for name, ask in (("visible or not", database.visible), ("with clearance", database.line_of_sight)):
        a_second = count / fastest(rounds, lambda ask=ask: ask(a, b, absolute=True), time.process_time)
        bar_told(f"lines of sight to 4 km, {name}", f"{a_second:,.0f} a s", "at least 50,000", 50_000 <= a_second)


def python():
    """Times the Python package that is installed: what it adds to the library, two threads, heights and lines of sight.

        python scripts/bench.py python [--rounds N] [--posts N] [--database DIR]

    Of each figure the best of N rounds is told beside what the project asks of itself. Questions to a database take
    one core: they are told in seconds of its processor time, which other programs disturb less. Without --database the
    sample terrain is built, 40 km on a side.
    """
    import tiefort

    parser = parser_of(python)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--posts", type=int, default=1500)
    parser.add_argument("--database")
    words = parser.parse_args()
    print(f"{os.cpu_count()} cores, load before {load()}")
    meshes(words.rounds, words.posts)
    with tempfile.TemporaryDirectory() as folder:
        path = words.database
        if path is None:
            path = f"{folder}/bench.tdb"
            area = {
                "name": "bench",
                "crs": "EPSG:32611",
                "origin_m": [505_000, 3_875_000],
                "size_m": [40_000, 40_000],
                "spacing_m": 25,
            }
            report = tiefort.build({"area": area, "dem": {"source": "sample"}}, path, html=False)
            print(f"{report} built in {sum(report.seconds.values()):.1f} s")
        with tiefort.open(path) as database:
            questions(words.rounds, database)
