#!/usr/bin/env python3
"""Judges a finished database from its triangles alone: reads `.slm` by FORMAT.md and shares no code with the compiler.

    python3 scripts/judge.py mine.tdb
    python3 scripts/judge.py mine.tdb --posts dem.asc      also residuals and heights: a grid on the area's own posts

Prints each fault on a line of its own, then figures. Needs NumPy. Exit codes: 0 no fault, 1 faults, 2 unreadable.

Other scripts use it as a module: `Database.read(folder)`, then one function for each question:

watertight   triangles cover each load module once; equal sides between neighbours, and between any two levels
levels       coarser levels hold no place of their own, and decks as large as the finest
deck_cracks  decks meet on lines between load modules
limits       of a load module with the pool, of windows that cover 4 km, of the mean
residuals    every post anew, against what the sections of load modules say
beyond       vertices outside the range of the posts within two of them
lakes        heights over all vertices of connected triangles of water
decks        how far decks stand above the triangles under them, exactly, over their whole area
feature_lines  lines of features.gpkg are edges of triangles, and channels fall
rising_lines   the same of the lines in load modules
walls          steps of the ground beside roads and railways
standing       walls reach the ground, roofs stand over it, pieces of an object fit together, limits of objects hold
"""

import argparse
import json
import math
import pathlib
import sqlite3
import struct
import sys
from dataclasses import dataclass, field

import numpy as np

import read_slm

QUANTA = 128
HOLE = 255
WINDOW_M = 4000
# A deck may lie this far under the ground where both are rounded to quanta, in metres.
ROUNDING_M = 2 / QUANTA


@dataclass
class Mesh:
    """Triangles of a load module, or of its decks; x and y in quanta from the area's south-western corner."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    triangles: np.ndarray
    classes: np.ndarray

    @staticmethod
    def of(part, west, south):
        vertices = np.array(part["vertices"], dtype=np.int64).reshape(-1, 3)
        triangles = np.array(part["triangles"], dtype=np.int64).reshape(-1, 3)
        classes = np.array(part["classes"], dtype=np.int64)
        return Mesh(vertices[:, 0] + west, vertices[:, 1] + south, vertices[:, 2], triangles, classes)

    def corners(self):
        """Of every triangle, x, y and z of its corners: three arrays of n x 3."""
        return self.x[self.triangles], self.y[self.triangles], self.z[self.triangles]


@dataclass
class Module:
    """A load module at one level."""

    place: tuple
    level: int
    polygons: int
    residual: dict
    sides: dict
    ground: Mesh
    decks: Mesh = None
    lines: list = field(default_factory=list)
    objects: list = field(default_factory=list)


def triangle_count(module):
    """Triangles of a load module, those of decks with them."""
    return len(module.ground.triangles) + (len(module.decks.triangles) if module.decks else 0)


@dataclass
class Database:
    """The load modules of a database by level and place, and what its open files say."""

    folder: pathlib.Path
    side: int
    spacing: int
    origin_m: tuple
    rows: int
    columns: int
    levels: list
    classes: list = field(default_factory=list)

    @staticmethod
    def read(folder):
        """Reads every file of `modules/`; raises read_slm.Damaged where one is not as FORMAT.md says."""
        folder = pathlib.Path(folder)
        files = sorted((folder / "modules").glob("*.slm"))
        if not files:
            raise read_slm.Damaged(f"{folder}: no load modules")
        levels, first = {}, None
        for file in files:
            header, parts = read_slm.parse(file.read_bytes())
            first = first or header
            same = ["area_modules", "side", "spacing_m", "origin_m", "crs", "levels"]
            read_slm.expect(all(header[key] == first[key] for key in same), file.name, "differs from the first file")
            for part in parts:
                west, south = part["column"] * header["side"], part["row"] * header["side"]
                place = (part["row"], part["column"])
                own = levels.setdefault(part["level"], {})
                read_slm.expect(place not in own, file.name, f"load module {place} is in another file, too")
                decks = part.get("decks")
                own[place] = Module(
                    place,
                    part["level"],
                    part["polygons"],
                    part["residual"],
                    part["sides"],
                    Mesh.of(part, west, south),
                    Mesh.of(decks, west, south) if decks and decks["triangles"] else None,
                    part.get("lines", []),
                    part.get("objects", []),
                )
        rows, columns = first["area_modules"]
        report = folder / "report.json"
        classes = [one["name"] for one in json.loads(report.read_text())["classes"]] if report.exists() else []
        spacing = round(first["spacing_m"] * QUANTA)
        ordered = [levels[level] for level in range(first["levels"])]
        return Database(folder, first["side"], spacing, first["origin_m"], rows, columns, ordered, classes)

    def metres(self, x, y):
        """East and north of a place in quanta, for messages."""
        return f"{self.origin_m[0] + x / QUANTA:.2f} {self.origin_m[1] + y / QUANTA:.2f}"

    def class_numbers(self, names):
        return [number for number, name in enumerate(self.classes) if name in names]


def watertight(database, own_borders=False):
    """Faults of coverage and of sides; with `own_borders`, levels need not fit each other."""
    faults = []
    for level, modules in enumerate(database.levels):
        expected = {(row, column) for row in range(database.rows) for column in range(database.columns)}
        if set(modules) != expected:
            faults.append(f"level {level}: load modules {sorted(expected ^ set(modules))[:4]} are missing")
        for place, module in modules.items():
            faults += [f"level {level}, load module {place}: {fault}" for fault in open_edges(database, module)]
    count = len(database.levels)
    pairs = [(a, b) for a in range(count) for b in range(count) if a == b or not own_borders]
    for one, other in pairs:
        faults += cracks(database, one, other)
    return faults


def open_edges(database, module):
    """Faults of one mesh: orientation, edges that are not shared by two, area."""
    mesh, side = module.ground, database.side
    x, y, _ = mesh.corners()
    doubled = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (y[:, 1] - y[:, 0]) * (x[:, 2] - x[:, 0])
    if (doubled <= 0).any():
        yield f"{int((doubled <= 0).sum())} triangles are not counter-clockwise"
    if doubled.sum() != 2 * side * side:
        yield f"triangles cover {doubled.sum() / 2 / side / side:.6f} of the square"
    count = len(mesh.x)
    edges = np.concatenate([mesh.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    forward, backward = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    if len(np.unique(forward)) != len(forward):
        yield "an edge has two triangles on one side"
    alone = edges[~np.isin(forward, backward)]
    row, column = module.place
    found = set()
    for a, b in alone.tolist():
        ends = [(int(mesh.x[at]) - column * side, int(mesh.y[at]) - row * side) for at in (a, b)]
        on = [coordinate for coordinate in (0, 1) for line in (0, side) if {end[coordinate] for end in ends} == {line}]
        if not on:
            yield f"an edge inside has one triangle, at {database.metres(int(mesh.x[a]), int(mesh.y[a]))}"
        found.add(frozenset((a, b)))
    wanted = {frozenset(pair) for side_list in module.sides.values() for pair in zip(side_list, side_list[1:])}
    if found != wanted:
        yield "edges on the sides are not those between neighbours of the lists of sides"
    if len(np.unique(mesh.triangles)) != count:
        yield "a vertex belongs to no triangle"


def cracks(database, one, other):
    """Where a side of a load module at a level differs from its neighbour's, or its own at another level."""
    def places(module, name):
        at = module.sides[name]
        return np.stack([module.ground.x[at], module.ground.y[at], module.ground.z[at]])

    def differ(a, b, side, facing):
        return not np.array_equal(places(a, side), places(b, facing))

    for (row, column), module in database.levels[one].items():
        for step, side, facing in (((0, 1), "east", "west"), ((1, 0), "north", "south")):
            beside = database.levels[other].get((row + step[0], column + step[1]))
            if beside and differ(module, beside, side, facing):
                yield f"levels {one} and {other}: load module {(row, column)} and its {side}ern neighbour: a crack"
        itself = database.levels[other].get((row, column))
        if one < other and itself and any(differ(module, itself, side, side) for side in read_slm.SIDES):
            yield f"load module {(row, column)}: its sides differ between levels {one} and {other}"


def levels(database):
    """Faults of coarser levels: a place that the finer one lacks, decks that cover not what those of the finest do."""
    faults = []
    for level in range(1, len(database.levels)):
        for place, module in database.levels[level].items():
            finer = database.levels[level - 1][place].ground
            known = set(zip(finer.x.tolist(), finer.y.tolist()))
            if not known.issuperset(zip(module.ground.x.tolist(), module.ground.y.tolist())):
                faults.append(f"level {level}, load module {place}: a vertex at a place that the finer level lacks")
            areas = [deck_area_m2(each) for each in (module, database.levels[0][place])]
            # Each level lifts them onto its own ground.
            if abs(areas[0] - areas[1]) > 0.1 + areas[1] / 100:
                faults.append(f"level {level}, load module {place}: decks are not those of the finest level")
    return faults


def deck_area_m2(module):
    """Square metres that decks cover."""
    if not module.decks:
        return 0.0
    x, y, _ = module.decks.corners()
    doubled = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (y[:, 1] - y[:, 0]) * (x[:, 2] - x[:, 0])
    return float(doubled.sum()) / 2 / QUANTA**2


def deck_cracks(database):
    """Faults of decks on lines between load modules, where both parts have the same vertices, at the finest level."""
    faults = []
    for (row, column), module in database.levels[0].items():
        for across, beside in ((True, (row, column + 1)), (False, (row + 1, column))):
            line = database.side * ((column if across else row) + 1)
            other = database.levels[0].get(beside)
            # Where one of them has none there, a deck ends at the line or runs along it.
            ends = [deck_ends(each, across, line) for each in (module, other)] if other else [set()]
            if all(ends) and ends[0] != ends[1]:
                faults.append(f"load modules {(row, column)} and {beside}: decks differ on the line between them")
    return faults


def deck_ends(module, across, line):
    """Vertices of edges of decks along a line between load modules: place along it and height. A deck that ends at it
    in one corner has none."""
    if not module.decks:
        return set()
    on, along = (module.decks.x, module.decks.y) if across else (module.decks.y, module.decks.x)
    of = module.decks.triangles
    there = of[(on[of] == line).sum(axis=1) == 2]
    there = there[on[there] == line]
    return set(zip(along[there].tolist(), module.decks.z[there].tolist()))


def counts(database, polygons=False, joint=False):
    """What counts against limits in each load module at the finest level, decks included: rows x columns."""
    counted = np.zeros((database.rows, database.columns), dtype=np.int64)
    for place, module in database.levels[0].items():
        fanned = len(module.ground.triangles) - module.polygons if polygons else 0
        counted[place] = triangle_count(module) - fanned + (sum(map(object_polygons, module.objects)) if joint else 0)
    return counted


def object_polygons(one):
    """Triangles of a wood; the roof and the walls of what has any."""
    return 1 + sum(corner[2] for ring in one["rings"] for corner in ring) if "rings" in one else len(one["triangles"])


def windows(counted, side_m):
    """The largest count of any window of load modules that covers 4 km, cut to the area."""
    size = [min(length, math.ceil(WINDOW_M / side_m)) for length in counted.shape]
    sums = np.zeros((counted.shape[0] + 1, counted.shape[1] + 1), dtype=np.int64)
    sums[1:, 1:] = counted.cumsum(0).cumsum(1)
    high, wide = size
    return int((sums[high:, wide:] - sums[:-high, wide:] - sums[high:, :-wide] + sums[:-high, :-wide]).max())


def limits(database, limits, joint=False):
    """Faults against a table of limits with the keys of a job; what its defaults say holds where it has none."""
    counted = counts(database, limits.get("count") == "polygons", joint)
    module, pool = limits.get("per_load_module", 100), limits.get("pool", 0)
    mean, window = limits.get("mean_per_load_module", 32), limits.get("per_4km_square", 4096)
    faults = []
    over = int(np.maximum(counted - module, 0).sum())
    if pool < over:
        faults.append(f"load modules have {over} above {module} each, the pool is {pool}")
    if mean * counted.size < counted.sum():
        faults.append(f"{counted.sum()} in all, the mean allows {mean * counted.size:.2f}")
    largest = windows(counted, database.side / QUANTA)
    if window < largest:
        faults.append(f"a window has {largest}, the limit is {window}")
    return faults


def heights_at_posts(database, level=0):
    """Heights of the triangles at every post of the working grid in quanta, not rounded; NaN over holes."""
    cells = database.side // database.spacing
    found = np.full((database.rows * cells + 1, database.columns * cells + 1), np.nan)
    hole = np.zeros(found.shape, dtype=bool)
    for module in database.levels[level].values():
        xs, ys, zs = (corners.tolist() for corners in module.ground.corners())
        for x, y, z, kind in zip(xs, ys, zs, module.ground.classes.tolist()):
            fill_posts(found, hole, database.spacing, x, y, z, kind == HOLE)
    return found, hole


def fill_posts(found, hole, spacing, x, y, z, is_hole):
    low_x, high_x = -(-min(x) // spacing), max(x) // spacing
    low_y, high_y = -(-min(y) // spacing), max(y) // spacing
    if high_x < low_x or high_y < low_y:
        return
    px = np.arange(low_x, high_x + 1, dtype=np.int64) * spacing
    py = (np.arange(low_y, high_y + 1, dtype=np.int64) * spacing)[:, None]
    shares = [
        (x[b] - x[a]) * (py - y[a]) - (y[b] - y[a]) * (px - x[a]) for a, b in ((1, 2), (2, 0), (0, 1))
    ]
    inside = (shares[0] >= 0) & (shares[1] >= 0) & (shares[2] >= 0)
    doubled = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])
    height = (shares[0] * z[0] + shares[1] * z[1] + shares[2] * z[2]) / doubled
    part = (slice(low_y, high_y + 1), slice(low_x, high_x + 1))
    found[part][inside] = height[inside]
    hole[part][inside] |= is_hole


def residuals(database, posts):
    """Faults of the figures in the sections, against the heights of posts in quanta (NaN for a void); by load module
    and level, as far as posts beyond the far sides belong to the next load module."""
    cells = database.side // database.spacing
    faults = []
    for level, modules in enumerate(database.levels):
        surface, _ = heights_at_posts(database, level)
        exact = np.abs(posts - surface)
        rounded = np.floor(exact + 0.5)
        # Where the half falls is not to be seen in floating point.
        doubtful = np.abs(exact % 1 - 0.5) < 1e-6
        for (row, column), module in modules.items():
            north, east = (row + 1) * cells + (row + 1 == database.rows), (column + 1) * cells
            part = (slice(row * cells, north), slice(column * cells, east + (column + 1 == database.columns)))
            own, loose = rounded[part], doubtful[part]
            there = ~np.isnan(own)
            own, loose = own[there], int(loose[there].sum())
            said = module.residual
            expected = {
                "posts": (int(there.sum()), 0),
                "largest": (own.max(initial=0), min(loose, 1)),
                "sum_abs": (own.sum(), loose),
                "sum_squared": ((own * own).sum(), loose * (2 * own.max(initial=0) + 1)),
            }
            wrong = [f"{key} {said[key]}, not {value:.0f}" for key, (value, slack) in expected.items()
                     if slack < abs(said[key] - value)]
            if wrong:
                faults.append(f"level {level}, load module {(row, column)}: residuals say {', '.join(wrong)}")
    return faults


def rms_m(database, posts, level=0, where=None):
    """RMS residual in metres over the posts that have heights, all or those of a mask."""
    surface, _ = heights_at_posts(database, level)
    wanted = ~np.isnan(posts) & ~np.isnan(surface) & (True if where is None else where)
    return float(np.sqrt(np.mean((posts - surface)[wanted] ** 2)) / QUANTA) if wanted.any() else 0.0


@dataclass
class Beyond:
    """Vertices that stand outside the range of the posts within two of them, by how much in metres, where."""

    counted: int
    outside: int
    faults: list
    largest_m: float


def beyond(database, posts, exempt=None):
    """Vertices of all levels against the posts within two of them: at most max(1 m, a tenth of their range) outside.

    These are the 5 x 5 posts about the post nearest to it, and 6 in a direction in which two are equally near. Vertices
    near a void are left out, and those for which `exempt(x, y)` holds, arrays in quanta."""
    counted, outside, faults, largest = 0, 0, [], 0.0
    size = np.array(posts.shape)
    for level, modules in enumerate(database.levels):
        for place, module in modules.items():
            mesh, spacing = module.ground, database.spacing
            lowest, highest = reach(posts, size, mesh.x / spacing, mesh.y / spacing)
            over = np.maximum(lowest - mesh.z, mesh.z - highest)
            over[np.isnan(over)] = -np.inf
            if exempt is not None:
                over[exempt(mesh.x, mesh.y)] = -np.inf
            counted += int(np.isfinite(over).sum())
            outside += int((over > 0).sum())
            largest = max(largest, float(over.max(initial=0)) / QUANTA)
            allowed = np.maximum(QUANTA, (highest - lowest) / 10)
            for at in np.flatnonzero(over > allowed + 1).tolist():
                where = database.metres(int(mesh.x[at]), int(mesh.y[at]))
                faults.append(
                    f"level {level}, load module {place}: a vertex at {where}"
                    f" stands at {mesh.z[at] / QUANTA:.2f} m, {over[at] / QUANTA:.2f} m outside the posts about it,"
                    f" {lowest[at] / QUANTA:.2f} to {highest[at] / QUANTA:.2f} m"
                )
    return Beyond(counted, outside, faults, largest)


def reach(posts, size, columns, rows):
    """Lowest and highest post within two of places in posts; NaN near a void."""
    lowest, highest = np.full(len(rows), np.inf), np.full(len(rows), -np.inf)
    first_row, first_column = np.ceil(rows - 2.5).astype(int), np.ceil(columns - 2.5).astype(int)
    for up in range(6):
        for over in range(6):
            row, column = first_row + up, first_column + over
            there = (row <= rows + 2.5) & (column <= columns + 2.5)
            there &= (0 <= row) & (row < size[0]) & (0 <= column) & (column < size[1])
            height = posts[row[there], column[there]]
            lowest[there] = np.minimum(lowest[there], height)
            highest[there] = np.maximum(highest[there], height)
    return lowest, highest


@dataclass
class Water:
    """A body of connected triangles of water at a level: heights of all their vertices in quanta."""

    level: int
    triangles: int
    lowest: int
    highest: int
    where: str


def lakes(database, names=("lake",)):
    """Bodies of water: triangles of these classes that are connected by edges, across load modules, level by level."""
    numbers = database.class_numbers(names)
    found = []
    for level, modules in enumerate(database.levels):
        triangles = []
        for module in modules.values():
            mesh = module.ground
            of_water = mesh.triangles[np.isin(mesh.classes, numbers)]
            for triangle in of_water.tolist():
                triangles.append([(int(mesh.x[at]), int(mesh.y[at]), int(mesh.z[at])) for at in triangle])
        for body in connected(triangles):
            corners = [corner for triangle in body for corner in triangle]
            heights = [z for _, _, z in corners]
            worst = max(corners, key=lambda corner: corner[2])
            found.append(Water(level, len(body), min(heights), max(heights), database.metres(*worst[:2])))
    return found


def connected(triangles):
    """Groups of triangles that share edges, by the places of their ends."""
    parents = list(range(len(triangles)))

    def root(at):
        while parents[at] != at:
            parents[at] = parents[parents[at]]
            at = parents[at]
        return at

    edges = {}
    for number, (a, b, c) in enumerate(triangles):
        for ends in ((a, b), (b, c), (c, a)):
            other = edges.setdefault(frozenset(end[:2] for end in ends), number)
            parents[root(number)] = root(other)
    groups = {}
    for number, triangle in enumerate(triangles):
        groups.setdefault(root(number), []).append(triangle)
    return list(groups.values())


def uneven_lakes(database, names=("lake",)):
    """Faults of lakes that are not level."""
    return [
        f"level {body.level}: a lake of {body.triangles} triangles at {body.where} is not level:"
        f" {body.lowest / QUANTA:.3f} to {body.highest / QUANTA:.3f} m"
        for body in lakes(database, names)
        if body.lowest != body.highest
    ]


@dataclass
class Overlap:
    """Where a triangle of a deck lies over (or under) one of the ground: heights between them are linear there."""

    place: tuple
    level: int
    deck_class: int
    ground_class: int
    area_m2: float
    under_m2: float
    least_m: float
    where: tuple


def decks(database, level=0):
    """Every overlap of a triangle of a deck with one of the ground, exactly: least height of the deck above the ground
    in metres, and the area over which it lies under it by more than rounding."""
    found = []
    for place, module in sorted(database.levels[level].items()):
        if not module.decks:
            continue
        ground = list(zip(*(corners.tolist() for corners in module.ground.corners()), module.ground.classes.tolist()))
        boxes = np.array([[min(x), max(x), min(y), max(y)] for x, y, _, _ in ground])
        for x, y, z, kind in zip(*(c.tolist() for c in module.decks.corners()), module.decks.classes.tolist()):
            near = (boxes[:, 0] < max(x)) & (min(x) < boxes[:, 1]) & (boxes[:, 2] < max(y)) & (min(y) < boxes[:, 3])
            for at in np.flatnonzero(near).tolist():
                shape = clipped(list(zip(x, y)), ground[at][0], ground[at][1])
                if 3 <= len(shape):
                    found.append(overlap(place, level, shape, (x, y, z, kind), ground[at]))
    return [one for one in found if 1e-4 < one.area_m2]


def overlap(place, level, shape, deck, ground):
    above = [(plane(deck, px, py) - plane(ground, px, py)) / QUANTA for px, py in shape]
    least = min(range(len(shape)), key=lambda at: above[at])
    under = below_line(list(zip(shape, above)))
    area, under_area = (abs(doubled(each)) / 2 / QUANTA**2 for each in (shape, under))
    return Overlap(place, level, deck[3], ground[3], area, under_area, above[least], shape[least])


def plane(triangle, px, py):
    """Height of the plane of a triangle at a place."""
    x, y, z = triangle[:3]
    whole = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])
    one = (px - x[0]) * (y[2] - y[0]) - (py - y[0]) * (x[2] - x[0])
    two = (x[1] - x[0]) * (py - y[0]) - (y[1] - y[0]) * (px - x[0])
    return z[0] + (one * (z[1] - z[0]) + two * (z[2] - z[0])) / whole


def clipped(shape, x, y):
    """A convex shape cut to a counter-clockwise triangle."""
    for a, b in ((0, 1), (1, 2), (2, 0)):
        def inside(point):
            return (x[b] - x[a]) * (point[1] - y[a]) - (y[b] - y[a]) * (point[0] - x[a])
        shape = cut(shape, [inside(point) for point in shape])
    return shape


def cut(shape, values):
    """What of a convex shape has values of at least 0, which are linear over it."""
    kept = []
    for at, point in enumerate(shape):
        following, value, other = shape[(at + 1) % len(shape)], values[at], values[(at + 1) % len(shape)]
        if value >= 0:
            kept.append(point)
        if value * other < 0:
            share = value / (value - other)
            kept.append(tuple(p + share * (q - p) for p, q in zip(point, following)))
    return kept


def below_line(with_heights):
    """The part of a shape where the deck is under the ground by more than rounding."""
    return cut([point for point, _ in with_heights], [-ROUNDING_M - height for _, height in with_heights])


def doubled(shape):
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(shape, shape[1:] + shape[:1]))


def sunken_decks(database):
    """Faults of decks that lie under the ground by more than 5 cm somewhere, a line for each load module."""
    faults = []
    for level in range(len(database.levels)):
        worst = {}
        for one in decks(database, level):
            if one.least_m < -0.05:
                known = worst.setdefault(one.place, [one, 0.0])
                known[1] += one.under_m2
                known[0] = min(known[0], one, key=lambda each: each.least_m)
        for place, (one, area) in worst.items():
            where = database.metres(*one.where)
            faults.append(
                f"level {level}, load module {place}: a deck lies {-one.least_m:.2f} m under the ground at {where},"
                f" {area:.1f} m2 of it"
            )
    return faults


def clearances(database, level=0):
    """The least height of decks over each class of ground under them, in metres, by its name."""
    least = {}
    for one in decks(database, level):
        name = database.classes[one.ground_class] if one.ground_class < len(database.classes) else str(one.ground_class)
        least[name] = min(one.least_m, least.get(name, math.inf))
    return least


def lines(database):
    """Lines of features.gpkg: (feature, class, form, role, [(x, y, z) in metres]); none where there is no such file."""
    path = database.folder / "features.gpkg"
    if not path.exists():
        return []
    with sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True) as source:
        rows = source.execute("SELECT feature, class, form, role, geom FROM lines ORDER BY fid").fetchall()
    return [(*row[:4], line_string(row[4])) for row in rows]


def line_string(blob):
    """Vertices of a LINESTRING (Z) of a GeoPackage."""
    envelope = {0: 0, 1: 32, 2: 48, 3: 48, 4: 64}[blob[3] >> 1 & 7]
    at = 8 + envelope
    order = "<" if blob[at] else ">"
    kind, count = struct.unpack_from(order + "II", blob, at + 1)
    size = 3 if kind // 1000 == 1 else 2
    numbers = struct.unpack_from(f"{order}{size * count}d", blob, at + 9)
    return [tuple(numbers[size * each : size * each + size]) for each in range(count)]


def vertices_by_place(database, level=0):
    """Height in quanta of every vertex by its place in quanta."""
    found = {}
    for module in database.levels[level].values():
        mesh = module.ground
        found.update(zip(zip(mesh.x.tolist(), mesh.y.tolist()), mesh.z.tolist()))
    return found


def edges_by_place(database, level=0):
    found = set()
    for module in database.levels[level].values():
        places = list(zip(module.ground.x.tolist(), module.ground.y.tolist()))
        for a, b, c in module.ground.triangles.tolist():
            found |= {frozenset((places[p], places[q])) for p, q in ((a, b), (b, c), (c, a))}
    return found


def feature_lines(database):
    """Faults of the lines that features.gpkg says are in the ground: each piece is an edge of triangles, as high as
    they are, and channels fall downstream on the triangles."""
    heights, edges, faults = vertices_by_place(database), edges_by_place(database), []
    far_x, far_y = database.columns * database.side, database.rows * database.side
    for feature, kind, _, role, points in lines(database):
        places = [tuple(round((metres - origin) * QUANTA) for metres, origin in zip(point, database.origin_m))
                  for point in points]
        told = [round(point[2] * QUANTA) if len(point) == 3 else None for point in points]
        for at, (one, other) in enumerate(zip(places, places[1:])):
            # Lines go on beyond the area, where there are no triangles.
            if all(0 <= x <= far_x and 0 <= y <= far_y for x, y in (one, other)):
                where = f"{kind} {feature}, {role} at {database.metres(*one)}"
                faults += piece_faults(where, role, (one, other), told[at : at + 2], (heights, edges))
    return faults


def piece_faults(name, role, ends, told, ground):
    """Faults of one piece of a line, with the heights that the file tells of its ends, in quanta."""
    heights, edges = ground
    lacking = [end for end in ends if end not in heights]
    for end in lacking:
        yield f"{name}: no vertex at its end"
    if lacking:
        return
    found = [heights[end] for end in ends]
    if any(said is not None and said != z for said, z in zip(told, found)):
        yield f"{name}: told {told} quanta, the ground has {found}"
    if frozenset(ends) not in edges:
        yield f"{name}: no edge of triangles"
    if role == "channel" and found[0] < found[1]:
        yield f"{name}: rises downstream by {(found[1] - found[0]) / QUANTA:.3f} m"


def rising_lines(database):
    """Faults of the middle lines of channels that load modules hold (version 3): they run downstream, and so does the
    ground under them wherever both ends of a piece are its vertices."""
    heights, faults = vertices_by_place(database), []
    for (row, column), module in database.levels[0].items():
        for line in module.lines:
            if line["kind"] != "channel":
                continue
            own = [(x + column * database.side, y + row * database.side, z) for x, y, z in line["vertices"]]
            for one, other in zip(own, own[1:]):
                ground = [heights.get(end[:2]) for end in (one, other)] if line["in_ground"] else [None]
                fall = [one[2] - other[2]] + ([ground[0] - ground[1]] if None not in ground else [])
                if min(fall) < 0:
                    faults.append(f"a channel rises by {-min(fall) / QUANTA:.3f} m at {database.metres(*one[:2])}")
    return faults


def walls(database, posts=None, height_m=2.0, others_m=25.0):
    """Faults of roads and railways built as strips: stretches beside which the ground stands like a wall, higher or
    lower by more than `height_m` a metre outside of the strip's edge. Near other lines and near ends nothing is said:
    what lies between two ways has to be as steep as they ask for. Nor is where posts, if they are given, stand steeper
    than 1 : 2 nearby, or the strip lies more than 10 m off them."""
    faults, placed = [], {}
    steep = steep_posts(posts, database.spacing, reach=30 * QUANTA) if posts is not None else None
    for (row, column), module in database.levels[0].items():
        corner = (column * database.side, row * database.side)
        placed[row, column] = [np.array([v[:2] for v in line["vertices"]], float) + corner for line in module.lines]
    for (row, column), module in database.levels[0].items():
        around = [placed.get((row + up, column + right), []) for up in (-1, 0, 1) for right in (-1, 0, 1)]
        for line, vertices in zip(module.lines, placed[row, column]):
            if line["form"] != "strip" or line["storey"] != "ground" or not line["in_ground"]:
                continue
            middles, across = along(vertices, 2 * QUANTA, 20 * QUANTA)
            if len(middles) == 0:
                continue
            is_alone = np.full(len(middles), True)
            if steep is not None:
                nearest = tuple((middles[:, ::-1] / database.spacing).round().astype(int).T)
                off = np.abs(heights_at(module.ground, *middles.T) - posts[nearest])
                is_alone = ~steep[nearest] & (off <= 10 * QUANTA)
            for other in (other for lines in around for other in lines if other is not vertices):
                is_alone &= others_m * QUANTA < distances(middles, other)
            for turn in (1, -1):
                asides = (line["width"] * 0.38, line["width"] / 2 + QUANTA)
                inner, outer = (heights_at(module.ground, *(middles + turn * across * aside).T) for aside in asides)
                steps = np.where(is_alone, np.abs(inner - outer), 0) / QUANTA
                worst = np.nanmax(steps, initial=0)
                if height_m < worst:
                    at = middles[np.nanargmax(steps)]
                    length = 2 * int((height_m < steps).sum())
                    faults.append(f"a wall of {worst:.2f} m beside a strip at {database.metres(*at)}, {length} m long")
    return faults


def steep_posts(posts, spacing, reach):
    """Posts that have others within `reach` between which the ground is steeper than 1 : 2, or is not known."""
    steep = np.zeros(posts.shape, bool)
    for axis in (0, 1):
        is_low = np.abs(np.diff(posts, axis=axis)) <= spacing / 2
        beside = np.insert(is_low, 0, True, axis=axis) & np.insert(is_low, is_low.shape[axis], True, axis=axis)
        steep |= ~beside
    cells = math.ceil(reach / spacing)
    for axis in (0, 1):
        grown = steep.copy()
        for shift in range(1, min(cells, steep.shape[axis] - 1) + 1):
            ahead, behind = [slice(None)] * 2, [slice(None)] * 2
            ahead[axis], behind[axis] = slice(shift, None), slice(None, -shift)
            grown[tuple(ahead)] |= steep[tuple(behind)]
            grown[tuple(behind)] |= steep[tuple(ahead)]
        steep = grown
    return steep


def along(line, step, ends):
    """Places along a line, `step` apart and `ends` or more away from its ends, and the directions to their left."""
    pieces = np.diff(line, axis=0)
    lengths = np.hypot(*pieces.T)
    before = np.concatenate([[0], np.cumsum(lengths)])
    wanted = np.arange(ends, before[-1] - ends, step)
    piece = np.clip(np.searchsorted(before, wanted, side="right") - 1, 0, len(pieces) - 1)
    ahead = pieces[piece] / lengths[piece][:, None]
    return line[piece] + ahead * (wanted - before[piece])[:, None], np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)


def distances(places, line):
    """How far places lie from a line at least."""
    least = np.full(len(places), np.inf)
    for a, b in zip(line, line[1:]):
        share = np.clip((places - a) @ (b - a) / max((b - a) @ (b - a), 1), 0, 1)
        least = np.minimum(least, np.hypot(*(places - a - share[:, None] * (b - a)).T))
    return least


def read_posts(path):
    """Posts of an Esri ASCII grid in quanta, from the south-west; NaN for a void."""
    lines = pathlib.Path(path).read_text().split("\n")
    header, rows = {}, []
    for line in lines:
        words = line.split()
        if len(words) == 2 and words[0][0].isalpha():
            header[words[0].lower()] = float(words[1])
        elif words:
            rows.append([float(word) for word in words])
    posts = np.array(rows)[::-1]
    posts[posts == header.get("nodata_value", -9999)] = np.nan
    return np.floor(posts * QUANTA + 0.5)


def judge(database, limits_of_job=None, posts=None, own_borders=False, exempt=None, water=("lake",)):
    """All faults that can be told from what is given."""
    faults = watertight(database, own_borders) + levels(database) + deck_cracks(database)
    if limits_of_job is not None:
        faults += limits(database, limits_of_job)
    if posts is not None:
        faults += beyond(database, posts, exempt).faults
    faults += uneven_lakes(database, water) + sunken_decks(database)
    return faults + feature_lines(database) + rising_lines(database) + walls(database, posts)


def heights_at(mesh, x, y):
    """Heights of a mesh at places, in quanta; NaN where it has none."""
    found = np.full(len(x), np.nan)
    for cx, cy, cz in zip(*mesh.corners()):
        near = (cx.min() <= x) & (x <= cx.max()) & (cy.min() <= y) & (y <= cy.max()) & np.isnan(found)
        if not near.any():
            continue
        px, py = x[near] - cx[0], y[near] - cy[0]
        ux, uy, vx, vy = cx[1] - cx[0], cy[1] - cy[0], cx[2] - cx[0], cy[2] - cy[0]
        area = ux * vy - uy * vx
        s, t = (px * vy - py * vx) / area, (ux * py - uy * px) / area
        held = (-1e-9 <= s) & (-1e-9 <= t) & (s + t <= 1 + 1e-9)
        found[np.flatnonzero(near)[held]] = (cz[0] + s * (cz[1] - cz[0]) + t * (cz[2] - cz[0]))[held]
    return found


def along_walls(rings, step=128.0):
    """Places along the edges of rings, a metre apart at most."""
    places = []
    for ring in rings:
        corners = np.array([corner[:2] for corner in ring], float)
        for a, b in zip(corners, np.roll(corners, -1, axis=0)):
            count = max(math.ceil(np.hypot(*(b - a)) / step), 1)
            places.append(a + np.arange(count)[:, None] / count * (b - a))
    return np.concatenate(places)


def standing(database, per_module, per_window):
    """What is wrong with objects, none of which hang in the air; limits in polygons of a load module and of 4 km."""
    faults, roofs, highest = [], {}, {}
    counts = np.zeros((database.rows, database.columns), int)
    for place, module in database.levels[0].items():
        others = [level[place].objects for level in database.levels[1:]]
        if any(other != module.objects for other in others):
            faults.append(f"load module {place}: levels have other objects")
        corner = np.array([place[1], place[0]]) * database.side
        for one in module.objects:
            counts[place] += object_polygons(one)
            if "rings" not in one:
                continue
            at = along_walls(one["rings"]) + corner
            grounds = [heights_at(level[place].ground, *at.T) for level in database.levels]
            low = min(np.nanmin(ground) for ground in grounds)
            if low + 1.5 < one["base"]:
                floats_m = (one["base"] - low) / QUANTA
                faults.append(f"load module {place}: {one['kind']} {one['id']:x} floats {floats_m} m")
            high = np.nanmax(grounds[0])
            highest[one["id"]] = max(high, highest.get(one["id"], -math.inf))
            roofs.setdefault(one["id"], set()).add((one["roof"], one["kind"]))
    for number, told in roofs.items():
        if len(told) > 1:
            faults.append(f"object {number:x} has several roofs or kinds: {sorted(told)}")
        elif min(roof for roof, _ in told) < highest[number]:
            faults.append(f"object {number:x} has a roof under the ground")
    if counts.max() > per_module:
        faults.append(f"{counts.max()} polygons of objects in a load module, the limit is {per_module}")
    most = windows(counts, database.side / QUANTA)
    if most > per_window:
        faults.append(f"{most} polygons of objects in 4 km, the limit is {per_window}")
    return faults


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("database", help="a finished database, such as ntc.tdb")
    arguments.add_argument("--posts", help="an Esri ASCII grid whose posts are those of the working grid")
    options = arguments.parse_args()
    try:
        database = Database.read(options.database)
    except (read_slm.Damaged, OSError) as error:
        print(f"{options.database}: {error}", file=sys.stderr)
        return 2
    posts = read_posts(options.posts) if options.posts else None
    faults = judge(database, posts=posts)
    if posts is not None and not lines(database):
        faults += residuals(database, posts)
    print("\n".join(faults + [""] if faults else []), end="")
    levels = [sum(len(module.ground.triangles) for module in level.values()) for level in database.levels]
    print(f"{len(faults)} faults; {levels} triangles by level, {len(database.levels[0])} load modules")
    over = decks(database)
    if over:
        area, under = sum(one.area_m2 for one in over), sum(one.under_m2 for one in over)
        least = ", ".join(f"{name} {height:.2f} m" for name, height in sorted(clearances(database).items()))
        print(f"decks: {area:.0f} m2, {under:.1f} m2 of it under the ground; least above {least}")
    bodies = [body for body in lakes(database) if body.level == 0]
    if bodies:
        spread = max(body.highest - body.lowest for body in bodies) / QUANTA
        print(f"lakes: {len(bodies)} bodies, largest spread {spread:.3f} m")
    if posts is not None:
        outside = beyond(database, posts)
        print(f"rms residual {rms_m(database, posts):.4f} m; {outside.outside} of {outside.counted} vertices outside"
              f" the posts about them, the farthest by {outside.largest_m:.2f} m")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
