#!/usr/bin/env python3
"""Times the Python package that is installed: what it adds to the library, two threads, heights and lines of sight.

usage: bench_python.py [--rounds N] [--posts N] [--database DIR]

Of each figure the best of N rounds is told beside what the project asks of itself. Questions to a database take one
core: they are told in seconds of its processor time, which other programs disturb less. Without --database the sample
terrain is built, 40 km on a side.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import threading
import time
from collections.abc import Callable

import numpy as np
import tiefort


def best(rounds: int, work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Seconds of the fastest of some rounds."""
    times = []
    for _ in range(rounds):
        start = clock()
        work()
        times.append(clock() - start)
    return min(times)


def ground(posts: int, seed: int) -> np.ndarray:
    """Hills of many sizes."""
    rng = np.random.default_rng(seed)
    row, col = np.mgrid[0:posts, 0:posts].astype(np.float32)
    heights = np.zeros((posts, posts), np.float32)
    for octave in range(7):
        scale = 400 / 2**octave
        a, b, c, d = rng.uniform(0, 7, 4)
        heights += scale / 4 * np.sin(row / scale + a + np.sin(col / scale + b)) * np.cos(col / scale + c + d)
    return heights


def tell(name: str, found: str, bar: str, met: bool) -> None:
    """Print one figure."""
    print(f"{name:<44}{found:>14}{bar:>18}  {'met' if met else 'MISSED'}")


def meshes(rounds: int, posts: int) -> None:
    """Time what Python adds, and two threads."""
    pair = [ground(posts, seed) for seed in (1, 2)]
    points = posts * posts // 50
    ratios = []
    for _ in range(rounds):
        start = time.perf_counter()
        mesh = tiefort.tin(pair[0], triangles=2 * points, spacing_m=25.0, workers=1)
        ratios.append((time.perf_counter() - start) / mesh.seconds)
    tell(
        f"array of {posts} x {posts} to mesh, over the library",
        f"{min(ratios):.3f}",
        "at most 1.05",
        min(ratios) <= 1.05,
    )

    def one(dem: np.ndarray) -> None:
        tiefort.tin(dem, triangles=2 * points, spacing_m=25.0, workers=1)

    def both() -> None:
        threads = [threading.Thread(target=one, args=(dem,)) for dem in pair]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    alone = best(rounds, lambda: [one(dem) for dem in pair])
    together = best(rounds, both)
    cpu = [time.process_time()]
    for work in (lambda: [one(dem) for dem in pair], both):
        work()
        cpu.append(time.process_time())
    print(f"  two threads take {(cpu[2] - cpu[1]) / (cpu[1] - cpu[0]):.2f} times the processor time of one")
    tell("two threads on two arrays, over one", f"{alone / together:.2f}", "at least 1.7", 1.7 <= alone / together)


def questions(rounds: int, database: tiefort.Database) -> None:
    """Time heights and lines of sight."""
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
        seconds = best(rounds, lambda places=places: database.heights(places), time.process_time)
        tell(f"a million heights {name}", f"{seconds:.3f} s", f"under {bar} s", seconds < bar)
    count = 50_000
    eyes = random[:count]
    angle, reach = rng.uniform(0, 2 * np.pi, count), rng.uniform(100, 4000, count)
    targets = eyes + np.column_stack((np.cos(angle), np.sin(angle))) * reach[:, None]
    targets = np.clip(targets, (west, south), (east, north))
    a, b = (np.column_stack((ends, database.heights(ends) + 2.5)) for ends in (eyes, targets))
    for name, ask in (("visible or not", database.visible), ("with clearance", database.line_of_sight)):
        a_second = count / best(rounds, lambda ask=ask: ask(a, b, absolute=True), time.process_time)
        tell(f"lines of sight to 4 km, {name}", f"{a_second:,.0f} a s", "at least 50,000", 50_000 <= a_second)


def main() -> None:
    """Measure and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--posts", type=int, default=1500)
    parser.add_argument("--database")
    words = parser.parse_args()
    load = ", ".join(f"{load:.2f}" for load in os.getloadavg())
    print(f"{os.cpu_count()} cores, load before {load}")
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


if __name__ == "__main__":
    main()
