#!/usr/bin/env python3
"""Exports a terrain database in every format and opens each with a reader that is not ours.

    python3 scripts/check_exports.py [DIR...] [--holes] [--bridge] [--together] [--tiefort PROGRAM]
                                     [--node-modules DIR]

With --holes a database with holes is built and checked, too, with --bridge one with a bridge over a valley, with
--together three that become one tileset (trimesh and embreex). PROGRAM is target/release/tiefort unless said. Needs
rasterio, rio-cogeo, meshio, geopandas, trimesh, rtree, pyogrio, pyproj, quantized-mesh-tile, pmtiles, pillow and numpy;
osgconv (Debian's openscenegraph); a Python that has QGIS (Debian's python3-qgis); usd-core and mujoco; eclipse-sumo;
Debian's libsdformat-dev; chromium and node for glTF and CesiumJS, which also loads from `tiefort serve`, with

    npm install --prefix DIR 3d-tiles-tools@0.5.4 cesium@1.145.0 gltf-validator@2.0.0-dev.3.10 puppeteer-core@24.43.1

A reader that is missing is told and skipped, unless --all is given.
"""

import argparse
import functools
import json
import math
import pathlib
import random
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
import types
import xml.etree.ElementTree as xml
import zlib

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import read_slm  # noqa: E402
from exports import engines, objects, sumo, together  # noqa: E402

HERE = pathlib.Path(__file__).parent
HOLE = 255
faults = []


def expect(holds, what):
    print(("  ok    " if holds else "  WRONG ") + what)
    if not holds:
        faults.append(what)


class Database:
    """The load modules, by the reader that was written from docs/FORMAT.md alone."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.manifest = json.loads((self.folder / "database.json").read_text())
        self.report = json.loads((self.folder / "report.json").read_text())
        self.levels = {}
        for path in sorted((self.folder / "modules").glob("*.slm")):
            header, modules = read_slm.parse(path.read_bytes())
            self.header = header
            for module in modules:
                self.levels.setdefault((module["row"], module["column"]), []).append(module)
        self.modules = {place: levels[0] for place, levels in self.levels.items()}
        area = self.manifest["area"]
        self.origin, self.side = area["origin_m"], area["module_side_m"]
        self.rows, self.cols = area["module_rows"], area["module_cols"]
        self.triangles = sum(len(module["triangles"]) for module in self.modules.values())
        self.everywhere, self.places, self.of_class, self.ground_modules = set(), set(), {}, {}
        for (row, col), module in self.modules.items():
            places = [(col * self.side + x / 128, row * self.side + y / 128, z / 128) for x, y, z in module["vertices"]]
            self.everywhere.update(places)
            for triangle, number in zip(module["triangles"], module["classes"]):
                self.of_class[number] = self.of_class.get(number, 0) + 1
                if number != HOLE:
                    self.places.update(places[corner] for corner in triangle)
                    self.ground_modules[row, col] = self.ground_modules.get((row, col), 0) + 1
        self.deck_places, self.deck_modules, self.deck_of_class = set(), {}, {}
        for (row, col), module in self.modules.items():
            decks = module.get("decks", {"vertices": [], "triangles": [], "classes": []})
            places = ((col * self.side + x / 128, row * self.side + y / 128, z / 128) for x, y, z in decks["vertices"])
            self.deck_places.update(places)
            for number in decks["classes"]:
                self.deck_of_class[number] = self.deck_of_class.get(number, 0) + 1
                self.deck_modules[row, col] = self.deck_modules.get((row, col), 0) + 1
        self.decks = sum(self.deck_modules.values())
        # Of the ground alone, as meshes have it, which leave holes out.
        self.vertices = len(self.places)
        self.heights = [z for _, _, z in self.places]
        self.holes = self.of_class.get(HOLE, 0)
        self.ground = self.triangles - self.holes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("databases", nargs="*", metavar="DIR")
    parser.add_argument("--holes", action="store_true", help="also build a database with holes and check it")
    parser.add_argument("--bridge", action="store_true", help="also build a database with a bridge and check it")
    parser.add_argument("--together", action="store_true", help="also build three databases and check their tileset")
    parser.add_argument("--tiefort", default="target/release/tiefort")
    parser.add_argument("--node-modules", help="folder that holds node_modules with gltf-validator")
    parser.add_argument("--qgis-python", help="a Python that has QGIS, to open the GeoPackage with it")
    parser.add_argument("--pictures", help="folder for screenshots of CesiumJS")
    parser.add_argument("--only", help="formats to check, with commas between")
    parser.add_argument("--all", action="store_true", help="a missing reader is a fault")
    arguments = parser.parse_args()
    if arguments.pictures:
        pathlib.Path(arguments.pictures).mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        folders = [*arguments.databases, *([with_holes(arguments, scratch)] if arguments.holes else [])]
        folders += [with_bridge(arguments, scratch)] if arguments.bridge else []
        if not folders and not arguments.together:
            parser.error("name a database, or give --holes, --bridge or --together")
        if arguments.together:
            (scratch / "several").mkdir()
            together.check(arguments, scratch / "several", TOOLS, glb_corners)
        for number, folder in enumerate(folders):
            (scratch / str(number)).mkdir()
            check(Database(folder), arguments, scratch / str(number))
    print(f"{len(faults)} faults")
    sys.exit(1 if faults else 0)


def check(database, arguments, scratch):
    print(f"{database.folder}: {len(database.modules)} load modules, {database.triangles} triangles, "
          f"{database.holes} of them over holes, {database.vertices} vertices of the ground")
    arguments.database = str(database.folder)
    only = arguments.only.split(",") if arguments.only else [name for name, _ in CHECKS]
    for name, run in CHECKS:
        if name not in only:
            continue
        print(f"{name}:")
        try:
            run(database, arguments, scratch)
        except Skip as reason:
            print(f"  skipped: {reason}")
            if arguments.all:
                faults.append(f"{name} was skipped: {reason}")


def with_holes(arguments, scratch):
    """A database of 18.5 km x 9 km with two holes inside and one at its eastern side."""
    rows, cols, spacing = 373, 745, 25
    row, col = numpy.mgrid[:rows, :cols]
    heights = 900 + 90 * numpy.sin(row / 31) * numpy.cos(col / 43) + 25 * numpy.sin(row / 7 + col / 11) + col / 10
    # One covers a whole square of 4 km.
    hole = (abs(col - 240) < 90) & (abs(rows - 1 - row - 240) < 90)
    hole |= ((row - 150) ** 2 + (col - 520) ** 2 < 50 ** 2) | ((col > 640) & (row > 200) & (row < 290))
    lines = [f"ncols {cols}", f"nrows {rows}", "xllcenter 500000", "yllcenter 3900000", f"cellsize {spacing}",
             "NODATA_value -9999"]
    lines += [" ".join(f"{z:.3f}" for z in line) for line in numpy.where(hole, -9999, heights)]
    (scratch / "holes.asc").write_text("\n".join(lines) + "\n")
    job = f"""
        [area]
        name = "holes"
        crs = "EPSG:32611"
        origin_m = [500000, 3900000]
        size_m = [18500, 9000]
        spacing_m = {spacing}
        [dem]
        sources = [{{ file = "holes.asc", crs = "EPSG:32611" }}]
        vertical_datum = "EGM96"
        voids = {{ hole = true }}
        [tiles]
        columns = 2
        rows = 2
        [limits]
        mean_per_load_module = 32
        [lod]
        levels = [{{ inner_share = 0.5 }}, {{ inner_share = 0.2 }}]
        """
    (scratch / "holes.toml").write_text(job)
    out = scratch / "holes.tdb"
    subprocess.run([arguments.tiefort, "build", str(scratch / "holes.toml"), "--out", str(out), "--quiet"], check=True)
    return out


# In metres from the corner of the area.
BRIDGE = {"west": 3600, "east": 4400, "south": 3010, "north": 3022, "height": 903}


def with_bridge(arguments, scratch):
    """A database of 8 km x 6 km with a road, a river in a valley, and a bridge with which the road crosses it."""
    rows, cols, spacing = 241, 321, 25
    row, col = numpy.mgrid[:rows, :cols]
    east = col * spacing
    heights = 900 + 0.5 * numpy.sin(row / 9) - 60 * numpy.clip(1 - abs(east - 4000) / 350, 0, 1)
    lines = [f"ncols {cols}", f"nrows {rows}", "xllcenter 500000", "yllcenter 3900000", f"cellsize {spacing}",
             "NODATA_value -9999"]
    lines += [" ".join(f"{z:.3f}" for z in line) for line in heights]
    (scratch / "valley.asc").write_text("\n".join(lines) + "\n")

    def polygon(name, west, south, east, north):
        ring = [[500000 + x, 3900000 + y] for x, y in [(west, south), (east, south), (east, north), (west, north)]]
        geometry = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
        crs = {"type": "name", "properties": {"name": "EPSG:32611"}}
        (scratch / name).write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": [
            {"type": "Feature", "properties": {}, "geometry": geometry}]}))

    polygon("road.geojson", 200, 2960, 7800, 3060)
    polygon("river.geojson", 3940, 200, 4060, 5800)
    job = f"""
        [area]
        name = "bridge"
        crs = "EPSG:32611"
        origin_m = [500000, 3900000]
        size_m = [8000, 6000]
        spacing_m = {spacing}
        [dem]
        sources = [{{ file = "valley.asc", crs = "EPSG:32611" }}]
        vertical_datum = "EGM96"
        [importance]
        areas = [{{ file = "river.geojson", class = "river", weight = 1 }},
                 {{ file = "road.geojson", class = "motorway", weight = 1 }}]
        [limits]
        mean_per_load_module = 32
        [lod]
        levels = [{{ inner_share = 0.5 }}]
        """
    (scratch / "bridge.toml").write_text(job)
    out = scratch / "bridge.tdb"
    subprocess.run([arguments.tiefort, "build", str(scratch / "bridge.toml"), "--out", str(out), "--quiet"], check=True)
    names = [of["name"] for of in json.loads((out / "report.json").read_text())["classes"]]
    for path in sorted((out / "modules").glob("*.slm")):
        data = add_bridge(path.read_bytes(), names.index("motorway"))
        read_slm.parse(data)
        path.write_bytes(data)
    return out


def add_bridge(data, of_class):
    """The same file of version 1 with the bridge in it, as one of version 2 where it holds any of it (FORMAT.md)."""
    header, modules = read_slm.parse(data)
    decks = [bridge_in(module, header["side"], of_class) for module in modules]
    if not any(decks):
        return data
    (length,) = struct.unpack_from("<I", data, 12)
    offset = length + 48 * len(modules) + 4
    index, sections = b"", b""
    for number, (module, (vertices, triangles)) in enumerate(zip(modules, [deck or ([], []) for deck in decks])):
        start, size, *rest = read_slm.ENTRY.unpack_from(data, length + 32 * number)
        heights = [z for _, _, z in vertices] or [0]
        index += read_slm.ENTRY.pack(offset + len(sections), size, *rest)
        index += read_slm.DECK_ENTRY.pack(len(vertices), len(triangles), min(heights), max(heights))
        sections += data[start:start + size]
        if vertices:
            part = read_slm.DECKS.pack(module["row"], module["column"], module["level"], len(vertices), len(triangles))
            part += b"".join(struct.pack("<HHi", *vertex) for vertex in vertices)
            part += b"".join(struct.pack("<3H", *triangle) for triangle in triangles)
            part += bytes([of_class] * len(triangles))
            sections += sealed(part + bytes(-len(part) % 4))
    head = bytearray(data[:length - 4])
    struct.pack_into("<H", head, 8, 2)
    struct.pack_into("<Q", head, 16, offset + len(sections))
    return sealed(bytes(head)) + sealed(index) + sections


def sealed(part):
    return part + struct.pack("<I", zlib.crc32(part))


def bridge_in(module, side, of_class):
    """The part of the bridge in a load module, in quanta: vertices and triangles; None where there is none."""
    west, east, south, north = (128 * BRIDGE[edge] for edge in ["west", "east", "south", "north"])
    corner = [module["column"] * side, module["row"] * side]
    xs = [max(west, corner[0]), min(east, corner[0] + side)]
    if xs[0] >= xs[1] or not corner[1] <= south < north <= corner[1] + side:
        return None
    # A little higher in the middle, the same on both sides of a line between load modules.
    height = {x: 128 * BRIDGE["height"] + min(x - west, east - x) // 100 for x in xs}
    vertices = [(x - corner[0], y - corner[1], height[x]) for y in (south, north) for x in xs]
    return vertices, [(0, 1, 3), (0, 3, 2)]


class Skip(Exception):
    pass


def export(arguments, form, out, *more):
    start = time.monotonic()
    command = [arguments.tiefort, "export", arguments.database, "--format", form, "--out", str(out), "--quiet", *more]
    subprocess.run(command, check=True)
    seconds = time.monotonic() - start
    expect(seconds < 30, f"exported in {seconds:.1f} s, below 30 s")
    return out


def datum(database):
    """What a globe needs to be told: the sample terrain says nothing of its heights."""
    return [] if database.manifest["area"]["vertical_datum"] == "EGM96" else ["--assume-datum", "EGM96"]


def with_decks(module):
    return {"decks": {"vertices": [], "triangles": [], "classes": []}, **module}


def check_modules(database, arguments, scratch):
    folder = export(arguments, "modules", scratch / "modules")
    files = sorted(folder.glob("*.slm"))
    expect(len(files) == len(database.modules), f"{len(files)} files, one for each load module")
    same = 0
    for path in files:
        _, levels = read_slm.parse(path.read_bytes())
        # A file of one load module without decks is of version 1, and says nothing of them.
        expected = database.levels[levels[0]["row"], levels[0]["column"]]
        same += [with_decks(of) for of in levels] == [with_decks(of) for of in expected]
    expect(same == len(files), "each holds its load module as it is in the database, at every level")
    shutil.rmtree(folder)


def check_meshes(database, arguments, scratch):
    path = export(arguments, "ply", scratch / "mesh.ply")
    head, body = path.read_bytes().split(b"end_header\n", 1)
    counts = [int(n) for n in re.findall(rb"element \w+ (\d+)", head)]
    shape = [database.vertices + len(database.deck_places), database.ground + database.decks]
    expect(counts == shape, f"ply has {counts[0]} vertices, {counts[1]} triangles")
    places = numpy.frombuffer(body, "<f4", 3 * counts[0]).reshape(-1, 3).astype(float)
    everywhere = database.places | database.deck_places
    expect({tuple(place) for place in places} == everywhere, "ply: every vertex at its place, exactly")

    def said_of(kind):
        found = re.findall(b"comment " + kind + rb"class (\d+) faces (\d+) to (\d+)", head)
        return {int(of): int(to) - int(first) + 1 for of, first, to in found}

    said = said_of(b"")
    expect(said_of(b"decks ") == database.deck_of_class, f"ply: faces of decks of each class {database.deck_of_class}")
    expect(said == {of: count for of, count in database.of_class.items() if of != HOLE}, "ply: faces of each class")
    obj = export(arguments, "obj", scratch / "mesh.obj", "--coordinates", "map").read_text().splitlines()
    places = {tuple(map(float, line.split()[1:])) for line in obj if line.startswith("v ")}
    east, north = database.origin
    expect(places == {(x + east, y + north, z) for x, y, z in everywhere}, "obj: every vertex on the map")
    expect(sum(line.startswith("f ") for line in obj) == database.ground + database.decks, "obj: every triangle")
    expect(("o decks" in obj) == bool(database.decks), "obj: decks, where there are any, are an object of their own")
    library, used = scratch / "mesh.mtl", {line for line in obj if line.startswith("usemtl ")}
    made = re.findall(r"newmtl (.*)", library.read_text()) if library.exists() else []
    expect(used == {f"usemtl {name}" for name in made}, f"obj: materials {made}")
    sidecar = json.loads((scratch / "mesh.ply.json").read_text())
    expect(sidecar["offset_m"] == [*database.origin, 0.0], "the sidecar says where that is")
    expect(sidecar["hole_triangles_left_out"] == database.holes, f"and that {database.holes} triangles are left out")
    try:
        import meshio
    except ImportError as error:
        raise Skip(error) from error
    for path in [scratch / "mesh.ply", scratch / "mesh.obj"]:
        mesh = meshio.read(path)
        found = [len(mesh.points), len(mesh.cells_dict["triangle"])]
        expect(found == shape, f"meshio reads {path.name}: {found}")


def check_glb(database, arguments, scratch):
    glb = export(arguments, "glb", scratch / "mesh.glb")
    document, _ = read_glb(glb.read_bytes())
    found, coarser, meshes = {"": {}, "decks_": {}}, [], []
    for node in document["nodes"]:
        if "children" in node:
            expect(node["name"] == "decks" and len(node["children"]) == len(database.deck_modules), "a node of decks")
            continue
        kind, row, col, level = re.fullmatch(r"(|decks_)r(\d+)c(\d+)(?:_lod(\d+))?", node["name"]).groups()
        triangles = glb_triangles(document, document["meshes"][node["mesh"]])
        if level:
            ground = database.levels[int(row), int(col)][int(level)]["classes"]
            coarser.append(kind != "" or triangles == sum(number != HOLE for number in ground))
            continue
        meshes.append(node["mesh"])
        found[kind][int(row), int(col)] = triangles
    levels = max(len(of) for of in database.levels.values())
    expect(all(coarser) and bool(coarser) == (1 < levels), f"{len(coarser)} nodes of coarser levels, with theirs")
    expect(found[""] == database.ground_modules, f"{len(found[''])} nodes, each a load module by name and triangles")
    expect(found["decks_"] == database.deck_modules, f"{len(found['decks_'])} nodes of decks likewise")
    named = {of["name"] for of in database.report["classes"]} - {"hole"}
    materials = [of["name"].removeprefix("decks_") for of in document["materials"]]
    expect(len(named) < 2 or set(materials) <= named, f"materials have the names of classes {materials}")
    positions = list(glb_positions(glb.read_bytes()))
    places = {tuple(place) for mesh in meshes for place in positions[mesh]}
    turned = {(x, -z, y) for x, y, z in places}
    expect(turned == database.places | database.deck_places, "every vertex at its place, exactly")
    validate([glb], arguments)


def readers(arguments):
    """The script of readers, where it finds their packages."""
    script = pathlib.Path(arguments.node_modules) / "readers.mjs"
    shutil.copy(HERE / "exports" / "readers.mjs", script)
    return script


def validate(files, arguments):
    if not arguments.node_modules or not shutil.which("node"):
        raise Skip("no --node-modules with gltf-validator, or no node")
    script = readers(arguments)
    ran = subprocess.run(["node", str(script), "gltf", *map(str, files)], capture_output=True, text=True)
    expect(ran.returncode == 0, f"gltf-validator: {ran.stdout.strip().splitlines()[-1]}")


def read_glb(data):
    magic, version, length, json_length = struct.unpack_from("<4sIII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    return json.loads(data[20:20 + json_length]), data[28 + json_length:]


def glb_triangles(document, mesh):
    return sum(document["accessors"][primitive["indices"]]["count"] // 3 for primitive in mesh["primitives"])


def glb_positions(data):
    """The vertices of each mesh."""
    document, binary = read_glb(data)
    for mesh in document["meshes"]:
        accessor = document["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]]
        start = document["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor["byteOffset"]
        yield numpy.frombuffer(binary, "<f4", 3 * accessor["count"], start).reshape(-1, 3).astype(float)


def glb_corners(data):
    """The corners of all triangles, one after the other."""
    document, binary = read_glb(data)
    corners = []
    for mesh, places in zip(document["meshes"], glb_positions(data)):
        for primitive in mesh["primitives"]:
            accessor = document["accessors"][primitive["indices"]]
            start = document["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor["byteOffset"]
            kind = {5121: "u1", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
            corners.append(places[numpy.frombuffer(binary, kind, accessor["count"], start)])
    return numpy.concatenate(corners)


def check_geotiff(database, arguments, scratch):
    try:
        import rasterio
        from rio_cogeo.cogeo import cog_validate
    except ImportError as error:
        raise Skip(error) from error
    path = export(arguments, "geotiff", scratch / "surface.tif")
    spacing = database.manifest["area"]["spacing_m"]
    with rasterio.open(path) as raster:
        surface, profile = raster.read(1), raster.profile
        expect(profile["tiled"] and profile["compress"] == "deflate", "tiled and deflated")
        structure = raster.tags(ns="IMAGE_STRUCTURE")
        expect(structure.get("PREDICTOR", "3") == "3", f"predictor 3 ({structure})")
        check_systems(database, raster.crs.to_wkt())
        expect(numpy.isnan(raster.nodata), "nodata is NaN")
        place = {(x, y): raster.index(x + database.origin[0], y + database.origin[1])
                 for x, y, _ in database.everywhere if x % spacing == 0 and y % spacing == 0}
        overviews = raster.overviews(1)
    # A vertex between ground and hole may go with either.
    either = {(x, y) for x, y, _ in database.places}
    inside = [at for at in place if at not in either]
    expect(all(numpy.isnan(surface[place[at]]) for at in inside), f"{len(inside)} vertices inside holes have no height")
    inside_ground = database.places - edges_of_holes(database)
    on_posts = [(place[x, y], z) for x, y, z in inside_ground if (x, y) in place]
    checked = sum(surface[at] == numpy.float32(z) for at, z in on_posts)
    expect(checked == len(on_posts), f"{checked} vertices on posts have their height at that place")
    found = surface[~numpy.isnan(surface)]
    expect(bool(len(found) < surface.size) == bool(database.holes), f"{surface.size - len(found)} posts without height")
    expect(min(database.heights) <= found.min() and found.max() <= max(database.heights), "no height beyond")
    residual = export(arguments, "geotiff", scratch / "residual.tif", "--layer", "residual")
    with rasterio.open(residual) as raster:
        values = raster.read(1).astype(float)
        expect(not raster.crs.to_wkt().startswith("COMPD"), "a residual is no height")
        found = values[~numpy.isnan(values)]
        rms, told = numpy.sqrt((found ** 2).mean()), database.report["residual"]["rms_m"]
        expect(abs(rms - told) < 1e-9, f"RMS of the residual raster {rms:.6f} m, in the report {told:.6f} m")
    for path in [path, residual]:
        valid, errors, warnings = cog_validate(path, strict=True, quiet=True)
        expect(valid and not errors and not warnings, f"{path.name} is a Cloud Optimized GeoTIFF {errors + warnings}")
        check_overviews(path, overviews)


def check_systems(database, wkt):
    import pyproj
    system = pyproj.CRS.from_wkt(wkt)
    code = database.manifest["area"]["crs"].removeprefix("EPSG:")
    expect(f'"EPSG","{code}"' in wkt, f"rasterio reads EPSG:{code}")
    known = {"EGM96": 5773, "EGM2008": 3855, "NAVD88": 5703}.get(database.manifest["area"]["vertical_datum"])
    vertical = system.sub_crs_list[1].to_epsg() if system.is_compound else None
    expect(vertical == known, f"and for heights EPSG:{vertical}")


def edges_of_holes(database):
    """Vertices that ground and hole share."""
    own = set()
    for (row, col), module in database.modules.items():
        for triangle, number in zip(module["triangles"], module["classes"]):
            for x, y, z in (module["vertices"][v] for v in triangle if number == HOLE):
                own.add((col * database.side + x / 128, row * database.side + y / 128, z / 128))
    return own & database.places


def check_overviews(path, decimations):
    """Each is the mean of up to four posts of the one before, those without a value left out."""
    import rasterio
    with rasterio.open(path) as raster:
        before = raster.read(1).astype(float)
    expect(decimations == [2 ** (i + 1) for i in range(len(decimations))], f"overviews {decimations}")
    expect(bool(decimations) == (max(before.shape) > 256), "as many as it takes to come to one block")
    for index in range(len(decimations)):
        with rasterio.open(path, overview_level=index) as raster:
            values = raster.read(1).astype(float)
        high, wide = before.shape
        padded = numpy.pad(before, ((0, high % 2), (0, wide % 2)), constant_values=numpy.nan)
        fours = numpy.stack([padded[i::2, j::2] for i in (0, 1) for j in (0, 1)])
        count = (~numpy.isnan(fours)).sum(0)
        mean = numpy.where(count == 0, numpy.nan, numpy.nansum(fours, 0) / numpy.maximum(count, 1))
        same = values.shape == mean.shape and numpy.array_equal(values, mean.astype("f4"), equal_nan=True)
        expect(same, f"overview {values.shape[1]} x {values.shape[0]} is the mean of what is below it")
        before = values


def check_gpkg(database, arguments, scratch):
    try:
        import geopandas
        import pyogrio
    except ImportError as error:
        raise Skip(error) from error
    path = export(arguments, "gpkg", scratch / "area.gpkg")
    layers = {name: geopandas.read_file(path, layer=name) for name in ["load_modules", "tiles", "breaches"]}
    expect(len(layers["load_modules"]) == len(database.modules), "load_modules: a feature for each")
    code = int(database.manifest["area"]["crs"].removeprefix("EPSG:"))
    expect(layers["load_modules"].crs.to_epsg() == code, f"in EPSG:{code}")
    expect(len(layers["tiles"]) == len(database.manifest["tiles"]), "tiles: a feature for each")
    expect(len(layers["breaches"]) == len(database.report["breaches"]), "breaches: a feature for each")
    expect(int(layers["load_modules"].triangles.sum()) == database.triangles + database.decks, "counts add up")
    if database.decks:
        decks = geopandas.read_file(path, layer="decks")
        expect(len(decks) == database.decks and bool(decks.has_z.all()), f"decks: {len(decks)} polygons with heights")
        expect(dict(decks["class"].value_counts()) == database.deck_of_class, "decks: of their classes")
    listed = {name for name, *_ in pyogrio.list_layers(path)}
    expect(("decks" in listed) == bool(database.decks), "a layer decks where there are any")
    triangles = geopandas.read_file(path, layer="triangles")
    expect(len(triangles) == database.triangles and bool(triangles.has_z.all()), "triangles: polygons with heights")
    names = {of["name"] for of in database.report["classes"]} | {"hole"}
    expect(set(triangles.class_name) <= names, f"triangles: names of classes {sorted(set(triangles.class_name))}")
    expect(int((triangles.class_name == "hole").sum()) == database.holes, f"{database.holes} of them over holes")
    fast = pyogrio.read_info(path, layer="triangles")["capabilities"]["fast_spatial_filter"]
    east, north = (database.origin[axis] + database.side / 2 for axis in (0, 1))
    near = geopandas.read_file(path, layer="triangles", bbox=(east, north, east + 1, north + 1))
    touching = int(triangles.intersects(near.union_all().envelope).sum())
    expect(fast and 0 < len(near) <= touching, f"triangles: {len(near)} found through the spatial index")
    area = triangles.geometry.area.sum()
    whole = database.rows * database.cols * database.side ** 2
    expect(abs(area / whole - 1) < 1e-9, f"triangles cover {area / 1e6:.3f} km2")
    lines = {line["class"] for module in database.modules.values() for line in module.get("lines", [])}
    if lines:
        found = geopandas.read_file(path, layer="lines")
        count = sum(len(module.get("lines", [])) for module in database.modules.values())
        expect(len(found) == count and bool(found.has_z.all()), f"lines: {count}, with heights")
        expect(set(found["class"]) == lines, f"lines: of their classes {sorted(set(found.class_name))}")
    check_styles(path, set(triangles["class"]) | set(database.deck_of_class), lines)
    check_in_qgis(path, dict(zip(triangles["class"], triangles.class_name)), arguments)


def check_features(database, arguments, scratch):
    """Roads, rivers and lakes as layers, the same file as the build has put beside its report."""
    told = database.report.get("features")
    published = database.folder / "features.gpkg"
    if not told:
        expect(not published.exists(), "no features.gpkg without roads and water")
        return
    try:
        import geopandas
        import pyogrio
    except ImportError as error:
        raise Skip(error) from error
    path = export(arguments, "features", scratch / "features.gpkg")
    expect(path.read_bytes() == published.read_bytes(), "the file that the build has published, byte by byte")
    again = export(arguments, "features", scratch / "again.gpkg")
    expect(path.read_bytes() == again.read_bytes(), "the same bytes from run to run")
    with sqlite3.connect(path) as package:
        expect(package.execute("PRAGMA integrity_check").fetchone() == ("ok",), "SQLite finds the package sound")
        expect(not package.execute("PRAGMA foreign_key_check").fetchall(), "its keys lead somewhere")
    wanted = ["lines", "nodes", "decks", "culverts", "remarks"]
    expect([name for name, *_ in pyogrio.list_layers(path)] == wanted, f"layers {wanted}")
    layers = {name: geopandas.read_file(path, layer=name) for name in wanted}
    code = int(database.manifest["area"]["crs"].removeprefix("EPSG:"))
    expect(all(layer.crs.to_epsg() == code for layer in layers.values()), f"in EPSG:{code}")
    classes = {of["name"] for of in told["classes"]}
    lines = layers["lines"]
    expect(0 < len(lines) and bool(lines.has_z.all()), f"{len(lines)} lines with heights")
    expect(set(lines["class"]) | set(layers["decks"]["class"]) <= classes, f"of the classes {sorted(classes)}")
    expect(set(lines.form) <= {"line", "strip", "bench", "polygon"}, f"of the forms {sorted(set(lines.form))}")
    decks = sum(of["deck_polygons"] for of in told["classes"])
    expect(len(layers["decks"]) == decks and bool(layers["decks"].has_z.all()), f"{decks} decks with heights")
    counts = told["remarks"]
    found = dict(layers["remarks"].outcome.value_counts())
    said = {"mended": counts["mended"], "degraded": counts["degraded"], "left out": counts["left_out"]}
    expect(all(found.get(of, 0) == count for of, count in said.items()), f"remarks {said}")
    expect(len(layers["culverts"]) <= len(layers["remarks"]), f"{len(layers['culverts'])} culverts")


def check_styles(path, classes, ways):
    """What QGIS reads: a default style for each layer, its symbols and categories at their places."""
    with sqlite3.connect(path) as package:
        styles = dict(package.execute("SELECT f_table_name, styleQML FROM layer_styles WHERE useAsDefault"))
        geometries = {name for name, in package.execute("SELECT table_name FROM gpkg_geometry_columns")}
        sound = package.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        broken = package.execute("PRAGMA foreign_key_check").fetchall()
    expect(sound and not broken, "SQLite finds the package sound")
    expect(set(styles) == geometries, "a style for every layer")
    for name, text in styles.items():
        renderer = xml.fromstring(text).find("renderer-v2")
        symbols = {symbol.get("name") for symbol in renderer.iter("symbol")}
        categories = {int(of.get("value")): of.get("symbol") for of in renderer.iter("category")}
        wanted = {"triangles": classes, "decks": classes, "lines": ways}.get(name, set())
        expect(set(categories) == wanted and set(categories.values() or symbols) == symbols, f"style of {name}")


# Opens layers of a GeoPackage in QGIS, without a window, and tells as JSON how it would draw each.
QGIS_STYLES = '''
import json
import os
import sys

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
from qgis.core import QgsApplication, QgsVectorLayer

application = QgsApplication([], False)
application.initQgis()
found = {}
for name in sys.argv[2:]:
    layer = QgsVectorLayer(f"{sys.argv[1]}|layername={name}", name, "ogr")
    _, loaded = layer.loadDefaultStyle()
    renderer = layer.renderer()
    categories = renderer.categories() if hasattr(renderer, "categories") else []
    found[name] = {
        "loaded": loaded, "renderer": renderer.type(),
        "classes": {int(of.value()): [of.label(), of.symbol().symbolLayer(0).properties()["style"]]
                    for of in categories},
    }
print(json.dumps(found))
'''


def check_in_qgis(path, names, arguments):
    if not arguments.qgis_python:
        raise Skip("no --qgis-python")
    layers = ["load_modules", "tiles", "breaches", "triangles"]
    command = [arguments.qgis_python, "-c", QGIS_STYLES, str(path), *layers]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    expect(all(of["loaded"] for of in found.values()), "QGIS takes the style of every layer from the package")
    wanted = {str(of): [name, "b_diagonal" if of == HOLE else "solid"] for of, name in names.items()}
    expect(found["triangles"]["classes"] == wanted, f"QGIS names classes and hatches holes {wanted}")


def check_openflight(database, arguments, scratch):
    folder = export(arguments, "openflight", scratch / "flt", "--lod", "0")
    squares = sorted((folder / "squares").glob("*.flt"))
    if not shutil.which("osgconv"):
        raise Skip("no osgconv")
    out = scratch / "flt.obj"
    ran = subprocess.run(["osgconv", str(folder / "area.flt"), str(out)], capture_output=True, text=True)
    said = [line for line in (ran.stdout + ran.stderr).splitlines() if re.search("warn|error|fail|unknown", line, re.I)]
    expect(ran.returncode == 0 and not said, f"osgconv converts {len(squares)} squares without complaint {said[:3]}")
    places, faces = [], 0
    for line in out.read_text().splitlines():
        if line.startswith("v "):
            places.append(tuple(map(float, line.split()[1:4])))
        elif line.startswith("f "):
            faces += len(line.split()) - 3
    expect(faces == database.ground + database.decks, f"{faces} triangles come out, {database.decks} of decks")
    places = numpy.array(places)
    # OSG's OBJ writer may turn axes: compare the extents of each axis in any order.
    extents = sorted(numpy.round(places.max(0) - places.min(0), 2))
    own = numpy.array(sorted(database.places | database.deck_places))
    expected = sorted(numpy.round(own.max(0) - own.min(0), 2))
    expect(numpy.allclose(extents, expected, atol=0.05), f"bounds {extents}, expected {expected}")
    levels = max(len(of) for of in database.levels.values())
    if 1 < levels:
        check_flt_levels(export(arguments, "openflight", scratch / "flt_levels"), levels, scratch)
    tree = xml.parse(folder / "area.mft").getroot()
    listed = [tile.get("file") for tile in tree.iter("Tile")]
    there = all((folder / name).exists() for name in listed)
    expect(there and len(listed) == len(squares), "the index lists each file")


def check_flt_levels(folder, levels, scratch):
    """OSG reads a level-of-detail node for each level of each square, which take turns from near to far."""
    ranges = []
    for square in sorted((folder / "squares").glob("*.flt")):
        out = scratch / "square.osgt"
        subprocess.run(["osgconv", str(square), str(out)], capture_output=True, check=True)
        # OSG leaves out a square that is all hole.
        for found in re.findall(r"RangeList \d+ \{([^}]*)\}", out.read_text()):
            numbers = [float(number) for number in found.split()]
            ranges.append(list(zip(numbers[::2], numbers[1::2])))
    turns = all(far == near for of in ranges for (_, far), (near, _) in zip(of, of[1:]))
    sound = all(len(of) == levels and of[0][0] == 0 for of in ranges)
    expect(sound and turns, f"OSG shows {levels} levels of each square, one after the other: {ranges[0]}")


def globe(database, places):
    """Places of the database on the globe, by PROJ, with the offset of heights that tiefort chose."""
    try:
        import pyproj
    except ImportError as error:
        raise Skip(error) from error
    own = numpy.array(sorted(places))
    to = pyproj.Transformer.from_crs(database.manifest["area"]["crs"], 4326, always_xy=True)
    longitude, latitude = to.transform(own[:, 0] + database.origin[0], own[:, 1] + database.origin[1])
    return own, numpy.array(longitude), numpy.array(latitude), pyproj


def check_3dtiles(database, arguments, scratch):
    folder = export(arguments, "3dtiles", scratch / "3dtiles", *datum(database))
    own, longitude, latitude, pyproj = globe(database, database.places | database.deck_places)
    tileset = json.loads((folder / "tileset.json").read_text())
    geodetic = pyproj.Transformer.from_crs(4978, 4979, always_xy=True)
    found, triangles, worst = {}, 0, check_tileset(folder, tileset)
    groups = []
    for square, child in leaves(tileset["root"]):
        groups.append(folder / child["content"]["uri"])
        document, _ = read_glb(groups[-1].read_bytes())
        triangles += sum(glb_triangles(document, mesh) for mesh in document["meshes"])
        x, y, z = numpy.concatenate(list(glb_positions(groups[-1].read_bytes()))).T
        matrix = numpy.array(square["transform"]).reshape(4, 4).T
        lon, lat, height = geodetic.transform(*(matrix @ numpy.array([x, -z, y, numpy.ones_like(x)]))[:3])
        for key in zip(numpy.round(lon, 7), numpy.round(lat, 7), height):
            found.setdefault(key[:2], []).append(key[2])
        box = numpy.array(child["boundingVolume"]["box"])
        local = numpy.array([x, -z, y]).T - box[:3]
        worst &= bool((numpy.abs(local) <= box[[3, 7, 11]] + 1e-3).all())
    expected = database.ground + database.decks
    expect(triangles == expected, f"{triangles} triangles in {len(groups)} groups of load modules")
    expect(worst, "boxes hold their content, errors shrink on the way down, no list of children is empty")
    files = sorted(folder.rglob("*.glb"))
    listed = {folder / tile["content"]["uri"] for tile in tiles_below(tileset["root"]) if "content" in tile}
    expect(listed == set(files), f"each of {len(files)} files is in the tileset")
    km2 = database.rows * database.cols * database.side ** 2 / 1e6
    expect(len(files) < max(10, km2), f"{len(files)} files for {km2:.0f} km2")
    offsets, missing = [], 0
    for (_, _, z), lon, lat in zip(own, longitude, latitude):
        around = [(lon + i * 1e-7, lat + j * 1e-7) for i in (0, -1, 1) for j in (0, -1, 1)]
        near = [found.get((round(x, 7), round(y, 7))) for x, y in around]
        heights = next((heights for heights in near if heights), None)
        if heights is None:
            missing += 1
        else:
            offsets.extend(height - z for height in heights)
    expect(missing == 0, f"every vertex is where PROJ puts it, to a centimetre ({missing} missing)")
    spread = max(offsets) - min(offsets)
    expect(spread < 5, f"heights differ from the database's by {min(offsets):.3f} to {max(offsets):.3f} m")
    validate(files, arguments)


def tiles_below(tile):
    yield tile
    for child in tile.get("children", []):
        yield from tiles_below(child)


def leaves(root):
    """Every tile without children, and the square it is in."""
    for square in root["children"]:
        yield from ((square, tile) for tile in tiles_below(square) if "children" not in tile)


def check_tileset(folder, tileset):
    """What the specification wants of tileset.json, as far as its own validator would look."""
    sound = tileset["asset"]["version"] == "1.1" and tileset["geometricError"] >= tileset["root"]["geometricError"]
    for tile in tiles_below(tileset["root"]):
        [(kind, numbers)] = tile["boundingVolume"].items()
        sound &= len(numbers) == {"region": 6, "box": 12}[kind] and all(map(numpy.isfinite, numbers))
        sound &= tile["geometricError"] >= 0 and tile.get("children") != []
        sound &= all(child["geometricError"] <= tile["geometricError"] for child in tile.get("children", []))
        sound &= "content" not in tile or (folder / tile["content"]["uri"]).is_file()
    return sound


class Terrain:
    """A tile of quantized-mesh."""

    def __init__(self, data):
        *self.centre, self.low, self.high = struct.unpack_from("<dddff", data, 0)
        *self.sphere, self.radius = struct.unpack_from("<dddd", data, 32)
        self.horizon = struct.unpack_from("<ddd", data, 64)
        count = struct.unpack_from("<I", data, 88)[0]
        folded = numpy.frombuffer(data, "<u2", 3 * count, 92).reshape(3, count).astype(int)
        self.u, self.v, self.h = numpy.cumsum((folded >> 1) ^ -(folded & 1), axis=1)
        self.step = (self.high - self.low) / 32767
        self.height = self.low + self.h * self.step
        at = 92 + 6 * count
        total = 3 * struct.unpack_from("<I", data, at)[0]
        codes = numpy.frombuffer(data, "<u2", total, at + 4).astype(int)
        high_water = numpy.concatenate([[0], numpy.cumsum(codes == 0)[:-1]])
        self.triangles = (high_water - codes).reshape(-1, 3)
        at += 4 + 2 * total
        for _ in range(4):
            at += 4 + 2 * struct.unpack_from("<I", data, at)[0]
        self.extensions = {}
        while at < len(data):
            number, length = struct.unpack_from("<BI", data, at)
            self.extensions[number] = data[at + 5 : at + 5 + length]
            at += 5 + length

    def water(self):
        """Whether there is water, by row from the north and column of 256 x 256; None without a mask."""
        mask = numpy.frombuffer(self.extensions.get(2, b""), numpy.uint8)
        if len(mask) == 0:
            return None
        return numpy.broadcast_to(mask.reshape(-1, 1) if len(mask) == 1 else mask.reshape(256, 256), (256, 256)) == 255


def check_quantized_mesh(database, arguments, scratch):
    folder = export(arguments, "quantized-mesh", scratch / "terrain", *datum(database))
    own, longitude, latitude, pyproj = globe(database, database.places)
    layer = json.loads((folder / "layer.json").read_text())
    level = layer["maxzoom"]
    degrees = 180 / 2 ** level
    listed = 0
    for index, ranges in enumerate(layer["available"]):
        for r in ranges:
            for x in range(r["startX"], r["endX"] + 1):
                for y in range(r["startY"], r["endY"] + 1):
                    listed += (folder / f"{index}/{x}/{y}.terrain").exists()
    files = sum(1 for _ in folder.rglob("*.terrain"))
    expect(listed == files, f"{files} tiles, each listed, up to both roots")
    check_headers(folder, pyproj)
    places, worst = {}, 0
    for path in (folder / str(level)).rglob("*.terrain"):
        x, y = int(path.parent.name), int(path.stem)
        tile = Terrain(path.read_bytes())
        for a, b, c in zip(tile.u + x * 32767, tile.v + y * 32767, tile.height):
            off = abs(places.setdefault((a, b), (c, tile.step))[0] - c)
            worst = max(worst, off / max(tile.step, places[a, b][1], 1e-9))
    expect(worst < 1.01, f"tiles agree on their borders to {worst:.2f} steps of heights")
    step = degrees / 32767
    offsets, missing = [], 0
    for (_, _, z), lon, lat in zip(own, longitude, latitude):
        a, b = (lon + 180) / step, (lat + 90) / step
        near = [(round(a), round(b)), (int(a), int(b)), (int(a) + 1, int(b)), (int(a), int(b) + 1)]
        height = next((places[key][0] for key in near if key in places), None)
        if height is None:
            missing += 1
        else:
            offsets.append(height - z)
    expect(missing == 0, f"every vertex is in a tile ({missing} missing)")
    spread = max(offsets) - min(offsets)
    expect(spread < 5, f"heights differ from the database's by {min(offsets):.3f} to {max(offsets):.3f} m")
    check_water(database, folder / str(level), degrees, pyproj)
    check_cells(database, folder / str(level), degrees, pyproj)
    check_listed(folder, level)
    holes = folder / "holes.geojson"
    rings = json.loads(holes.read_text())["features"][0]["geometry"]["coordinates"] if holes.exists() else []
    expect(len(rings) == database.holes, f"holes.geojson has {len(rings)} triangles over holes")


def check_water(database, folder, degrees, pyproj):
    """The masks of the finest tiles have as much water as the triangles, but for cells that shores cross."""
    names = [one["name"] for one in database.report["classes"]]
    water = [number for number, name in enumerate(names) if name in ("water", "lake", "river", "stream")]
    expected = 0.0
    for module in database.modules.values():
        for corners, number in zip(module["triangles"], module["classes"]):
            if number in water:
                (ax, ay, _), (bx, by, _), (cx, cy, _) = (module["vertices"][corner] for corner in corners)
                expected += ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2 / 128**2
    globe, found = pyproj.Geod(ellps="WGS84"), 0.0
    for path in folder.rglob("*.terrain"):
        mask = Terrain(path.read_bytes()).water()
        if mask is not None and mask.any():
            west, south = int(path.parent.name) * degrees - 180, int(path.stem) * degrees - 90
            ring = [west, west + degrees, west + degrees, west], [south, south, south + degrees, south + degrees]
            found += abs(globe.polygon_area_perimeter(*ring)[0]) * mask.mean()
    off = abs(found - expected) / max(expected, 1.0)
    expect(off < 0.02 or abs(found - expected) < 2000, f"masks have {found:.0f} m2 of water, triangles {expected:.0f}")


def check_cells(database, folder, degrees, pyproj):
    """By quantized-mesh-tile, cells of masks have the class under them, and vertices the heights that we read."""
    try:
        from quantized_mesh_tile import decode
    except ImportError as error:
        raise Skip(error) from error
    names = [one["name"] for one in database.report["classes"]]
    water = {number for number, name in enumerate(names) if name in ("water", "lake", "river", "stream")}
    to = pyproj.Transformer.from_crs(4326, database.manifest["area"]["crs"], always_xy=True)
    paths = sorted(folder.rglob("*.terrain"))
    draw, looked, shores, wrong, off = random.Random(5), 0, 0, 0, 0.0

    def is_water(longitude, latitude):
        """None where water and land meet, and outside."""
        x, y = (a - b for a, b in zip(to.transform(longitude, latitude), database.origin))
        if not (0 <= x <= database.cols * database.side and 0 <= y <= database.rows * database.side):
            return None
        found = {number in water for number in engines.classes_at(database, x, y)}
        return found.pop() if len(found) == 1 else None

    for path in draw.sample(paths, min(len(paths), 12)):
        west, south = int(path.parent.name) * degrees - 180, int(path.stem) * degrees - 90
        tile = Terrain(path.read_bytes())
        own = decode(str(path), [west, south, west + degrees, south + degrees], hasLighting=True,
                     hasWatermask=2 in tile.extensions)
        heights = numpy.array([place[2] for place in own.getVerticesCoordinates()])
        off = max(off, float(abs(heights - tile.height).max()))
        mask = numpy.array(own.watermask, dtype=int)
        shape = (1, 1) if mask.size == 1 else (256, 256)
        mask = numpy.broadcast_to(mask.reshape(shape), (256, 256)) if mask.size else None
        cell = degrees / 256
        for _ in range(60):
            col, row = draw.randrange(256), draw.randrange(256)
            if mask is not None and draw.random() < 0.5 and (mask == 255).any():
                row, col = draw.choice(numpy.argwhere(mask == 255).tolist())
            east, north = west + (col + 0.5) * cell, south + (255.5 - row) * cell
            near = {is_water(east + u * cell, north + v * cell) for u in (-0.5, 0, 0.5) for v in (-0.5, 0, 0.5)}
            found = mask is not None and int(mask[row, col]) == 255
            looked += 1
            if len(near) != 1 or None in near:
                shores += 1
            else:
                wrong += found != near.pop()
    expect(off < 1e-3, f"quantized-mesh-tile reads the heights within {1000 * off:.3f} mm of ours")
    expect(wrong == 0, f"of {looked} cells {wrong} differ from the classes in them; {shores} have a shore or a border")


def check_listed(folder, last):
    """Tiles of every tenth level list those below them, down to the next such level."""
    wrong, count = 0, 0
    for path in folder.rglob("*.terrain"):
        level, x, y = int(path.parent.parent.name), int(path.parent.name), int(path.stem)
        said = Terrain(path.read_bytes()).extensions.get(4)
        wrong += (said is not None) != (level % 10 == 0)
        if said is None:
            continue
        count += 1
        listed = set()
        for below, ranges in enumerate(json.loads(said[4:])["available"], level + 1):
            listed |= {(below, col, row) for r in ranges for col in range(r["startX"], r["endX"] + 1)
                       for row in range(r["startY"], r["endY"] + 1)}
        there = set()
        for below in range(level + 1, min(level + 10, last) + 1):
            scale = 2 ** (below - level)
            for other in (folder / str(below)).rglob("*.terrain"):
                if int(other.parent.name) // scale == x and int(other.stem) // scale == y:
                    there.add((below, int(other.parent.name), int(other.stem)))
        wrong += listed != there
    expect(wrong == 0 and count > 0, f"{count} tiles list exactly the tiles that lie below them")


def check_headers(folder, pyproj):
    """Each tile's header has its own heights; its sphere holds the tile; its horizon point hides no visible vertex."""
    centred = pyproj.Transformer.from_crs(4979, 4978, always_xy=True)
    axes = numpy.array([6378137.0, 6378137.0, 6356752.314245179])
    own, spheres, horizons, count = True, True, True, 0
    for path in folder.rglob("*.terrain"):
        tile, count = Terrain(path.read_bytes()), count + 1
        degrees = 180 / 2 ** int(path.parent.parent.name)
        own &= tile.h.min() == 0 and tile.h.max() == (32767 if tile.low < tile.high else 0)
        longitude = (int(path.parent.name) + tile.u / 32767) * degrees - 180
        latitude = (int(path.stem) + tile.v / 32767) * degrees - 90
        places = numpy.array(centred.transform(longitude, latitude, tile.height)).T
        far = numpy.linalg.norm(places - tile.sphere, axis=1)
        spheres &= bool((far <= tile.radius + tile.step + 0.01).all() and tile.radius < 1.01 * far.max() + 1)
        # What hides the point hides every vertex: it is higher above the horizon than each, as seen from the middle.
        point, scaled = numpy.array(tile.horizon), places / axes
        distance = numpy.maximum(numpy.linalg.norm(scaled, axis=1), 1)
        away = numpy.linalg.norm(point)
        cosines = numpy.clip(scaled @ point / numpy.linalg.norm(scaled, axis=1) / away, -1, 1)
        needed = numpy.arccos(cosines) + numpy.arccos(1 / distance)
        horizons &= bool(away >= 1 - 1e-12 and (needed <= numpy.arccos(min(1, 1 / away)) + 1e-6).all() or away > 99)
    expect(own, f"the headers of {count} tiles have each tile's own lowest and highest height")
    expect(spheres, "their spheres hold them")
    expect(horizons, "what hides their horizon points hides all of them")


def altitude(corners):
    """The smallest altitude of a triangle seen from above."""
    (x0, y0, _), (x1, y1, _), (x2, y2, _) = corners
    doubled = abs((x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0))
    return doubled / max(math.dist(a[:2], b[:2]) for a, b in zip(corners, [*corners[1:], corners[0]]))


def cesium_places(database, arguments, scratch):
    """Heights at the middle of triangles, taken as ellipsoidal so that PROJ alone says where they are."""
    if not arguments.node_modules or not shutil.which("chromium"):
        raise Skip("no --node-modules with cesium and puppeteer-core, or no chromium")
    pyproj = globe(database, database.places)[3]
    to = pyproj.Transformer.from_crs(database.manifest["area"]["crs"], 4326, always_xy=True)
    modules = list(database.modules.items())
    places = []
    for (row, col), module in modules[:: max(1, len(modules) // 100)]:
        # A needle has no height of its own in a format that moves its corners by centimetres.
        found = [[module["vertices"][v] for v in triangle] for triangle in module["triangles"]]
        found = [corners for corners in found if 128 < altitude(corners)]
        corners = found[len(found) // 2]
        x, y, z = (sum(corner[axis] for corner in corners) / 384 for axis in range(3))
        east, north = database.origin[0] + col * database.side + x, database.origin[1] + row * database.side + y
        places.append([*to.transform(east, north), z])
    (scratch / "places.json").write_text(json.dumps(places))


def check_cesium(database, arguments, scratch):
    """The exports in CesiumJS."""
    cesium_places(database, arguments, scratch)
    terrain = export(arguments, "quantized-mesh", scratch / "level_terrain", "--assume-datum", "ellipsoid")
    implicit = export(arguments, "3dtiles-terrain", scratch / "level_implicit", "--assume-datum", "ellipsoid")
    tileset = export(arguments, "3dtiles", scratch / "level_3dtiles", "--assume-datum", "ellipsoid")
    run_cesium(arguments, scratch, terrain, tileset, "--implicit", str(implicit))


def check_serve(database, arguments, scratch):
    """The same from `tiefort serve`, without any export."""
    cesium_places(database, arguments, scratch)
    command = [arguments.tiefort, "serve", str(database.folder), "--port", "0", "--cors", "*"]
    command += ["--assume-datum", "ellipsoid"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as service:
        try:
            address = service.stdout.readline().strip() + database.folder.resolve().name
            run_cesium(arguments, scratch, address, address)
        finally:
            service.terminate()


def run_cesium(arguments, scratch, terrain, tileset, *more):
    command = ["node", str(readers(arguments)), "--terrain", str(terrain), "--tileset", str(tileset), *more]
    command += ["--places", str(scratch / "places.json")]
    command += ["--pictures", arguments.pictures] if arguments.pictures else []
    ran = subprocess.run(command, capture_output=True, text=True)
    for line in ran.stdout.splitlines():
        print(f"  {line}")
    expect(ran.returncode == 0, f"CesiumJS agrees {ran.stderr[-400:]}")


TOOLS = types.SimpleNamespace(export=export, expect=expect, Skip=Skip, datum=datum)
CHECKS = [
    ("modules", check_modules),
    ("meshes", check_meshes),
    ("glb", check_glb),
    ("geotiff", check_geotiff),
    ("gpkg", check_gpkg),
    ("features", check_features),
    ("openflight", check_openflight),
    ("3dtiles", check_3dtiles),
    ("quantized-mesh", check_quantized_mesh),
    ("cesium", check_cesium),
    ("serve", check_serve),
    *[(name, functools.partial(check, tools=TOOLS)) for name, check in
      engines.CHECKS + objects.CHECKS + sumo.CHECKS],
]

if __name__ == "__main__":
    main()
