"""Several databases as one tileset: areas that meet leave no gap, and of areas that overlap only the finer is there.

Builds three databases over one ground, exports them as one tileset, and casts rays at its finest meshes with Embree.
"""

import json
import subprocess

import numpy

# In metres: origin, size, spacing. West and east meet at 509,000; the fine one ends inside of load modules of both.
AREAS = {
    "west": (505000, 3875000, 4000, 25),
    "east": (509000, 3875000, 4000, 25),
    "fine": (508250, 3876250, 1500, 12.5),
}
BORDER_M = 509000


def built(arguments, scratch):
    """The databases, over hills."""
    row, col = numpy.mgrid[:161, :321]
    heights = 900 + 90 * numpy.sin(row / 31) * numpy.cos(col / 43) + 25 * numpy.sin(row / 7 + col / 11) + col / 10
    lines = ["ncols 321", "nrows 161", "xllcenter 505000", "yllcenter 3875000", "cellsize 25"]
    lines += [" ".join(f"{z:.3f}" for z in line) for line in heights]
    (scratch / "ground.asc").write_text("\n".join(lines) + "\n")
    folders = []
    for name, (east, north, side, spacing) in AREAS.items():
        job = f"""
            [area]
            name = "{name}"
            crs = "EPSG:32611"
            origin_m = [{east}, {north}]
            size_m = [{side}, {side}]
            spacing_m = {spacing}
            [dem]
            sources = [{{ file = "ground.asc", crs = "EPSG:32611" }}]
            vertical_datum = "EGM96"
            [load_modules]
            outer_border = "fixed"
            [tiles]
            columns = 1
            rows = 1
            [limits]
            mean_per_load_module = 32
            [lod]
            levels = [{{ inner_share = 0.5 }}]
            """
        (scratch / f"{name}.toml").write_text(job)
        folders.append(scratch / f"{name}.tdb")
        command = [arguments.tiefort, "build", str(scratch / f"{name}.toml"), "--out", str(folders[-1]), "--quiet"]
        subprocess.run(command, check=True)
    return folders


def finest(folder, read_triangles):
    """The corners of the finest triangles below a tileset, on the globe, of each of its databases."""
    def below(path, tile, matrix):
        matrix = matrix @ numpy.array(tile.get("transform", numpy.eye(4).T.ravel())).reshape(4, 4).T
        content = tile.get("content", {}).get("uri")
        if content and content.endswith(".json"):
            inner = path.parent / content
            yield from below(inner, json.loads(inner.read_text())["root"], matrix)
        elif "children" in tile:
            for child in tile["children"]:
                yield from below(path, child, matrix)
        elif content:
            x, y, z = read_triangles((path.parent / content).read_bytes()).reshape(-1, 3).T.astype(float)
            yield (matrix @ numpy.array([x, -z, y, numpy.ones_like(x)]))[:3].T.reshape(-1, 3, 3)
    index = folder / "tileset.json"
    root = json.loads(index.read_text())["root"]
    return {child["content"]["uri"][0]: numpy.concatenate(list(below(index, child, numpy.eye(4))))
            for child in root["children"]}


def check(arguments, scratch, tools, read_triangles):
    print("together:")
    try:
        import pyproj
        import trimesh
        from trimesh.ray.ray_pyembree import RayMeshIntersector
    except ImportError as error:
        print(f"  skipped: {error}")
        return
    folders = built(arguments, scratch)
    out = scratch / "together"
    command = [arguments.tiefort, "export", *map(str, folders), "--format", "3dtiles", "--out", str(out)]
    print("  " + subprocess.run(command, check=True, capture_output=True, text=True).stderr.replace("\n", "\n  "))
    to_map = pyproj.Transformer.from_crs(4978, "EPSG:32611", always_xy=True)
    grounds = {}
    for number, corners in finest(out, read_triangles).items():
        x, y, z = to_map.transform(*corners.reshape(-1, 3).T)
        grounds[number] = numpy.array([x - BORDER_M, y - 3875000, z]).T.reshape(-1, 3, 3)

    def caster(*numbers):
        corners = numpy.concatenate([grounds[number] for number in numbers])
        mesh = trimesh.Trimesh(corners.reshape(-1, 3), numpy.arange(corners.size // 3).reshape(-1, 3), process=False)
        ray = RayMeshIntersector(mesh, scale_to_box=False)

        def heights(places):
            """Of the ground straight below places, NaN where there is none."""
            origins = numpy.column_stack([places, numpy.full(len(places), 3000.0)])
            found = numpy.full(len(places), numpy.nan)
            where, index, _ = ray.intersects_location(origins, numpy.tile([0.0, 0.0, -1.0], (len(places), 1)), False)
            found[index] = where[:, 2]
            return found
        return heights

    draw = numpy.random.default_rng(1)
    whole, west, east, fine = caster(*grounds), caster("1"), caster("2"), caster("3")
    # The common border, but for where the fine one lies over it.
    along = draw.uniform(1, 3999, 100_000)
    along = along[(along < 1245) | (2755 < along)]
    across = draw.uniform(-0.05, 0.05, len(along))
    seen = whole(numpy.column_stack([across, along]))
    tools.expect(not numpy.isnan(seen).any(), f"{len(along)} rays within 5 cm of the common border all meet ground")
    sides = [heights(numpy.column_stack([numpy.full(len(along), x), along]))
             for heights, x in ((west, -0.002), (east, 0.002))]
    step = numpy.abs(sides[0] - sides[1]).max()
    tools.expect(step < 0.005, f"2 mm on either side of it the ground is as high, within {1000 * step:.2f} mm")
    slanted(grounds, along, tools)
    # Inside of the fine area there is nothing else, and around it nothing is missing.
    inside = draw.uniform([-749.9, 1250.1], [749.9, 2749.9], (100_000, 2))
    is_bare = numpy.isnan(west(inside)).all() and numpy.isnan(east(inside)).all()
    tools.expect(is_bare and not numpy.isnan(fine(inside)).any(), "in the fine area there is its ground alone")
    around = draw.uniform([-1500, 500], [1500, 3500], (100_000, 2))
    missing = numpy.isnan(whole(around))
    tools.expect(not missing.any(), f"of {len(around)} rays around it {missing.sum()} meet no ground")
    near = numpy.concatenate([numpy.column_stack([draw.uniform(-750, 750, 20_000), numpy.full(20_000, y)])
                              for y in (1250, 2750)])
    out_of = numpy.where(near[:, 1] < 2000, -0.002, 0.002)
    coarse = whole(near + numpy.column_stack([0 * out_of, out_of]))
    step = numpy.abs(coarse - fine(near - numpy.column_stack([0 * out_of, out_of])))
    print(f"  told  along its border it stands {numpy.nanmean(step):.2f} m above or below the coarser, at most "
          f"{numpy.nanmax(step):.2f} m")


def slanted(grounds, along, tools):
    """Rays that cross the border low over the ground, from both sides: none goes under."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector
    corners = numpy.concatenate([grounds["1"], grounds["2"]])
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), numpy.arange(corners.size // 3).reshape(-1, 3), process=False)
    ray = RayMeshIntersector(mesh, scale_to_box=False)
    missed = 0
    for side in (-1.0, 1.0):
        origins = numpy.column_stack([numpy.full(len(along), 400.0 * side), along, numpy.full(len(along), 1800.0)])
        towards = numpy.tile([-side * 0.4, 0.0, -0.9], (len(along), 1))
        missed += (~ray.intersects_any(origins, towards)).sum()
    tools.expect(missed == 0, f"of {2 * len(along)} slanted rays over the border {missed} go through")
