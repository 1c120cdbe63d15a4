"""Checks of what stands on the ground and of ribbons over it: rays downwards through a glb, layers of a GeoPackage.

What is expected comes from scripts/read_slm.py alone, which was written from docs/FORMAT.md.
"""

from random import Random

import numpy

from exports.engines import Ground

RAYS = 10_000
RIBBON_M = 0.05


def inside(rings, x, y):
    """Whether a place lies inside an odd number of rings."""
    found = False
    for ring in rings:
        for (ax, ay), (bx, by) in zip(ring, [*ring[1:], ring[0]]):
            if (ay <= y) != (by <= y) and (x < ax + (y - ay) / (by - ay) * (bx - ax)):
                found = not found
    return found


class Things:
    """What stands in each load module, in metres from its corner."""

    def __init__(self, database):
        self.side, self.of = database.side, {}
        for place, module in database.modules.items():
            self.of[place] = module.get("objects", [])

    def all(self):
        return [(place, thing) for place, things in self.of.items() for thing in things]

    def top(self, x, y, ground):
        """The highest top over a place, and the kind of what has it."""
        place = (int(y // self.side), int(x // self.side))
        x, y = (x - place[1] * self.side) * 128, (y - place[0] * self.side) * 128
        best = (ground, None)
        for thing in self.of[place]:
            if "rings" in thing:
                rings = [[corner[:2] for corner in ring] for ring in thing["rings"]]
                if inside(rings, x, y):
                    best = max(best, (thing["roof"] / 128, thing["kind"]))
            else:
                corners = [[thing["places"][at] for at in triangle] for triangle in thing["triangles"]]
                if any(inside([ring], x, y) for ring in corners):
                    best = max(best, (ground + thing["height"] / 128, thing["kind"]))
        return best


def place_on(thing, random):
    """A place on an object, in quanta."""
    if "rings" in thing:
        ring = [corner[:2] for corner in thing["rings"][0]]
    else:
        ring = [thing["places"][at] for at in random.choice(thing["triangles"])]
    weights = [random.random() for _ in ring]
    return [sum(w * at[axis] for w, at in zip(weights, ring)) / sum(weights) for axis in (0, 1)]


def check_objects(database, arguments, scratch, tools):
    things = Things(database)
    every = things.all()
    if not every:
        raise tools.Skip("nothing stands on this ground")
    try:
        import geopandas
        import trimesh
    except ImportError as error:
        raise tools.Skip(error) from error
    path = tools.export(arguments, "glb", scratch / "objects.glb")
    scene = trimesh.load(path)
    ids = {(thing["kind"], thing["id"]) for _, thing in every}
    nodes = {name for name in scene.graph.nodes if name.rsplit("_", 1)[0] in {kind for kind, _ in ids}}
    expected = {f"{kind}_{number}" for kind, number in ids}
    tools.expect(expected <= nodes, f"a node for each of {len(expected)} objects")
    mesh = scene.to_geometry()
    mesh.apply_transform([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    check_rays(database, things, mesh, tools)
    gpkg = tools.export(arguments, "gpkg", scratch / "objects.gpkg")
    layers = {"buildings": ["building"], "points": ["tower"], "rows": ["row", "wall"],
              "woods": ["wood", "scrub", "orchard"]}
    for layer, kinds in layers.items():
        own = [key for key in ids if key[0] in kinds]
        if own:
            frame = geopandas.read_file(gpkg, layer=layer)
            valid = frame.geometry.is_valid.mean()
            tools.expect(len(frame) == len(own), f"{layer}: {len(frame)} features, {valid:.1%} of them valid")


def check_rays(database, things, mesh, tools):
    random, ground, every = Random(7), Ground(database), things.all()
    rays = []
    while len(rays) < RAYS:
        (row, col), thing = random.choice(every)
        x, y = place_on(thing, random)
        rays.append((col * database.side + x / 128, row * database.side + y / 128))
    high = mesh.bounds[1][2] + 10
    origins = numpy.array([(x, y, high) for x, y in rays])
    down = numpy.tile([0.0, 0.0, -1.0], (len(rays), 1))
    places, of_rays, _ = mesh.ray.intersects_location(origins, down)
    tops = numpy.full(len(rays), -numpy.inf)
    numpy.maximum.at(tops, of_rays, places[:, 2])
    near, ribbons, far = 0, 0, []
    for (x, y), found in zip(rays, tops):
        height, kind = things.top(x, y, ground.height(x, y))
        if abs(found - height) <= 0.01:
            near += 1
        elif kind is None and abs(found - height - RIBBON_M) <= 0.01:
            ribbons += 1
        else:
            far.append((x, y, found, height, kind))
    print(f"  {near} rays meet what is expected, {ribbons} a ribbon, farthest: {far[:3]}")
    tools.expect(len(far) <= len(rays) // 1000, f"{len(rays) - len(far)} of {len(rays)} rays within 1 cm")


CHECKS = [("objects", check_objects)]
