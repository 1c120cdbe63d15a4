"""Checks of what game engines and robot simulators load: OpenUSD, heightmaps, Gazebo, archives for globes.

Each takes the database, the arguments, a scratch folder and the tools of check_exports.py: export, expect, Skip, datum.
"""

import hashlib
import json
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
    ground, random = Ground(database), Random(2)
    for engine, sizes in [("unreal", [505, 2017]), ("unity", [129, 1025])]:
        for size in sizes:
            folder = scratch / f"{engine}_{size}"
            tools.export(arguments, "heightmap", folder, "--engine", engine, "--size", str(size))
            about = json.loads((folder / "heightmap.json").read_text())
            tiles = {}
            for name in about["tiles"]:
                x, y = (int(part[1:]) for part in name.rsplit(".", 1)[0].split("_")[-2:])
                if engine == "unreal":
                    with rasterio.open(folder / name) as source:
                        tiles[x, y] = source.read(1)
                        sound = source.dtypes == ("uint16",) and source.shape == (size, size)
                else:
                    values = numpy.fromfile(folder / name, "<u2")
                    sound = values.size == size * size
                    tiles[x, y] = values.reshape(size, size)
                if not sound:
                    tools.expect(False, f"{name} has 16 bits and {size} samples a side")
            same = all((tile[:, -1] == tiles[x + 1, y][:, 0]).all() for (x, y), tile in tiles.items()
                       if (x + 1, y) in tiles)
            same &= all((tile[-1] == tiles[x, y + 1][0]).all() for (x, y), tile in tiles.items() if (x, y + 1) in tiles)
            tools.expect(same, f"{engine} {size}: {len(tiles)} tiles share their border rows, bit by bit")
            spacing, worst = about["spacing_m"], 0.0
            cols, rows = (round(length / spacing) for length in (ground.wide, ground.high))
            places = [(random.randrange(cols + 1), random.randrange(rows + 1)) for _ in range(2000)]
            for col, row in places:
                line = rows - row if engine == "unreal" else row
                x, y = min(col // (size - 1), max(tiles)[0]), min(line // (size - 1), max(y for _, y in tiles))
                value = tiles[x, y][line - y * (size - 1), col - x * (size - 1)]
                expected = ground.height(col * spacing, row * spacing)
                if expected is not None:
                    worst = max(worst, abs(about["lowest_m"] + float(value) * about["step_m"] - expected))
            half = about["step_m"] / 2
            tools.expect(worst <= half * (1 + 1e-6), f"{engine} {size}: {1000 * worst:.2f} mm off, half a step is "
                                                     f"{1000 * half:.2f} mm")
            check_import(about, engine, tools)
            shutil.rmtree(folder)


def check_import(about, engine, tools):
    """The numbers of the dialog give the heights back by the engines' own formulas."""
    for value in [0, 12345, 65535]:
        height, dialog = about["lowest_m"] + value * about["step_m"], about["import"]
        if engine == "unreal":
            found = ((value - 32768) / 128 * dialog["scale_z"] + dialog["location_z_cm"]) / 100
        else:
            found = dialog["position_y"] + value / 65536 * dialog["terrain_height"]
        if abs(found - height) > 1e-6:
            tools.expect(False, f"{engine}: the dialog's numbers give {found} where the ground is {height}")


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


CHECKS = [
    ("usd", check_usd),
    ("heightmap", check_heightmap),
    ("gazebo", check_gazebo),
    ("3tz", check_3tz),
    ("mbtiles", check_mbtiles),
]
