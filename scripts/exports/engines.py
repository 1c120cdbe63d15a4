"""Checks of what game engines and robot simulators load: OpenUSD, heightmaps, Gazebo, archives for globes, terrain for
web maps.

Each takes the database, the arguments, a scratch folder and the tools of check_exports.py: export, expect, Skip, datum.
"""

import csv
import hashlib
import io
import json
import math
import re
import shutil
import sqlite3
import struct
import subprocess
import xml.etree.ElementTree as xml
import zipfile
from random import Random

import numpy

RAYS = 10_000
HOLE = 255


class Ground:
    """The ground of a database at any place, from its load modules: x east, y north of the area's corner, in metres."""

    def __init__(self, database):
        self.side, self.modules = database.side, {}
        for place, module in database.modules.items():
            corners = numpy.array(module["vertices"], float)[numpy.array(module["triangles"])] / 128
            kept = numpy.array(module["classes"]) != HOLE
            self.modules[place] = corners[kept]
        self.wide, self.high = database.cols * self.side, database.rows * self.side

    def height(self, x, y):
        """The height at a place; None over a hole. On an edge all triangles say the same."""
        place = (min(int(y // self.side), int(self.high / self.side) - 1),
                 min(int(x // self.side), int(self.wide / self.side) - 1))
        corners = self.modules[place]
        if not len(corners):
            return None
        x, y = x - place[1] * self.side, y - place[0] * self.side
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        s = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (y - a[:, 1]) * (c[:, 0] - a[:, 0])) / area
        t = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])) / area
        inside = numpy.nonzero((s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9))[0]
        if not len(inside):
            return None
        i = inside[0]
        return a[i, 2] + s[i] * (b[i, 2] - a[i, 2]) + t[i] * (c[i, 2] - a[i, 2])


def classes_at(database, x, y):
    """Classes of the triangles that have a place in metres from the corner of the area, on their edges too."""
    place = (min(int(y // database.side), database.rows - 1), min(int(x // database.side), database.cols - 1))
    module, found = database.modules[place], set()
    px, py = 128 * (x - place[1] * database.side), 128 * (y - place[0] * database.side)
    for triangle, number in zip(module["triangles"], module["classes"]):
        (ax, ay, _), (bx, by, _), (cx, cy, _) = (module["vertices"][v] for v in triangle)
        if min((bx - ax) * (py - ay) - (by - ay) * (px - ax), (cx - bx) * (py - by) - (cy - by) * (px - bx),
               (ax - cx) * (py - cy) - (ay - cy) * (px - cx)) >= -1e-3:
            found.add(number)
    return found


def check_usd(database, arguments, scratch, tools):
    folder = tools.export(arguments, "usd", scratch / "usd")
    try:
        from pxr import Gf, Usd, UsdGeom, UsdPhysics
    except ImportError as error:
        raise tools.Skip(error) from error
    paths = [folder / "area.usda", *sorted((folder / "tiles").glob("*.usda"))]
    said, count = [], len(paths)
    for path in paths:
        said += complaints(path)
    tools.expect(not said, f"the validators of usd-core have nothing to say of {count} files {said[:3]}")
    stage = Usd.Stage.Open(str(folder / "area.usda"))
    tools.expect(UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1, "z up, in metres")
    tools.expect(stage.GetDefaultPrim().IsValid(), f"the stage has a default prim, {stage.GetDefaultPrim().GetName()}")
    places, decks, counts, meshes = set(), set(), {False: 0, True: 0}, []
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        mesh, is_deck = UsdGeom.Mesh(prim), prim.GetName() == "decks"
        move = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        points = [move.Transform(Gf.Vec3d(*point)) for point in mesh.GetPointsAttr().Get()]
        faces = list(mesh.GetFaceVertexIndicesAttr().Get())
        (decks if is_deck else places).update(tuple(point) for point in points)
        counts[is_deck] += len(faces) // 3
        approximation = UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get()
        tools.expect(prim.HasAPI(UsdPhysics.CollisionAPI) and approximation == "none", f"{prim.GetPath()} collides") \
            if not meshes else None
        subsets = UsdGeom.Subset.GetAllGeomSubsets(mesh)
        held = sorted(face for subset in subsets for face in subset.GetIndicesAttr().Get())
        if held != list(range(len(faces) // 3)):
            tools.expect(False, f"{prim.GetPath()}: its subsets are no partition")
        if not is_deck:
            meshes.append((points, faces))
    tools.expect(places == database.places, f"{len(places)} points, each where the TIN has it, to the last digit")
    tools.expect(decks == database.deck_places, f"{len(decks)} points of decks likewise")
    tools.expect(counts == {False: database.ground, True: database.decks}, f"triangles {counts}")
    rays(database, meshes, tools)
    shutil.rmtree(folder)


def complaints(path):
    """What usd-core's compliance checker finds; later versions have validators in its place."""
    from pxr import Usd, UsdUtils
    if hasattr(UsdUtils, "ComplianceChecker"):
        checker = UsdUtils.ComplianceChecker(arkit=False, skipARKitRootLayerCheck=True)
        checker.CheckCompliance(str(path))
        return checker.GetErrors() + checker.GetFailedChecks() + checker.GetWarnings()
    from pxr import UsdValidation
    # Those for ARKit's packages ask for another kind of file.
    validators = [validator for validator in UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
                  if "UsdzValidators" not in validator.GetMetadata().GetKeywords()]
    found = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))
    return [f"{path.name}: {error.GetErrorAsString()}" for error in found]


def rays(database, meshes, tools):
    """Rays cast downwards in MuJoCo meet the ground where the TIN has it."""
    try:
        import mujoco
    except ImportError as error:
        raise tools.Skip(error) from error
    ground, random = Ground(database), Random(1)
    spec = mujoco.MjSpec()
    for number, (points, faces) in enumerate(meshes):
        flat = numpy.array(points, float).ravel()
        shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.add_mesh(name=f"m{number}", uservert=flat, userface=faces, inertia=shell)
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"m{number}")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    top = max(z for _, _, z in database.places) + 100
    missed, on_edges, worst, wrong, hit = 0, 0, 0.0, 0, numpy.zeros(1, numpy.int32)
    beside_m = [(east, north) for east in (1e-3, -1e-3) for north in (1e-3, -1e-3)]
    on_sides = numpy.linspace(0, ground.wide, database.cols + 1)

    def cast(x, y):
        return mujoco.mj_ray(model, data, [x, y, top], [0.0, 0.0, -1.0], None, 1, -1, hit, None)

    for number in range(RAYS):
        x, y = random.uniform(0, ground.wide), random.uniform(0, ground.high)
        # One in ten straight down a side of load modules.
        if number % 10 == 0:
            x = float(on_sides[1 + number // 10 % max(1, database.cols - 1)])
        expected = ground.height(x, y)
        found = cast(x, y)
        if expected is None:
            # At the edge of a hole a millimetre decides.
            wrong += found >= 0 and all(ground.height(x + east, y + north) is None for east, north in beside_m)
        elif found < 0:
            # MuJoCo turns each mesh into axes of its own in 32 bits, so that a ray exactly on a side between two may
            # pass; a millimetre beside it none must.
            beside = [cast(x + east, y + north) for east, north in beside_m]
            on_edges += 1
            missed += min(beside) < 0
        else:
            worst = max(worst, abs(top - found - expected))
    tools.expect(missed == 0 and wrong == 0, f"MuJoCo: none of {RAYS} rays falls through ({missed}; {on_edges} on a "
                                           "side were cast again beside it), holes are open")
    tools.expect(worst < 0.01, f"MuJoCo: heights agree to {1000 * worst:.2f} mm")


def check_heightmap(database, arguments, scratch, tools):
    try:
        import rasterio
    except ImportError as error:
        raise tools.Skip(error) from error

    def pixels(path):
        with rasterio.open(path) as source:
            return source.read(1)

    ground = Ground(database)
    for engine, sizes in [("unreal", [505, 2017]), ("unity", [129, 1025])]:
        for size in sizes:
            folder = scratch / f"{engine}_{size}"
            tools.export(arguments, "heightmap", folder, "--engine", engine, "--size", str(size))
            about = json.loads((folder / "heightmap.json").read_text())
            tiles = {}
            for name in about["tiles"]:
                # By column from the west and row from the south, the southern row first.
                place, values = tile_place(about, name), None
                if engine == "unreal":
                    values = pixels(folder / name)[::-1]
                else:
                    values = numpy.fromfile(folder / name, "<u2").reshape(size, size)
                if values.shape != (size, size) or values.dtype != numpy.uint16:
                    tools.expect(False, f"{name} has 16 bits and {size} samples a side")
                tiles[place] = values
            raster = joined(tiles, tools, f"{engine} {size}")
            check_samples(about, raster, ground, tools, f"{engine} {size}")
            check_import(about, raster, ground, tools)
            if "weights" in about:
                layers = about["weights"]["layers"]
                weights = {layer["class"]: joined({tile_place(about, name): pixels(folder / name)[::-1]
                                                   for name in layer["files"]}, tools, layer["class"])
                           for layer in layers}
                check_weights(database, about, weights, tools, f"{engine} {size}")
            check_placements(database, about, folder, ground, tools)
            shutil.rmtree(folder)


def tile_place(about, name):
    """Column from the west and row from the south of a tile, by its name."""
    x, y = (int(part[1:]) for part in name.rsplit(".", 1)[0].split("_")[-2:])
    tiles = round((about["samples"][1] - 1) / (about["samples_a_side"] - 1))
    return (x, tiles - 1 - y) if about["engine"] == "unreal" else (x, y)


def joined(tiles, tools, what):
    """One raster of all tiles, which share the samples on their borders."""
    same = all((tile[:, -1] == tiles[x + 1, y][:, 0]).all() for (x, y), tile in tiles.items() if (x + 1, y) in tiles)
    same &= all((tile[-1] == tiles[x, y + 1][0]).all() for (x, y), tile in tiles.items() if (x, y + 1) in tiles)
    if not same:
        tools.expect(False, f"{what}: {len(tiles)} tiles share their border rows, bit by bit")
    rows = []
    for y in range(max(y for _, y in tiles) + 1):
        row = [tiles[x, y] if x == 0 else tiles[x, y][:, 1:] for x in range(max(x for x, _ in tiles) + 1)]
        rows.append(numpy.hstack(row) if y == 0 else numpy.hstack(row)[1:])
    return numpy.vstack(rows)


def check_samples(about, raster, ground, tools, what):
    """Samples divide the area from border to border; each is within half a step of the ground under it."""
    random, worst = Random(2), 0.0
    high, wide = raster.shape
    spacing = about["spacing_m"]
    whole = [spacing[0] * (wide - 1), spacing[1] * (high - 1)]
    fits = abs(whole[0] - ground.wide) < 1e-6 and abs(whole[1] - ground.high) < 1e-6
    fits &= [wide, high] == about["samples"]
    fits &= max(spacing) <= about["spacing_of_posts_m"] + 1e-9
    tools.expect(fits, f"{what}: {wide} x {high} samples, {spacing[0]:.3f} x {spacing[1]:.3f} m apart, fill the area")
    places = [(random.randrange(wide), random.randrange(high)) for _ in range(2000)]
    places += [(0, 0), (wide - 1, 0), (0, high - 1), (wide - 1, high - 1)]
    for col, row in places:
        expected = ground.height(col * spacing[0], row * spacing[1])
        if expected is not None:
            worst = max(worst, abs(about["lowest_m"] + float(raster[row, col]) * about["step_m"] - expected))
    half = about["step_m"] / 2
    tools.expect(worst <= half + 1e-6, f"{what}: {1000 * worst:.2f} mm off, half a step is {1000 * half:.2f} mm")
    # At posts, along straight lines between samples: at all of them where they are few, so that the RMS is that told.
    post, off = about["spacing_of_posts_m"], []
    cols, rows = (round(length / post) + 1 for length in (ground.wide, ground.high))
    is_small = cols * rows < 40_000
    posts = [(col, row) for col in range(cols) for row in range(rows)] if is_small else [
        (random.randrange(cols), random.randrange(rows)) for _ in range(2000)]
    for x, y in ((col * post, row * post) for col, row in posts):
        expected = ground.height(x, y)
        if expected is not None:
            col, row = min(int(x / spacing[0]), wide - 2), min(int(y / spacing[1]), high - 2)
            u, v = x / spacing[0] - col, y / spacing[1] - row
            (a, b), (c, d) = raster[row:row + 2, col:col + 2].astype(float)
            height = (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v
            off.append(abs(about["lowest_m"] + height * about["step_m"] - expected))
    told = about["off_at_posts_m"]
    rms = float(numpy.sqrt(numpy.mean(numpy.square(off))))
    holds = max(off) <= told["max"] + 1e-6
    holds &= not is_small or about["hole_samples"] > 0 or abs(rms - told["rms"]) <= 1e-3 * told["rms"]
    tools.expect(holds, f"{what}: at posts {max(off):.3f} m off at most, {rms:.4f} m RMS; told {told}")


def check_weights(database, about, weights, tools, what):
    """A weight is 255 where the triangle under a sample is of the class, and all weights of a sample add up to that."""
    names = [one["name"] for one in database.report["classes"] if one["name"] != "hole"]
    total = sum(layer.astype(int) for layer in weights.values())
    tools.expect((total == 255).all(), f"{what}: weights of {', '.join(weights)} add up to 255")
    random, wrong = Random(3), 0
    high, wide = total.shape
    for _ in range(500):
        col, row = random.randrange(wide), random.randrange(high)
        there = classes_at(database, col * about["spacing_m"][0], row * about["spacing_m"][1])
        words = {"hole" if number == HOLE else names[number] if len(names) > 1 else f"class_{number}"
                 for number in there}
        found = [name for name, layer in weights.items() if layer[row, col] == 255]
        wrong += len(found) != 1 or found[0] not in {re.sub(r"[^A-Za-z0-9_.-]", "_", word) for word in words}
    tools.expect(wrong == 0, f"{what}: 500 weights are those of the triangles under them ({wrong} are not)")


def check_placements(database, about, folder, ground, tools):
    """Each object has a placement whose rectangle is around all of its corners, in the area."""
    expected = {}
    for (row, col), module in database.modules.items():
        for thing in module.get("objects", []):
            places = [place for ring in thing.get("rings", []) for place in ring] + thing.get("places", [])
            corners = [(col * database.side + x / 128, row * database.side + y / 128) for x, y, *_ in places]
            expected.setdefault((thing["kind"], thing["id"]), []).extend(corners)
    path = folder / "objects.csv"
    if not path.exists():
        tools.expect(not expected, "no object, no placements")
        return
    rows = list(csv.DictReader(path.open()))
    outside, unit = 0, 100 if about["engine"] == "unreal" else 1
    for line in rows:
        number = {name: float(line[name]) / unit for name in ("x", "y", "z", "length", "width")}
        if about["engine"] == "unreal":
            x, y = number["x"] + ground.wide / 2, ground.high / 2 - number["y"]
            east = -math.radians(float(line["heading"]))
        else:
            x, y, east = number["x"], number["z"], math.radians(90 - float(line["heading"]))
        for corner_x, corner_y in expected.get((line["class"], int(line["id"])), []):
            u = (corner_x - x) * math.cos(east) + (corner_y - y) * math.sin(east)
            v = (corner_y - y) * math.cos(east) - (corner_x - x) * math.sin(east)
            outside += abs(u) > number["length"] / 2 + 0.02 or abs(v) > number["width"] / 2 + 0.02
    told = [(line["class"], int(line["id"])) for line in rows]
    holds = outside == 0 and sorted(expected) == sorted(told)
    tools.expect(holds, f"{len(rows)} placements, around all corners ({outside} not)")


def check_import(about, raster, ground, tools):
    """The numbers of the dialog give places and heights back by the engines' own formulas."""
    dialog, size = about["import"], about["samples_a_side"]
    high, wide = raster.shape
    for value in [0, 12345, 65535]:
        height = about["lowest_m"] + value * about["step_m"]
        if about["engine"] == "unreal":
            found = ((value - 32768) / 128 * dialog["Scale"]["Z"] + dialog["Location"]["Z"]) / 100
        else:
            found = dialog["Position"]["Y"] + value / 65536 * dialog["Terrain Size"]["Y"]
        if abs(found - height) > 1e-6:
            tools.expect(False, f"the dialog's numbers give {found} where the ground is {height}")
    if about["engine"] == "unreal":
        quads = int(dialog["Section Size"].split("x")[0])
        whole = dialog["Number of Components"][0] * quads * int(dialog["Sections Per Component"][0]) + 1
        lengths = [dialog["Scale"]["X"] / 100 * (wide - 1), dialog["Scale"]["Y"] / 100 * (high - 1)]
        sound = whole == size and dialog["Overall Resolution"] == [size, size]
    else:
        tiles = [(wide - 1) // (size - 1), (high - 1) // (size - 1)]
        lengths = [dialog["Terrain Size"]["X"] * tiles[0], dialog["Terrain Size"]["Z"] * tiles[1]]
        sound = dialog["Resolution"] == size
    sound &= abs(lengths[0] - ground.wide) < 1e-6 and abs(lengths[1] - ground.high) < 1e-6
    tools.expect(sound, f"the dialog's numbers make {lengths[0]:.3f} x {lengths[1]:.3f} m of {wide} x {high} samples")


SDF_PROGRAM = """
#include <iostream>
#include <sdf/sdf.hh>
int main(int, char **names) {
  sdf::Root root;
  auto errors = root.Load(names[1]);
  for (const auto &error : errors) std::cout << error << "\\n";
  if (!errors.empty() || root.WorldCount() != 1) return 1;
  std::cout << root.WorldByIndex(0)->ModelCount() << "\\n";
}
"""


def check_gazebo(database, arguments, scratch, tools):
    folder = tools.export(arguments, "gazebo", scratch / "gazebo")
    places, faces, models = set(), 0, 0
    world = xml.parse(folder / "area.sdf").getroot().find("world")
    for model in world.findall("model"):
        uri = model.find("link/collision/geometry/mesh/uri")
        if uri is None:
            continue
        models += 1
        east, north = (float(part) for part in model.find("pose").text.split()[:2])
        for line in (folder / uri.text).read_text().splitlines():
            if line.startswith("v "):
                x, y, z = (float(part) for part in line.split()[1:])
                places.add((x + east, y + north, z))
            faces += line.startswith("f ")
    tools.expect(places == database.places | database.deck_places, f"{len(places)} vertices, each where the TIN has it")
    tools.expect(faces == database.ground + database.decks, f"{faces} triangles in {models} models")
    [plugin] = [plugin for plugin in world.findall("plugin") if plugin.get("name") == "gz::sim"]
    levels = {level.find("ref").text for level in plugin.findall("level")}
    names = {model.get("name") for model in world.findall("model")} - {"observer"}
    tools.expect(levels == names and plugin.find("performer") is not None, "a level for each model, and a performer")
    source, program = scratch / "sdf.cpp", scratch / "sdf"
    source.write_text(SDF_PROGRAM)
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "sdformat12"], capture_output=True, text=True)
    if flags.returncode != 0:
        raise tools.Skip("no libsdformat-dev")
    subprocess.run(["c++", "-std=c++17", str(source), "-o", str(program), *flags.stdout.split()], check=True)
    ran = subprocess.run([str(program), str(folder / "area.sdf")], capture_output=True, text=True)
    said = ran.stdout.split()
    tools.expect(ran.returncode == 0 and said == [str(models + 1)], f"sdformat reads {said[:30]} models")
    shutil.rmtree(folder)


def check_3tz(database, arguments, scratch, tools):
    folder = tools.export(arguments, "3dtiles", scratch / "of_3tz", *tools.datum(database))
    path = tools.export(arguments, "3tz", scratch / "tiles.3tz", *tools.datum(database))
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        has_all = names[-1] == "@3dtilesIndex1@" and set(names[:-1]) == set(files)
        tools.expect(has_all, f"{len(files)} files, then an index")
        tools.expect(all(archive.read(name) == data for name, data in files.items()), "each as in the folder")
        index = archive.read(names[-1])
        starts = {info.filename: info.header_offset for info in archive.infolist()}
    entries = [(index[at:at + 16], struct.unpack_from("<Q", index, at + 16)[0]) for at in range(0, len(index), 24)]
    order = [struct.unpack("<QQ", sum) for sum, _ in entries]
    tools.expect(order == sorted(order) and dict(entries) == {
        hashlib.md5(name.encode()).digest(): starts[name] for name in files}, "the index finds every file")
    if arguments.node_modules:
        out = scratch / "unpacked"
        command = ["npx", "3d-tiles-tools", "convert", "-i", str(path), "-o", str(out)]
        ran = subprocess.run(command, cwd=arguments.node_modules, capture_output=True, text=True)
        same = ran.returncode == 0 and all((out / name).read_bytes() == data for name, data in files.items()
                                           if name != "tileset.json")
        tools.expect(same, f"3d-tiles-tools unpacks it to the same files {ran.stderr[-300:]}")
    shutil.rmtree(folder)


def check_mbtiles(database, arguments, scratch, tools):
    folder = tools.export(arguments, "quantized-mesh", scratch / "of_mbtiles", *tools.datum(database))
    path = tools.export(arguments, "mbtiles", scratch / "terrain.mbtiles", *tools.datum(database))
    with sqlite3.connect(path) as package:
        rows = list(package.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles"))
        about = dict(package.execute("SELECT name, value FROM metadata"))
        sound = package.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    same = all((folder / f"{z}/{x}/{y}.terrain").read_bytes() == data for z, x, y, data in rows)
    count = sum(1 for _ in folder.rglob("*.terrain"))
    tools.expect(sound and same and len(rows) == count, f"{len(rows)} tiles, each as in the folder")
    layer = json.loads((folder / "layer.json").read_text())
    is_told = json.loads(about["json"]) == layer and int(about["maxzoom"]) == layer["maxzoom"]
    tools.expect(is_told, "layer.json is in it")
    shutil.rmtree(folder)


def check_terrain_rgb(database, arguments, scratch, tools):
    """Tiles of web maps, by pmtiles, SQLite and Pillow: pixels have the height of the ground at their middles."""
    try:
        import pyproj
        from PIL import Image
        from pmtiles.reader import MmapSource, Reader, all_tiles
    except ImportError as error:
        raise tools.Skip(error) from error
    ground, random = Ground(database), Random(4)
    to = pyproj.Transformer.from_crs(4326, database.manifest["area"]["crs"], always_xy=True)
    for encoding, size in [("mapbox", 512), ("terrarium", 256)]:
        words = ["--encoding", encoding, "--size", str(size)]
        packed = tools.export(arguments, "terrain-rgb", scratch / f"{encoding}.pmtiles", *words)
        package = tools.export(arguments, "terrain-rgb", scratch / f"{encoding}.mbtiles", *words)
        with packed.open("rb") as file:
            source = MmapSource(file)
            about, header = Reader(source).metadata(), Reader(source).header()
            tiles = {place: bytes(data) for place, data in all_tiles(source)}
        with sqlite3.connect(package) as connection:
            rows = connection.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles")
            same = {(z, x, 2**z - 1 - y): data for z, x, y, data in rows} == tiles
            told = dict(connection.execute("SELECT name, value FROM metadata"))
        levels = {z for z, _, _ in tiles}
        holds = levels == set(range(header["min_zoom"], header["max_zoom"] + 1)) and about["encoding"] == encoding
        holds &= told["encoding"] == encoding and int(told["maxzoom"]) == header["max_zoom"]
        tools.expect(same and holds, f"{encoding}: {len(tiles)} tiles at levels {min(levels)} to {max(levels)}, "
                                     "the same in both files")
        worst, seen, outside, wrong = 0.0, 0, 0, 0
        for (z, x, y), data in tiles.items():
            image = numpy.array(Image.open(io.BytesIO(data)))
            if image.shape != (size, size, 3):
                tools.expect(False, f"{z}/{x}/{y} has {size} pixels a side, and three colours")
            for _ in range(1 + 3000 // len(tiles)):
                col, row = random.randrange(size), random.randrange(size)
                red, green, blue = (int(part) for part in image[row, col])
                if encoding == "mapbox":
                    found = -10000 + 0.1 * (65536 * red + 256 * green + blue)
                else:
                    found = 256 * red + green + blue / 256 - 32768
                longitude = (x + (col + 0.5) / size) / 2**z * 360 - 180
                latitude = math.degrees(math.atan(math.sinh(math.pi * (1 - 2 * (y + (row + 0.5) / size) / 2**z))))
                east, north = (a - b for a, b in zip(to.transform(longitude, latitude), database.origin))
                inside = 0 <= east <= ground.wide and 0 <= north <= ground.high
                expected = ground.height(east, north) if inside else None
                if expected is None:
                    outside, wrong = outside + 1, wrong + (abs(found) > 1e-6)
                else:
                    seen, worst = seen + 1, max(worst, abs(found - expected))
        half = 0.05 if encoding == "mapbox" else 0.5 / 256
        # The places of PROJ and ours differ by less than a millimetre; on ground that steep by as much.
        tools.expect(worst <= half + 0.003, f"{encoding}: {seen} pixels within {worst:.4f} m, half a step is {half} m")
        tools.expect(wrong == 0, f"{encoding}: {outside} pixels outside or over holes are 0 m high ({wrong} are not)")
        packed.unlink()
        package.unlink()


CHECKS = [
    ("usd", check_usd),
    ("heightmap", check_heightmap),
    ("gazebo", check_gazebo),
    ("3tz", check_3tz),
    ("mbtiles", check_mbtiles),
    ("terrain-rgb", check_terrain_rgb),
]
