#!/usr/bin/env python3
"""Exports a terrain database in every format and opens each with a reader that is not ours.

    python3 scripts/check_exports.py DIR [--tiefort target/release/tiefort] [--node-modules DIR]

Needs rasterio, geopandas, pyogrio, pyproj and numpy; osgconv (Debian's openscenegraph); node with what
scripts/exports/package.json names for glTF and CesiumJS, and chromium. A reader that is missing is told and skipped,
unless --all is given.
"""

import argparse
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import read_slm  # noqa: E402

HERE = pathlib.Path(__file__).parent
faults = []


def expect(holds, what):
    print(("  ok    " if holds else "  WRONG ") + what)
    if not holds:
        faults.append(what)


class Database:
    """The load modules, by the reader that was written from FORMAT.md alone."""

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
        self.places = set()
        for (row, col), module in self.modules.items():
            for x, y, z in module["vertices"]:
                self.places.add((col * self.side + x / 128, row * self.side + y / 128, z / 128))
        self.vertices = len(self.places)
        self.heights = [z for _, _, z in self.places]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database")
    parser.add_argument("--tiefort", default="target/release/tiefort")
    parser.add_argument("--node-modules", help="folder that holds node_modules with gltf-validator")
    parser.add_argument("--pictures", help="folder for screenshots of CesiumJS")
    parser.add_argument("--only", help="formats to check, with commas between")
    parser.add_argument("--all", action="store_true", help="a missing reader is a fault")
    arguments = parser.parse_args()
    database = Database(arguments.database)
    print(f"{len(database.modules)} load modules, {database.vertices} vertices, {database.triangles} triangles")
    only = arguments.only.split(",") if arguments.only else [name for name, _ in CHECKS]
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        for name, check in CHECKS:
            if name not in only:
                continue
            print(f"{name}:")
            try:
                check(database, arguments, scratch)
            except Skip as reason:
                print(f"  skipped: {reason}")
                if arguments.all:
                    faults.append(f"{name} was skipped: {reason}")
    print(f"{len(faults)} faults")
    sys.exit(1 if faults else 0)


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


def check_modules(database, arguments, scratch):
    folder = export(arguments, "modules", scratch / "modules")
    files = sorted(folder.glob("*.slm"))
    expect(len(files) == len(database.modules), f"{len(files)} files, one for each load module")
    same = 0
    for path in files:
        _, levels = read_slm.parse(path.read_bytes())
        same += levels == database.levels[levels[0]["row"], levels[0]["column"]]
    expect(same == len(files), "each holds its load module as it is in the database, at every level")
    shutil.rmtree(folder)


def check_meshes(database, arguments, scratch):
    ply = export(arguments, "ply", scratch / "mesh.ply").read_bytes()
    head, body = ply.split(b"end_header\n", 1)
    counts = [int(n) for n in re.findall(rb"element \w+ (\d+)", head)]
    expect(counts == [database.vertices, database.triangles], f"ply has {counts[0]} vertices, {counts[1]} triangles")
    places = numpy.frombuffer(body, "<f4", 3 * counts[0]).reshape(-1, 3).astype(float)
    expect({tuple(place) for place in places} == database.places, "ply: every vertex at its place, exactly")
    obj = export(arguments, "obj", scratch / "mesh.obj", "--coordinates", "map").read_text().splitlines()
    places = {tuple(map(float, line.split()[1:])) for line in obj if line.startswith("v ")}
    east, north = database.origin
    expect(places == {(x + east, y + north, z) for x, y, z in database.places}, "obj: every vertex on the map")
    expect(sum(line.startswith("f ") for line in obj) == database.triangles, "obj: every triangle")
    sidecar = json.loads((scratch / "mesh.ply.json").read_text())
    expect(sidecar["offset_m"] == [*database.origin, 0.0], "the sidecar says where that is")


def check_glb(database, arguments, scratch):
    glb = export(arguments, "glb", scratch / "mesh.glb")
    document, _ = read_glb(glb.read_bytes())
    expect(document["accessors"][0]["count"] == database.vertices, "glb: every vertex")
    validate([glb], arguments)


def validate(files, arguments):
    if not arguments.node_modules or not shutil.which("node"):
        raise Skip("no --node-modules with gltf-validator, or no node")
    script = pathlib.Path(arguments.node_modules) / "validate_gltf.mjs"
    if not script.exists():
        shutil.copy(HERE / "exports" / "validate_gltf.mjs", script)
    ran = subprocess.run(["node", str(script), *map(str, files)], capture_output=True, text=True)
    expect(ran.returncode == 0, f"gltf-validator: {ran.stdout.strip().splitlines()[-1]}")


def read_glb(data):
    magic, version, length, json_length = struct.unpack_from("<4sIII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    return json.loads(data[20:20 + json_length]), data[28 + json_length:]


def glb_positions(data):
    document, binary = read_glb(data)
    accessor = document["accessors"][0]
    start = document["bufferViews"][accessor["bufferView"]]["byteOffset"]
    return numpy.frombuffer(binary, "<f4", 3 * accessor["count"], start).reshape(-1, 3).astype(float)


def check_geotiff(database, arguments, scratch):
    try:
        import rasterio
    except ImportError as error:
        raise Skip(error) from error
    path = export(arguments, "geotiff", scratch / "surface.tif")
    with rasterio.open(path) as raster:
        surface, profile = raster.read(1), raster.profile
        expect(profile["tiled"] and profile["compress"] == "deflate", "tiled and deflated")
        structure = raster.tags(ns="IMAGE_STRUCTURE")
        expect(structure.get("PREDICTOR", "3") == "3", f"predictor 3 ({structure})")
        code = database.manifest["area"]["crs"].removeprefix("EPSG:")
        expect(f'"EPSG","{code}"' in raster.crs.to_wkt(), f"rasterio reads EPSG:{code}")
        expect(numpy.isnan(raster.nodata), "nodata is NaN")
        spacing = database.manifest["area"]["spacing_m"]
        checked = 0
        for x, y, z in database.places:
            if x % spacing == 0 and y % spacing == 0:
                row, col = raster.index(x + database.origin[0], y + database.origin[1])
                checked += surface[row, col] == numpy.float32(z)
        posts = sum(x % spacing == 0 and y % spacing == 0 for x, y, _ in database.places)
        expect(checked == posts, f"{posts} vertices on posts have their height at that place")
        expect(min(database.heights) <= surface.min() and surface.max() <= max(database.heights), "no height beyond")
    residual = export(arguments, "geotiff", scratch / "residual.tif", "--layer", "residual")
    with rasterio.open(residual) as raster:
        values = raster.read(1).astype(float)
        found = values[~numpy.isnan(values)]
        rms, told = numpy.sqrt((found ** 2).mean()), database.report["residual"]["rms_m"]
        expect(abs(rms - told) < 1e-9, f"RMS of the residual raster {rms:.6f} m, in the report {told:.6f} m")


def check_gpkg(database, arguments, scratch):
    try:
        import geopandas
    except ImportError as error:
        raise Skip(error) from error
    path = export(arguments, "gpkg", scratch / "area.gpkg")
    layers = {name: geopandas.read_file(path, layer=name) for name in ["load_modules", "tiles", "breaches"]}
    expect(len(layers["load_modules"]) == len(database.modules), "load_modules: a feature for each")
    code = int(database.manifest["area"]["crs"].removeprefix("EPSG:"))
    expect(layers["load_modules"].crs.to_epsg() == code, f"in EPSG:{code}")
    expect(len(layers["tiles"]) == len(database.manifest["tiles"]), "tiles: a feature for each")
    expect(len(layers["breaches"]) == len(database.report["breaches"]), "breaches: a feature for each")
    expect(int(layers["load_modules"].triangles.sum()) == database.triangles, "counts add up")
    triangles = geopandas.read_file(path, layer="triangles")
    expect(len(triangles) == database.triangles and bool(triangles.has_z.all()), "triangles: polygons with heights")
    import pyogrio
    fast = pyogrio.read_info(path, layer="triangles")["capabilities"]["fast_spatial_filter"]
    east, north = (database.origin[axis] + database.side / 2 for axis in (0, 1))
    near = geopandas.read_file(path, layer="triangles", bbox=(east, north, east + 1, north + 1))
    touching = int(triangles.intersects(near.union_all().envelope).sum())
    expect(fast and 0 < len(near) <= touching, f"triangles: {len(near)} found through the spatial index")
    area = triangles.geometry.area.sum()
    whole = database.rows * database.cols * database.side ** 2
    expect(abs(area / whole - 1) < 1e-9, f"triangles cover {area / 1e6:.3f} km2")


def check_openflight(database, arguments, scratch):
    folder = export(arguments, "openflight", scratch / "flt")
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
    expect(faces == database.triangles, f"{faces} triangles come out")
    places = numpy.array(places)
    # OSG's OBJ writer may turn axes: compare the extents of each axis in any order.
    extents = sorted(numpy.round(places.max(0) - places.min(0), 2))
    own = numpy.array(sorted(database.places))
    expected = sorted(numpy.round(own.max(0) - own.min(0), 2))
    expect(numpy.allclose(extents, expected, atol=0.05), f"bounds {extents}, expected {expected}")
    import xml.etree.ElementTree as xml
    tree = xml.parse(folder / "area.mft").getroot()
    listed = [tile.get("file") for tile in tree.iter("Tile")]
    there = all((folder / name).exists() for name in listed)
    expect(there and len(listed) == len(squares), "the index lists each file")


def globe(database):
    """The places of all vertices on the globe, by PROJ, with the offset of heights that tiefort chose."""
    try:
        import pyproj
    except ImportError as error:
        raise Skip(error) from error
    own = numpy.array(sorted(database.places))
    to = pyproj.Transformer.from_crs(database.manifest["area"]["crs"], 4326, always_xy=True)
    longitude, latitude = to.transform(own[:, 0] + database.origin[0], own[:, 1] + database.origin[1])
    return own, numpy.array(longitude), numpy.array(latitude), pyproj


def check_3dtiles(database, arguments, scratch):
    folder = export(arguments, "3dtiles", scratch / "3dtiles", *datum(database))
    own, longitude, latitude, pyproj = globe(database)
    tileset = json.loads((folder / "tileset.json").read_text())
    geodetic = pyproj.Transformer.from_crs(4978, 4979, always_xy=True)
    found, triangles, files, levels, worst = {}, 0, [], [], True
    for square in tileset["root"]["children"]:
        matrix = numpy.array(square["transform"]).reshape(4, 4).T
        leaves = square
        # Coarser levels of detail, one mesh each, stand between a square and its load modules.
        while "children" in leaves["children"][0]:
            worst &= leaves["children"][0]["geometricError"] <= leaves["geometricError"]
            leaves = leaves["children"][0]
            levels.append(folder / leaves["content"]["uri"])
        worst &= all(child["geometricError"] <= tileset["geometricError"] for child in leaves["children"])
        for child in leaves["children"]:
            path = folder / child["content"]["uri"]
            files.append(path)
            document, _ = read_glb(path.read_bytes())
            for primitive in document["meshes"][0]["primitives"]:
                triangles += document["accessors"][primitive["indices"]]["count"] // 3
            x, y, z = glb_positions(path.read_bytes()).T
            place = matrix @ numpy.array([x, -z, y, numpy.ones_like(x)])
            lon, lat, height = geodetic.transform(*place[:3])
            for key in zip(numpy.round(lon, 7), numpy.round(lat, 7), height):
                found.setdefault(key[:2], []).append(key[2])
            box = numpy.array(child["boundingVolume"]["box"])
            local = numpy.array([x, -z, y]).T - box[:3]
            worst &= bool((numpy.abs(local) <= box[[3, 7, 11]] + 1e-3).all())
    expect(triangles == database.triangles, f"{triangles} triangles in {len(files)} load modules")
    expect(worst, "boxes hold their content, errors shrink on the way down")
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
    squares = [folder / square["content"]["uri"] for square in tileset["root"]["children"]]
    validate(squares + levels + files[:100], arguments)


def decode_terrain(data):
    count = struct.unpack_from("<I", data, 88)[0]
    low, high = struct.unpack_from("<ff", data, 24)
    folded = numpy.frombuffer(data, "<u2", 3 * count, 92).reshape(3, count).astype(int)
    u, v, h = numpy.cumsum((folded >> 1) ^ -(folded & 1), axis=1)
    at = 92 + 6 * count
    total = struct.unpack_from("<I", data, at)[0]
    codes = numpy.frombuffer(data, "<u2", 3 * total, at + 4).astype(int)
    high_water = numpy.concatenate([[0], numpy.cumsum(codes == 0)[:-1]])
    return u, v, low + h / 32767 * (high - low), (high_water - codes).reshape(-1, 3), (high - low) / 32767


def check_quantized_mesh(database, arguments, scratch):
    folder = export(arguments, "quantized-mesh", scratch / "terrain", *datum(database))
    own, longitude, latitude, _ = globe(database)
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
    places = {}
    for path in (folder / str(level)).rglob("*.terrain"):
        x, y = int(path.parent.name), int(path.stem)
        u, v, height, triangles, rung = decode_terrain(path.read_bytes())
        for a, b, c in zip(u + x * 32767, v + y * 32767, height):
            places[a, b] = c
    step = degrees / 32767
    offsets, missing = [], 0
    for (_, _, z), lon, lat in zip(own, longitude, latitude):
        a, b = (lon + 180) / step, (lat + 90) / step
        near = [(round(a), round(b)), (int(a), int(b)), (int(a) + 1, int(b)), (int(a), int(b) + 1)]
        height = next((places[key] for key in near if key in places), None)
        if height is None:
            missing += 1
        else:
            offsets.append(height - z)
    expect(missing == 0, f"every vertex is in a tile ({missing} missing), steps of {rung * 100:.1f} cm up")
    spread = max(offsets) - min(offsets)
    expect(spread < 5, f"heights differ from the database's by {min(offsets):.3f} to {max(offsets):.3f} m")


def check_cesium(database, arguments, scratch):
    """Heights at the middle of triangles, taken as ellipsoidal so that PROJ alone says where they are."""
    if not arguments.node_modules or not shutil.which("chromium"):
        raise Skip("no --node-modules with cesium and puppeteer-core, or no chromium")
    pyproj = globe(database)[3]
    to = pyproj.Transformer.from_crs(database.manifest["area"]["crs"], 4326, always_xy=True)
    modules = list(database.modules.items())
    places = []
    for (row, col), module in modules[:: max(1, len(modules) // 100)]:
        corners = [module["vertices"][v] for v in module["triangles"][len(module["triangles"]) // 2]]
        x, y, z = (sum(corner[axis] for corner in corners) / 384 for axis in range(3))
        east, north = database.origin[0] + col * database.side + x, database.origin[1] + row * database.side + y
        places.append([*to.transform(east, north), z])
    (scratch / "places.json").write_text(json.dumps(places))
    terrain = export(arguments, "quantized-mesh", scratch / "level_terrain", "--assume-datum", "ellipsoid")
    tileset = export(arguments, "3dtiles", scratch / "level_3dtiles", "--assume-datum", "ellipsoid")
    script = pathlib.Path(arguments.node_modules) / "cesium.mjs"
    shutil.copy(HERE / "exports" / "cesium.mjs", script)
    command = ["node", str(script), "--terrain", str(terrain), "--tileset", str(tileset)]
    command += ["--places", str(scratch / "places.json")]
    command += ["--pictures", arguments.pictures] if arguments.pictures else []
    ran = subprocess.run(command, capture_output=True, text=True)
    for line in ran.stdout.splitlines():
        print(f"  {line}")
    expect(ran.returncode == 0, f"CesiumJS agrees {ran.stderr[-400:]}")


CHECKS = [
    ("modules", check_modules),
    ("meshes", check_meshes),
    ("glb", check_glb),
    ("geotiff", check_geotiff),
    ("gpkg", check_gpkg),
    ("openflight", check_openflight),
    ("3dtiles", check_3dtiles),
    ("quantized-mesh", check_quantized_mesh),
    ("cesium", check_cesium),
]

if __name__ == "__main__":
    main()
