#!/usr/bin/env python3
"""Asks a database for lines of sight past objects, and a ray caster that knows only its `.slm` files for the same.

    python3 scripts/judge_sight.py mine.tdb [--lines 20000] [--wood-lines 1000]

The caster is Embree, by trimesh; what it casts at are triangles of the ground, decks, walls and roofs read by
FORMAT.md. Metres inside woods are counted by small steps. Lines that a centimetre up or down would change are ties.
Needs the Python package of this project, NumPy, shapely, trimesh and embreex. Exit codes: 0 all agree but
ties, 1 some do not.
"""

import argparse
import pathlib
import sys

import numpy as np
import shapely
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

import read_slm
import tiefort

QUANTA = 128.0
TIE_M = 0.01
REACH_M = 1000.0
STEP_M = 0.25


class Scene:
    """What stands in load modules, in metres from the first one's corner."""

    def __init__(self, folder):
        self.prisms, self.canopies, corners = [], [], []
        first = None
        for file in sorted((pathlib.Path(folder) / "modules").glob("*.slm")):
            header, parts = read_slm.parse(file.read_bytes())
            first = first or header
            for part in parts:
                if part["level"] == 0:
                    self.add(part, header["side"], corners)
        self.origin = np.array(first["origin_m"])
        triangles = np.concatenate(corners)
        # The middle of the area, so that single precision tells centimetres apart.
        self.middle = triangles.reshape(-1, 3).mean(axis=0)
        self.ground = self.caster(np.concatenate(self.ground_only))
        self.all = self.caster(triangles)
        self.tree = shapely.STRtree([plan for plan, *_ in self.canopies])
        self.buildings = shapely.STRtree([plan for plan in self.prisms])

    ground_only = []

    def add(self, part, side, corners):
        shift = np.array([part["column"] * side, part["row"] * side, 0.0])
        for mesh in (part, part.get("decks")):
            if mesh and mesh["triangles"]:
                places = (np.array(mesh["vertices"], float) + shift) / QUANTA
                found = places[np.array(mesh["triangles"])]
                corners.append(found)
                if mesh is part:
                    self.ground_only.append(found)
        for one in part.get("objects", []):
            if "rings" in one:
                self.add_prism(one, shift, corners)
            else:
                plan = np.array(one["places"], float) + shift[:2]
                pieces = shapely.polygons((plan / QUANTA)[np.array(one["triangles"])])
                taken = -np.log(1 - one["fullness"] / 100) / 10
                self.canopies.append((shapely.union_all(pieces), one["height"] / QUANTA, taken))

    def add_prism(self, prism, shift, corners):
        base, roof = prism["base"] / QUANTA, prism["roof"] / QUANTA
        rings = [(np.array([corner[:2] for corner in ring], float) + shift[:2]) / QUANTA for ring in prism["rings"]]
        for ring, marks in zip(rings, prism["rings"]):
            for number, corner in enumerate(marks):
                if corner[2]:
                    a, b = ring[number], ring[(number + 1) % len(ring)]
                    low_a, low_b, top_a, top_b = [*a, base], [*b, base], [*a, roof], [*b, roof]
                    corners.append(np.array([[low_a, low_b, top_b], [low_a, top_b, top_a]]))
        plan = shapely.Polygon(rings[0], rings[1:])
        self.prisms.append(plan)
        for piece in shapely.constrained_delaunay_triangles(plan).geoms:
            places = np.array(piece.exterior.coords)[:3]
            for height in (roof, base):
                corners.append(np.column_stack([places, np.full(3, height)])[None])

    def caster(self, triangles):
        mesh = trimesh.Trimesh((triangles - self.middle).reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3),
                               process=False)
        return RayMeshIntersector(mesh, scale_to_box=False)

    def heights(self, places):
        top = np.column_stack([places - self.middle[:2], np.full(len(places), 1e4)])
        found, rays, _ = self.ground.intersects_location(top, np.tile([0, 0, -1.0], (len(places), 1)), False)
        heights = np.full(len(places), np.nan)
        heights[rays] = found[:, 2] + self.middle[2]
        return heights

    def shares(self, lines):
        """How far along each line something is hit; 2 where nothing is."""
        from_, to = lines[:, :3] - self.middle, lines[:, 3:] - self.middle
        length = np.linalg.norm(to - from_, axis=1)
        hits, rays, _ = self.all.intersects_location(from_, (to - from_) / length[:, None], multiple_hits=False)
        share = np.full(len(lines), 2.0)
        share[rays] = np.linalg.norm(hits - from_[rays], axis=1) / length[rays]
        share[share > 1 - 1e-9] = 2.0
        return share

    def lost(self, line):
        """The logarithm of the light that woods take along a line."""
        length = np.linalg.norm(line[3:] - line[:3])
        count = max(int(length / STEP_M), 1)
        places = line[:3] + (np.arange(count)[:, None] + 0.5) / count * (line[3:] - line[:3])
        heights = self.heights(places[:, :2])
        lost = 0.0
        for number in self.tree.query(shapely.LineString(line.reshape(2, 3)[:, :2])):
            plan, high, taken = self.canopies[number]
            under = (places[:, 2] < heights + high) & shapely.contains_xy(plan, places[:, :2])
            lost += taken * under.sum() * length / count
        return lost


def draw_lines(scene, database, count, random):
    """Lines between places 2 to 20 m above the ground, near buildings and outside of them."""
    plans = np.array(scene.prisms)
    lines = np.empty((0, 6))
    while len(lines) < count:
        near = np.array([plan.exterior.coords[0] for plan in random.choice(plans, count)])
        eyes = near + random.uniform(-60, 60, near.shape)
        ends = eyes + random.uniform(-REACH_M, REACH_M, near.shape)
        wide = np.array(database.bounds).reshape(2, 2) - scene.origin
        inside = np.all((wide[0] < eyes) & (eyes < wide[1]) & (wide[0] < ends) & (ends < wide[1]), axis=1)
        eyes, ends = eyes[inside], ends[inside]
        free = [not len(scene.buildings.query(shapely.Point(end), predicate="intersects")) for end in [*eyes, *ends]]
        free = np.array(free).reshape(2, -1).all(axis=0)
        eyes, ends = eyes[free], ends[free]
        up = np.where(random.random((2, len(eyes))) < 0.7, 2.0, random.uniform(2, 20, (2, len(eyes))))
        eyes = np.column_stack([eyes, scene.heights(eyes) + up[0]])
        ends = np.column_stack([ends, scene.heights(ends) + up[1]])
        lines = np.concatenate([lines, np.column_stack([eyes, ends])])
    return lines[:count]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("database")
    parser.add_argument("--lines", type=int, default=20_000)
    parser.add_argument("--wood-lines", type=int, default=1_000)
    arguments = parser.parse_args()
    scene, random = Scene(arguments.database), np.random.default_rng(1)
    shift = np.tile([*scene.origin, 0.0], 2)
    with tiefort.open(arguments.database) as database:
        lines = draw_lines(scene, database, arguments.lines, random)
        ours = database.line_of_sight(lines[:, :3] + shift[:3], lines[:, 3:] + shift[3:], absolute=True,
                                      objects="buildings")
        theirs = scene.shares(lines)
        run = np.linalg.norm(lines[:, 3:] - lines[:, :3], axis=1)
        at = np.linalg.norm(ours.blocker - (lines + shift)[:, :3], axis=1)
        same = ours.visible == (theirs == 2)
        # The ground hides from an edge of it on; buildings where the line goes in.
        hidden = same & (ours.hidden_by == "building")
        place = np.abs(at[hidden] - (theirs * run)[hidden])
        up = np.array([0, 0, TIE_M, 0, 0, TIE_M])
        ties = (scene.shares(lines + up) == 2) != (scene.shares(lines - up) == 2)
        wrong = ~same & ~ties
        print(f"{len(lines)} lines: {ours.visible.sum()} visible, {(ours.hidden_by == 'building').sum()} hidden by "
              f"buildings, {(ours.hidden_by == 'row').sum()} by walls, {(ours.hidden_by == 'deck').sum()} by decks; "
              f"{same.sum()} agree, {(~same & ties).sum()} ties, {wrong.sum()} differ")
        print(f"places where buildings end them: 99 % within {np.quantile(place, 0.99):.3f} m, "
              f"{(place > 0.1).sum()} of {len(place)} more than 0.1 m apart")
        for line in lines[wrong][:5] + shift:
            print("differs:", *np.round(line, 3))
        free = np.flatnonzero(ours.visible)[: arguments.wood_lines]
        woods = database.line_of_sight(lines[free, :3] + shift[:3], lines[free, 3:] + shift[3:], absolute=True)
        lost = np.array([scene.lost(line) for line in lines[free]])
        off = np.abs(-np.log(np.maximum(woods.transmission, 1e-300)) - lost)
        bad = off > 0.1 + 0.02 * lost
        print(f"{len(free)} lines past woods: {(lost > 0).sum()} touch some, {bad.sum()} of another transmission")
    return 1 if wrong.any() or bad.any() else 0


if __name__ == "__main__":
    sys.exit(main())
