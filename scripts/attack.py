#!/usr/bin/env python3
"""Attacks the compiler with made-up areas, networks and jobs, and judges what it builds by a judge of its own.

    scripts/attack.py --tiefort target/release/tiefort                  1,000 seeds
    scripts/attack.py --tiefort target/release/tiefort --short          a minute of them
    scripts/attack.py --tiefort target/release/tiefort --seeds 17       one again, --seeds 100:200 some
    scripts/attack.py --tiefort … --seeds 17 --keep /tmp/17             and keeps its files there

Each seed makes an area (cliffs, mesas, noise, voids, blocks of a town, windows of real rasters from TIEFORT_DATA or
../shared/data), at times a network over it, and a job with its keys at random. Then

build    the job is built, and `judge.py`, which knows only FORMAT.md, judges it: watertight within and across levels,
         limits, residuals, heights within bounds, lakes level, no deck under ground, rivers that fall
verify   `tiefort verify` must say the same of it
report   its figures are those of the triangles
again    other workers, one tile again, a section or key taken out and put back: always the bytes of a fresh build
damage   a copy is damaged with its checksums right, and `verify` must object

Prints each fault with its seed. Needs NumPy. Exit codes: 0 no fault, 1 faults.
"""

import argparse
import collections
import concurrent.futures
import json
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import zlib

import numpy as np

import attack_scenes
import judge
import read_slm

BUILD_SECONDS_MAX = 120
SHORT_SEEDS, SHORT_SECONDS = 80, 75
# What a build may refuse, in its own words: jobs that ask for what cannot be.
REFUSALS = [
    r"need more triangles than mean_per_load_module",
    r"a forbidden post, .*, that is a corner",
    r"fowler-little: .* points, on lines simplified to that tolerance",
]


class Attack:
    """One seed: its folder, its scene, and the faults found so far, each with a word for its kind."""

    def __init__(self, program, seed, folder):
        self.program, self.seed, self.folder = program, seed, folder
        self.faults, self.notes = [], collections.Counter()
        self.scene = attack_scenes.Scene(seed, folder)
        # What is done with a scene must not depend on how the scene was drawn.
        self.draw = random.Random(seed * 7919 + 1)

    def fault(self, kind, text):
        self.faults.append((kind, text))

    def run(self, *arguments):
        ended = subprocess.run([self.program, *arguments], cwd=self.folder, capture_output=True, text=True,
                               timeout=BUILD_SECONDS_MAX)
        if ended.returncode not in (0, 1, 2) or "panicked" in ended.stderr:
            self.fault("panic", f"{' '.join(arguments)} ended with {ended.returncode}: {ended.stderr[-600:]}")
        # The program breaks its lines to a width, anywhere.
        return ended.returncode, " ".join((ended.stdout + ended.stderr).split())

    def build(self, job, into, kind="build"):
        """Builds a job; whether there is a database now, and the exit code."""
        code, said = self.run("build", job, "--out", into, "--workers", "1", "--no-html", "--quiet")
        if code == 2 and any(re.search(refusal, said) for refusal in REFUSALS):
            self.notes["refused"] += 1
            return None
        if code not in (0, 1):
            self.fault(kind, f"exit {code}: {said[:600]}")
            return None
        return code

    def all(self):
        """Everything that is done with a seed."""
        (self.folder / "job.toml").write_text(self.scene.job.text())
        code = self.build("job.toml", "area")
        if code is None:
            return
        self.notes["built"] += 1
        faults = self.judge("area", self.scene.job.sections, code)
        self.verify("area", faults)
        self.told()
        if self.draw.random() < 0.2:
            self.repeated()
        if self.draw.random() < 0.5:
            self.again()
        if not self.faults and self.draw.random() < 0.5:
            self.damage()

    def judge(self, name, sections, code):
        """Judges a database of these sections; returns the kinds of faults."""
        try:
            database = judge.Database.read(self.folder / name)
        except read_slm.Damaged as error:
            self.fault("format", str(error))
            return {"format"}
        found = collections.defaultdict(list)
        own_borders = sections.get("lod", {}).get("border") == '"own"'
        found["crack"] += judge.watertight(database, own_borders)
        # A breach is told by exit code 1.
        over = judge.limits(database, self.scene.job.limits if "limits" in sections else {}, is_joint(sections))
        if over and code == 0:
            found["limits"] += over
        if self.is_bare(sections):
            found["residual"] += judge.residuals(database, self.scene.posts)
        found["beyond"] += judge.beyond(database, self.scene.posts, self.exempt(sections, database)).faults
        found["lake"] += judge.uneven_lakes(database)
        found["level"] += judge.levels(database)
        found["deck crack"] += judge.deck_cracks(database)
        found["deck"] += judge.sunken_decks(database)
        found["object"] += judge.standing(database, *self.scene.job.object_limits)
        found["river"] += judge.feature_lines(database) + judge.rising_lines(database)
        # A pin may stand beside a road at any height.
        if "pins" not in sections.get("tin", {}):
            found["wall"] += judge.walls(database, self.scene.posts)
        for kind, faults in found.items():
            for fault in faults[:3]:
                self.fault(kind, fault)
            if faults[3:]:
                self.fault(kind, f"and {len(faults) - 3} more")
        return {kind for kind, faults in found.items() if faults}

    def exempt(self, sections, database):
        """Which vertices may leave the ground: near features, which shape it, near water, and at pins."""
        grid, places, areas = self.scene.grid, [], []
        quanta = attack_scenes.QUANTA
        if "features" in sections:
            for _, geometry, tags in self.scene.network.features:
                # Slopes beside roads end 60 m away, those beside water 150 m (docs/guides/features.md).
                is_water = not {"waterway", "natural"}.isdisjoint(tags)
                near = 12 * grid.spacing_m + (150 if is_water else 60)
                rings = geometry if isinstance(geometry[0], list) else []
                areas += rings[:1]
                for line in rings or [geometry]:
                    places += [(a, b, near) for a, b in zip(line, line[1:] or line)]
        clipped = sections.get("load_modules", {}).get("edges") == '"clip"'
        pinned = self.scene.job.pinned if "pins" in sections.get("tin", {}) else []
        has_water = "water" in sections["dem"]

        def at(x, y):
            found = np.zeros(len(x), dtype=bool)
            if has_water:
                return ~found
            if clipped:
                # Where triangles are cut, vertices lie on their planes.
                side = database.side
                found |= (x % side == 0) | (y % side == 0)
            for (ax, ay), (bx, by), near in places:
                found |= away(x / quanta, y / quanta, ax, ay, bx, by) < near
            for ring in areas:
                found |= inside(x / quanta, y / quanta, ring)
            for _, column, row in pinned:
                found |= (x == column * database.spacing) & (y == row * database.spacing)
            return found

        return at

    def verify(self, name, faults):
        """`verify` objects to what the judge does, and to nothing else."""
        # How high the posts are it knows with a raster only.
        self.agree("verify", faults - {"beyond"}, "verify", name)
        if self.is_bare(self.scene.job.sections):
            self.agree("verify --dem", faults, "verify", name, "--dem", "dem.asc")

    def agree(self, what, faults, *arguments):
        code, said = self.run(*arguments)
        # What limits left under the ground is told, and no damage.
        if re.search(r"[1-9]\d* of them under the ground", said):
            faults = faults - {"deck"}
        if code == 0 and faults:
            self.fault("blind", f"{what} says sound, and the judge found {', '.join(sorted(faults))}")
        if code != 0 and not faults:
            self.fault("alarm", f"{what}: exit {code}, and the judge finds no fault: {said[:500]}")

    def told(self):
        """The report's figures are those of the triangles."""
        database = judge.Database.read(self.folder / "area")
        report = json.loads((self.folder / "area/report.json").read_text())
        job = self.scene.job
        counted = judge.counts(database, job.limits.get("count") == "polygons", is_joint(job.sections))
        in_level = [sum(map(judge.triangle_count, level.values())) for level in database.levels]
        limit = self.scene.job.limits["per_load_module"]
        wanted = {
            ("per_load_module", "max"): int(counted.max()),
            ("per_load_module", "over"): int((counted > limit).sum()),
            ("per_4km", "max"): judge.windows(counted, database.side / attack_scenes.QUANTA),
            ("pool", "used"): min(int(np.maximum(counted - limit, 0).sum()), self.scene.job.limits.get("pool", 0)),
        }
        for (table, key), value in wanted.items():
            if report[table][key] != value:
                self.fault("report", f"{table}.{key} is {report[table][key]}, the triangles say {value}")
        if [level["triangles"] for level in report.get("levels", [])] not in ([], in_level):
            self.fault("report", f"triangles of levels are not {in_level}")
        if self.is_bare(self.scene.job.sections):
            rms = judge.rms_m(database, self.scene.posts)
            if abs(report["residual"]["rms_m"] - rms) > 0.001 * rms + 0.002:
                self.fault("report", f"residual.rms_m is {report['residual']['rms_m']}, the triangles say {rms}")

    def is_bare(self, sections):
        """Whether the working ground is the scene's posts and nothing else."""
        is_filled = "fill" in sections["dem"].get("voids", "")
        return "features" not in sections and "water" not in sections["dem"] and not is_filled

    def repeated(self):
        """Other workers, another order of features and a tile made again: the same bytes."""
        self.notes["repeated"] += 1
        code, said = self.run("build", "job.toml", "--out", "repeated", "--workers", "3", "--no-html", "--quiet")
        if code == 2:
            return self.fault("again", f"with three workers: exit {code}: {said[:300]}")
        self.same("area", "repeated", "with three workers")
        if self.scene.network and self.scene.job.sections.get("features"):
            self.scene.network.write(self.folder / "features.geojson", self.draw)
            if self.build("job.toml", "shuffled", "again") is not None:
                self.alike("area", "shuffled", "features in another order")
            self.scene.network.write(self.folder / "features.geojson")
        tile = self.draw.choice(sorted((self.folder / "area/tiles").glob("*.tin"))).stem
        code, said = self.run("tile", "job.toml", f"{int(tile[1:3])},{int(tile[4:6])}", "--out", "repeated", "--quiet")
        if code == 2:
            return self.fault("again", f"tile {tile} again: exit {code}: {said[:300]}")
        self.same("area", "repeated", f"tile {tile} again")

    def again(self):
        """Takes a section or key out, builds into the same folder, then puts it back. Other tiles or load modules would
        be another area, which is refused."""
        sections = self.scene.job.sections
        # Clipped edges need another method than the one that holds where none is named.
        known = ["features", "objects", "lod", "importance", "limits"] + ["tin"] * (not self.scene.job.clip)
        optional = [section for section in known if section in sections]
        optional += [key for key in ("tin.pins", "dem.water", "tin.start", "lod.border", "features.rules")
                     if key.split(".")[1] in sections.get(key.split(".")[0], {})]
        without = [self.draw.choice(optional)]
        self.notes[f"without {without[0]}"] += 1
        # Levels that leave roads out need roads.
        without += ["lod"] if without == ["features"] else []
        job, text = self.scene.job, self.scene.job.text(without)
        kept = {name: {key: value for key, value in keys.items() if f"{name}.{key}" not in without}
                for name, keys in sections.items() if name not in without}
        if self.draw.random() < 0.4:
            # Another job altogether, over the same ground.
            job = attack_scenes.Job(self.draw, self.scene, "other-")
            kept, text, without = job.sections, job.text(), "another job"
        (self.folder / "other.toml").write_text(text)
        fresh = self.build("other.toml", "fresh", "build")
        if fresh is None:
            return
        first, self.scene.job = self.scene.job, job
        self.judge("fresh", kept, fresh)
        self.scene.job = first
        shutil.copytree(self.folder / "area", self.folder / "again")
        if self.build("other.toml", "again", "again") is None:
            self.fault("again", f"without {without}")
            return
        self.same("fresh", "again", f"without {without}")
        if self.draw.random() < 0.5 and self.build("job.toml", "again", "again") is not None:
            self.same("area", "again", f"without {without}, and back")

    def alike(self, one, other, what):
        """The same load modules, in files that may differ in the fingerprint."""
        modules = lambda name: [read_slm.parse(path.read_bytes())[1]
                                for path in sorted((self.folder / name / "modules").iterdir())]
        if modules(one) != modules(other):
            self.fault("order", f"{what}: other load modules")

    def same(self, one, other, what):
        files = lambda name: {str(path.relative_to(self.folder / name)): path.read_bytes()
                              for part in ("tiles", "modules") for path in (self.folder / name / part).iterdir()}
        one, other = files(one), files(other)
        differ = sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))
        if differ:
            self.fault("again", f"{what}: {len(differ)} files are not those of a fresh build: {differ[:4]}")

    def damage(self):
        """Damages a copy with all checksums right; `verify` must object."""
        shutil.copytree(self.folder / "area", self.folder / "damaged", dirs_exist_ok=True)
        files = sorted((self.folder / "damaged/modules").glob("*.slm"))
        forgery = Forgery(self.draw.choice(files))
        numbers = range(len(forgery.modules))
        decked = [number for number in numbers if forgery.modules[number].get("decks", {}).get("triangles")]
        sinks = decked and self.draw.random() < 0.7
        number = self.draw.choice(decked if sinks else numbers)
        how = self.sink if sinks else self.draw.choice([self.lift, self.lift, self.reclass, self.understate, self.flip])
        what = how(forgery, number, forgery.modules[number])
        if what is None:
            return
        forgery.write()
        code, said = self.run("verify", "damaged")
        self.notes["damaged"] += 1
        if code == 0:
            self.fault("forged", f"verify says sound: {what} in {forgery.path.name}, section {number}")
        elif code == 2 and "checksum" in said:
            self.fault("forged", f"verify sees the checksum alone: {said[:300]}")
        # A vertex whose triangles hold no post shows in the tile's TIN alone.
        if how == self.understate and self.is_bare(self.scene.job.sections):
            damaged = judge.Database.read(self.folder / "damaged")
            if not judge.residuals(damaged, self.scene.posts):
                self.fault("judge", f"sees nothing of {what} in {forgery.path.name}, section {number}")

    def lift(self, forgery, number, module):
        at = self.draw.randrange(len(module["vertices"]))
        by = self.draw.choice([-1, 1]) * self.draw.choice([40, 1280])
        forgery.set_height(number, at, module["vertices"][at][2] + by)
        return f"vertex {at} moved by {by} quanta"

    def reclass(self, forgery, number, module):
        at = self.draw.randrange(len(module["triangles"]))
        kind = 0 if module["classes"][at] else 1
        forgery.set_class(number, at, kind)
        return f"triangle {at} of class {module['classes'][at]} became {kind}"

    def understate(self, forgery, number, module):
        squares = module["residual"]["sum_squared"]
        if squares < 10_000:
            return None
        forgery.set_residual(number, squares * 9 // 10)
        return f"squares {squares} became {squares * 9 // 10}"

    def sink(self, forgery, number, module):
        """Moves a vertex of a deck down, as far as its order allows."""
        places = module["decks"]["vertices"]
        at = self.draw.randrange(len(places))
        height = places[at][2] - self.draw.choice([1, 128, 6400])
        if at and places[at - 1][:2] == places[at][:2]:
            return None
        forgery.set_deck_height(number, at, height)
        return f"vertex {at} of decks sunk to {height} quanta"

    def flip(self, forgery, number, module):
        """Turns an edge between two triangles whose four corners are convex."""
        found = turned(module["vertices"], module["triangles"], self.draw)
        if found is None:
            return None
        forgery.set_triangles(number, found)
        return "an edge was turned"


def is_joint(sections):
    """Whether objects count in the limits of the ground."""
    return "joint = true" in sections.get("objects", {}).get("limits", "")


def away(x, y, ax, ay, bx, by):
    """Distance of places from a piece of a line."""
    dx, dy = bx - ax, by - ay
    along = np.clip(((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-9), 0, 1)
    return np.hypot(x - ax - along * dx, y - ay - along * dy)


def inside(x, y, ring):
    """Which places a ring holds."""
    found = np.zeros(len(x), dtype=bool)
    for (ax, ay), (bx, by) in zip(ring, ring[1:]):
        with np.errstate(divide="ignore", invalid="ignore"):
            found ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) / (by - ay) * (bx - ax))
    return found


def turned(vertices, triangles, draw):
    """The triangles with one edge turned, sorted as FORMAT.md asks; None where no edge can be."""
    beside = {}
    for triangle in triangles:
        for at in range(3):
            beside[triangle[at], triangle[(at + 1) % 3]] = triangle
    edges = sorted(edge for edge in beside if edge[0] < edge[1] and edge[::-1] in beside)
    draw.shuffle(edges)
    area = lambda a, b, c: ((vertices[b][0] - vertices[a][0]) * (vertices[c][1] - vertices[a][1])
                            - (vertices[b][1] - vertices[a][1]) * (vertices[c][0] - vertices[a][0]))
    for a, b in edges:
        one, other = beside[a, b], beside[b, a]
        [c], [d] = set(one) - {a, b}, set(other) - {a, b}
        if area(c, a, d) > 0 and area(d, b, c) > 0:
            kept = [triangle for triangle in triangles if triangle not in (one, other)]
            smallest_first = lambda t: min(t[at:] + t[:at] for at in range(3))
            return sorted(kept + [smallest_first((c, a, d)), smallest_first((d, b, c))])
    return None


def attack(program, seed, keep):
    """Runs a seed; returns it with its faults, its notes, seconds, and what it was."""
    start = time.monotonic()
    folder = pathlib.Path(keep or tempfile.mkdtemp(prefix=f"tiefort-attack-{seed}-"))
    folder.mkdir(parents=True, exist_ok=True)
    about, faults, notes = "", [], collections.Counter()
    try:
        one = Attack(program, seed, folder)
        grid = one.scene.grid
        about = f"{one.scene.kind}, {grid.rows}x{grid.columns} of {grid.side_m:g} m at {grid.spacing_m:g} m"
        about += f", {len(one.scene.network.features)} features" if one.scene.network else ""
        faults, notes = one.faults, one.notes
        one.all()
    except subprocess.TimeoutExpired as error:
        faults.append(("slow", str(error)[:300]))
    except Exception:
        faults.append(("script", traceback.format_exc()))
    if not keep:
        shutil.rmtree(folder, ignore_errors=True)
    return seed, faults, notes, time.monotonic() - start, about


# --- damage with every checksum right: what only a look at the content can find ---


KEY = [0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19]
ORDER = [2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8]
STARTS, ENDS, PARENT, TOP = 1, 2, 4, 8
CHUNK_BYTES, BLOCK_BYTES = 1024, 64
# Where the four words lie that each step of a round mixes.
STEPS = [(0, 4, 8, 12), (1, 5, 9, 13), (2, 6, 10, 14), (3, 7, 11, 15),
         (0, 5, 10, 15), (1, 6, 11, 12), (2, 7, 8, 13), (3, 4, 9, 14)]


def compress(chain, words, counters, length, flags):
    """BLAKE3's compression of many blocks at once: arrays of 8 x n and 16 x n words; returns 8 x n."""
    count = words.shape[1]
    fill = lambda value: np.full(count, value, dtype=np.uint32)
    state = [*chain, *(fill(word) for word in KEY[:4]), counters.astype(np.uint32),
             (counters >> np.uint64(32)).astype(np.uint32), fill(length), fill(flags)]
    turn = lambda word, by: (word >> np.uint32(by)) | (word << np.uint32(32 - by))
    message = list(words)
    for _ in range(7):
        for step, (a, b, c, d) in enumerate(STEPS):
            for part, (far, near) in enumerate(((16, 12), (8, 7))):
                state[a] = state[a] + state[b] + message[2 * step + part]
                state[d] = turn(state[d] ^ state[a], far)
                state[c] = state[c] + state[d]
                state[b] = turn(state[b] ^ state[c], near)
        message = [message[at] for at in ORDER]
    return np.stack([state[at] ^ state[at + 8] for at in range(8)])


def words_of(data):
    return np.frombuffer(data.ljust(BLOCK_BYTES, b"\0"), "<u4").astype(np.uint32).reshape(16, 1)


def start(count):
    return np.repeat(np.array(KEY, dtype=np.uint32)[:, None], count, axis=1)


def blake3(data):
    """The hash in hexadecimal."""
    whole, rest = divmod(len(data), CHUNK_BYTES)
    if rest or not whole:
        last = chunk_tail(data[whole * CHUNK_BYTES :], whole, is_root=whole == 0)
    else:
        whole -= 1
        last = chunk_tail(data[whole * CHUNK_BYTES :], whole, is_root=whole == 0)
    if whole == 0:
        return last.astype("<u4").T.tobytes().hex()
    blocks = np.frombuffer(data[: whole * CHUNK_BYTES], "<u4").astype(np.uint32).reshape(whole, 16, 16)
    chains, counters = start(whole), np.arange(whole, dtype=np.uint64)
    for block in range(16):
        flags = STARTS * (block == 0) | ENDS * (block == 15)
        chains = compress(chains, blocks[:, block].T, counters, BLOCK_BYTES, flags)
    return merged(np.concatenate([chains, last], axis=1), True).astype("<u4").T.tobytes().hex()


def chunk_tail(data, number, is_root):
    chain, counter = start(1), np.array([number], dtype=np.uint64)
    blocks = [data[at : at + BLOCK_BYTES] for at in range(0, len(data), BLOCK_BYTES)] or [b""]
    for at, block in enumerate(blocks):
        is_last = at + 1 == len(blocks)
        flags = STARTS * (at == 0) | (ENDS | TOP * is_root) * is_last
        chain = compress(chain, words_of(block), counter, len(block), flags)
    return chain


def merged(chains, is_root):
    """The root of a tree whose left side is the largest power of two of chunks that leaves some for the right."""
    count = chains.shape[1]
    if count == 1:
        return chains
    left = 1 << (count - 1).bit_length() - 1
    words = np.concatenate([merged(chains[:, :left], False), merged(chains[:, left:], False)])
    return compress(start(1), words, np.zeros(1, dtype=np.uint64), BLOCK_BYTES, PARENT | TOP * is_root)


class Forgery:
    """A load-module file, taken apart and put together again."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.data = bytearray(self.path.read_bytes())
        self.header, self.modules = read_slm.parse(bytes(self.data))

    def section(self, number):
        """Where the section of a load module begins in the file, and its length."""
        each = read_slm.entry_bytes(self.header)
        at = struct.unpack_from("<I", self.data, 12)[0] + each * number
        return struct.unpack_from("<QI", self.data, at)

    def set_height(self, number, vertex, height):
        """Puts a vertex of the ground at another height in quanta."""
        start, length = self.section(number)
        struct.pack_into("<i", self.data, start + read_slm.SECTION.size + 8 * vertex + 4, height)
        self.reseal(number, start, length)

    def set_class(self, number, triangle, kind):
        start, length = self.section(number)
        module = self.modules[number]
        at = start + read_slm.SECTION.size + 8 * len(module["vertices"]) + 6 * len(module["triangles"])
        at += 2 * sum(len(side) for side in module["sides"].values()) + triangle
        self.data[at] = kind
        self.reseal(number, start, length)

    def set_residual(self, number, squares):
        start, length = self.section(number)
        struct.pack_into("<Q", self.data, start + 48, squares)
        self.reseal(number, start, length)

    def set_triangles(self, number, triangles):
        """Writes as many triangles as there are, in their order."""
        start, length = self.section(number)
        at = start + read_slm.SECTION.size + 8 * len(self.modules[number]["vertices"])
        for place, triangle in enumerate(triangles):
            struct.pack_into("<3H", self.data, at + 6 * place, *triangle)
        self.reseal(number, start, length)

    def set_deck_height(self, number, vertex, height):
        """Puts a vertex of the decks, behind the section, at another height in quanta."""
        start, length = self.section(number)
        decks = self.modules[number]["decks"]
        at = start + length
        if self.header["version"] == 3:
            # Decks are the first part behind the table, and their checksum stands in it.
            (count,) = struct.unpack_from("<I", self.data, at + 12)
            (size,) = struct.unpack_from("<I", self.data, at + 20)
            table = 16 + 12 * count + 4
            part = at + table
            struct.pack_into("<i", self.data, part + 8 + 8 * vertex + 4, height)
            struct.pack_into("<I", self.data, at + 24, zlib.crc32(bytes(self.data[part : part + size])))
            return seal(self.data, at, table)
        struct.pack_into("<i", self.data, at + read_slm.DECKS.size + 8 * vertex + 4, height)
        heights = [z for _, _, z in decks["vertices"]]
        heights[vertex] = height
        entry = struct.unpack_from("<I", self.data, 12)[0] + read_slm.entry_bytes(self.header) * number
        struct.pack_into("<ii", self.data, entry + read_slm.ENTRY.size + 8, min(heights), max(heights))
        whole = read_slm.padded(read_slm.DECKS.size + 8 * len(heights) + 7 * len(decks["triangles"])) + 4
        seal(self.data, at, whole)
        self.seal_index()

    def seal_index(self):
        at = struct.unpack_from("<I", self.data, 12)[0]
        seal(self.data, at, read_slm.entry_bytes(self.header) * len(self.modules) + 4)

    def reseal(self, number, start, length):
        """Writes lowest and highest height and checksums anew."""
        count = len(self.modules[number]["vertices"])
        heights = [struct.unpack_from("<i", self.data, start + read_slm.SECTION.size + 8 * at + 4)[0]
                   for at in range(count)]
        header_length = struct.unpack_from("<I", self.data, 12)[0]
        each = read_slm.entry_bytes(self.header)
        struct.pack_into("<ii", self.data, header_length + each * number + 24, min(heights), max(heights))
        seal(self.data, start, length)
        self.seal_index()

    def write(self):
        """Writes the file and says so in `database.json`."""
        self.path.write_bytes(self.data)
        list_file(self.path.parent.parent, self.path)


def seal(data, start, length):
    struct.pack_into("<I", data, start + length - 4, zlib.crc32(bytes(data[start : start + length - 4])))


def list_file(folder, path):
    """Writes length and hash of a load-module file into the manifest, and the manifest's own checksum."""
    manifest = folder / "database.json"
    text = manifest.read_text()
    row, column = int(path.stem[1:3]), int(path.stem[4:6])
    [tile] = [tile for tile in json.loads(text)["tiles"] if (tile["row"], tile["col"]) == (row, column)]
    data = path.read_bytes()
    text = text.replace(tile["slm"]["blake3"], blake3(data))
    manifest.write_text(with_checksum(text))


def with_checksum(text):
    """A text of JSON with its last key, `checksum`, made right."""
    value = json.loads(text)["checksum"]
    at = text.index(value)
    key = text.rindex(",", 0, at)
    bare = text[:key] + text[at + len(value) + 1 :]
    return text.replace(value, blake3(bare.encode()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tiefort", required=True, help="the program")
    parser.add_argument("--seeds", help="one, or FIRST:END", default="1:1001")
    parser.add_argument("--short", action="store_true", help=f"{SHORT_SEEDS} seeds, or as many as a minute holds")
    parser.add_argument("--at-once", type=int, default=2, help="seeds at the same time")
    parser.add_argument("--keep", help="with one seed: the folder for its files")
    options = parser.parse_args()
    program = str(pathlib.Path(options.tiefort).resolve())
    first, _, end = options.seeds.partition(":")
    seeds = range(int(first), int(end or int(first) + 1))
    if options.short:
        seeds = range(1, SHORT_SEEDS + 1)
    if not attack_scenes.data_folder():
        print("no real rasters: neither TIEFORT_DATA nor ../shared/data is there", flush=True)
    start, kinds, notes, failed, done = time.monotonic(), collections.Counter(), collections.Counter(), [], 0
    with concurrent.futures.ProcessPoolExecutor(options.at_once) as pool:
        runs = [pool.submit(attack, program, seed, options.keep) for seed in seeds]
        for run in concurrent.futures.as_completed(runs):
            if options.short and SHORT_SECONDS < time.monotonic() - start:
                pool.shutdown(cancel_futures=True)
                break
            seed, faults, noted, seconds, about = run.result()
            notes += noted
            done += 1
            kinds.update({kind for kind, _ in faults})
            if faults:
                failed.append(seed)
            if faults:
                print(f"seed {seed} ({about}; {seconds:.1f} s)", flush=True)
                for kind, text in faults:
                    print(f"  {kind}: {text}", flush=True)
    told = ", ".join(f"{count} {note}" for note, count in sorted(notes.items()))
    print(f"{done} seeds in {time.monotonic() - start:.0f} s: {told}")
    print(f"{len(failed)} with faults")
    print(f"faults by kind, in seeds: {dict(kinds) or 'none'}; seeds {sorted(failed)[:40]}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
