"""SUMO's netconvert with the GeoTIFF of the surface as its heightmap: heights of roads in its network and in OpenDRIVE.

netconvert is that of `pip install eclipse-sumo`, on the path or beside this Python.
"""

import math
import pathlib
import random
import shutil
import subprocess
import sys
import xml.etree.ElementTree as xml

import numpy

from . import engines


def check_sumo(database, arguments, scratch, tools):
    """Roads through posts have the heights of the ground there; between posts it is told how far off they are."""
    beside = pathlib.Path(sys.executable).parent / "netconvert"
    netconvert = shutil.which("netconvert") or (beside if beside.exists() else None)
    try:
        import pyproj
    except ImportError as error:
        raise tools.Skip(error) from error
    if netconvert is None:
        raise tools.Skip("no netconvert: pip install eclipse-sumo")
    if database.holes:
        raise tools.Skip("netconvert takes a hole for a height")
    raster = tools.export(arguments, "geotiff", scratch / "sumo.tif")
    crs = pyproj.CRS(database.manifest["area"]["crs"])
    write_roads(database, scratch, pyproj.Transformer.from_crs(crs, 4326, always_xy=True))
    projection = ["--proj", pyproj.CRS(crs).to_proj4().replace(" +type=crs", ""), "--proj.plain-geo"]

    def convert(nodes, edges, *more):
        command = [netconvert, "-n", scratch / nodes, "-e", scratch / edges, *projection, "--precision.geo", "9", *more]
        ran = subprocess.run(list(map(str, command)), capture_output=True, text=True)
        tools.expect(ran.returncode == 0, f"netconvert ends well {ran.stderr[-200:] if ran.returncode else ''}")

    # Where a road is steeper than 10 %, netconvert would raise or lower it.
    heights = ["--heightmap.geotiff", raster, "--geometry.max-grade.fix", "false"]
    network, drive = scratch / "sumo.net.xml", scratch / "sumo.xodr"
    convert("sumo.nod.xml", "sumo.edg.xml", *heights, "-o", network, "--opendrive-output", drive)
    ground = engines.Ground(database)
    off, count = compared(lanes(network, database), ground)
    tools.expect(count > 0 and off.max() < 0.1,
                 f"{count} points of roads at posts are within {off.max():.3f} m of the ground")
    off, count = compared(elevations(drive, network, database), ground)
    tools.expect(count > 0 and off.max() < 0.1,
                 f"{count} of OpenDRIVE's elevations there are within {off.max():.3f} m of it")
    # As a road of OpenStreetMap has it, with points anywhere.
    flat = ["--geometry.max-segment-length", "10", "--plain-output-prefix", scratch / "flat"]
    convert("sumo.nod.xml", "sumo.edg.xml", *flat, "-o", scratch / "flat.net.xml")
    convert("flat.nod.xml", "flat.edg.xml", *heights, "-o", network)
    off, count = compared(lanes(network, database), ground)
    print(f"  told  {count} points between posts of {database.manifest['area']['spacing_m']} m: half within "
          f"{numpy.median(off):.3f} m of the ground, 95 % within {numpy.percentile(off, 95):.3f} m, all within "
          f"{off.max():.3f} m")


def write_roads(database, scratch, to):
    """Roads in straight lines from post to post, as netconvert's plain files."""
    draw, spacing = random.Random(3), database.manifest["area"]["spacing_m"]
    wide, high = (int(count * database.side / spacing) for count in (database.cols, database.rows))
    nodes, edges = xml.Element("nodes"), xml.Element("edges")
    for number in range(12):
        # Far enough apart that no point is taken for its neighbour.
        first = draw.randrange(wide // 2), draw.randrange(high // 2)
        step = draw.randrange(1, 4), draw.randrange(4)
        places = [(first[0] + i * step[0], first[1] + i * step[1]) for i in range(max(wide, high))]
        places = [(x, y) for x, y in places if 0 < x < wide and 0 < y < high][:25]
        lon_lat = [to.transform(database.origin[0] + x * spacing, database.origin[1] + y * spacing) for x, y in places]
        for end, (x, y) in (("a", lon_lat[0]), ("b", lon_lat[-1])):
            xml.SubElement(nodes, "node", id=f"{end}{number}", x=f"{x:.9f}", y=f"{y:.9f}")
        shape = " ".join(f"{x:.9f},{y:.9f}" for x, y in lon_lat)
        xml.SubElement(edges, "edge", id=f"e{number}", shape=shape, spreadType="center",
                       **{"from": f"a{number}", "to": f"b{number}"})
    xml.ElementTree(nodes).write(scratch / "sumo.nod.xml")
    xml.ElementTree(edges).write(scratch / "sumo.edg.xml")


def offset(network, database):
    """From the coordinates of a network to metres from the corner of the area."""
    place = xml.parse(network).getroot().find("location").get("netOffset").split(",")
    return [-float(at) - low for at, low in zip(place, database.origin)]


def lanes(network, database):
    """East and north of the area's corner, and the height, of each point of the lanes of a network."""
    east, north = offset(network, database)
    for edge in xml.parse(network).getroot().findall("edge"):
        for lane in edge.findall("lane") if edge.get("function") != "internal" else []:
            for point in lane.get("shape").split():
                x, y, z = (float(value) for value in point.split(","))
                yield x + east, y + north, z


def elevations(drive, network, database):
    """The same of the places of OpenDRIVE at which a piece of a reference line and one of its heights begin.

    Heights are those of the middle of the lane, which lies to the right of that line.
    """
    east, north = offset(network, database)
    for road in xml.parse(drive).getroot().findall("road"):
        heights = {round(float(of.get("s")), 2): float(of.get("a")) for of in road.iter("elevation")}
        half = next(float(of.get("a")) for of in road.iter("width")) / 2
        for piece in road.iter("geometry"):
            z = heights.get(round(float(piece.get("s")), 2))
            if z is not None and road.get("junction") == "-1":
                x, y, heading = (float(piece.get(key)) for key in ("x", "y", "hdg"))
                yield x + half * math.sin(heading) + east, y - half * math.cos(heading) + north, z


def compared(points, ground):
    """How far points lie off the ground, and how many do."""
    off = numpy.array([abs(z - ground.height(x, y)) for x, y, z in points])
    return off, len(off)


CHECKS = [("sumo", check_sumo)]
