#!/usr/bin/env python3
"""Compare our coordinate systems with PROJ, at 1000 places each.

    python3 -m venv /tmp/compare && /tmp/compare/bin/pip install pyproj rasterio
    cargo build --release -p source-files --example place_points
    /tmp/compare/bin/python scripts/compare_crs.py target/release/examples/place_points

Systems by EPSG code, by the well-known text that ESRI and GDAL write into .prj files, and by the GeoKeys of GeoTIFFs
whose system has no code. Places are drawn in each system's area of use. Exit code 1 when any place is more than a
millimetre off, there or back.
"""

import pathlib
import random
import subprocess
import sys
import tempfile

import numpy
import pyproj
import rasterio
from rasterio.transform import Affine

CODES = [4326, 4269, 4258, 3857, 3395, 5070, 3035, 3034, 2154, 6350, 3310, 2193, 3577, 28355, 7855, 31982, 3979, 3005,
         3413, 3031, 5041, 5042, 32661, 2229, 2263, 26910, 26919, 25829, 25832, 25835, 4485, 4647, 3067, 3006, 2180,
         6339, 6414, 32601, 32611, 32632, 32660, 32701, 32733, 32760, 3763, 3812]
OWN = {
    "transverse mercator": "+proj=tmerc +lat_0=10 +lon_0=-116.5 +k=0.9999 +x_0=200000 +y_0=-50000 +datum=WGS84",
    "utm without a code": "+proj=tmerc +lat_0=0 +lon_0=-117 +k=0.9996 +x_0=500000 +y_0=0 +datum=NAD83",
    "lambert, 2 parallels": "+proj=lcc +lat_0=38 +lon_0=-116 +lat_1=36 +lat_2=41 +x_0=1e6 +y_0=2e5 +datum=NAD83",
    "lambert, 1 parallel": "+proj=lcc +lat_0=38 +lon_0=-116 +lat_1=38 +k_0=0.9998 +x_0=1e6 +y_0=2e5 +datum=WGS84",
    "lambert in feet": "+proj=lcc +lat_0=33.5 +lon_0=-118 +lat_1=34 +lat_2=35.5 +x_0=609601.2192 +datum=NAD83"
                       " +units=us-ft",
    "albers": "+proj=aea +lat_0=23 +lon_0=-110 +lat_1=29.5 +lat_2=45.5 +x_0=0 +y_0=0 +datum=WGS84",
    "albers, south": "+proj=aea +lat_0=-32 +lon_0=-60 +lat_1=-5 +lat_2=-42 +x_0=0 +y_0=0 +ellps=GRS80 +towgs84=0,0,0",
}


def ours(program, system, places):
    text = "\n".join(f"{lon} {lat}" for lon, lat in places)
    run = subprocess.run([program, system], input=text, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        return run.stderr.split("refused: ")[-1].splitlines()[0]
    return numpy.array([[float(word) for word in line.split()] for line in run.stdout.splitlines()])


def compare(program, name, system, crs, box):
    random.seed(name)
    places = [(random.uniform(box[0], box[2]), random.uniform(box[1], box[3])) for _ in range(1000)]
    found = ours(program, system, places)
    if isinstance(found, str):
        print(f"refused  {name}: {found}")
        return 0
    if crs.is_geographic:
        expected = numpy.array(places)
        unit = 111319.0
    else:
        expected = numpy.column_stack(pyproj.Proj(crs)(*numpy.array(places).T))
        unit = crs.axis_info[0].unit_conversion_factor
    off = numpy.abs(found[:, :2] - expected).max() * unit * 1000
    back = numpy.abs(found[:, 2:] - numpy.array(places)).max() * 111319000.0
    worst = max(off, back)
    verdict = "equal " if worst < 1 else "DIFFERS"
    print(f"{verdict}  {name}: {off:.6f} mm there, {back:.6f} mm back")
    return int(not worst < 1)


def main():
    program, bad = sys.argv[1], 0
    for code in CODES:
        crs = pyproj.CRS.from_epsg(code)
        area = crs.area_of_use
        west, east = (area.west, area.east) if area.west < area.east else (area.west, 180.0)
        box = (west, max(area.south, -89.9), east, min(area.north, 89.9))
        bad += compare(program, f"EPSG:{code} {crs.name}", f"EPSG:{code}", crs, box)
    with tempfile.TemporaryDirectory() as folder:
        for name, definition in OWN.items():
            crs = pyproj.CRS.from_proj4(definition)
            box = (-70, -45, -50, -10) if "south" in name else (-119, 32, -113, 42)
            for dialect in ["WKT1_ESRI", "WKT1_GDAL"]:
                bad += compare(program, f"{name}, {dialect}", crs.to_wkt(dialect), crs, box)
            path = pathlib.Path(folder) / f"{name}.tif"
            with rasterio.open(path, "w", driver="GTiff", width=2, height=2, count=1, dtype="int16", crs=definition,
                               transform=Affine(10, 0, 5e5, 0, -10, 4e6)) as out:
                out.write(numpy.zeros((1, 2, 2), "int16"))
            bad += compare(program, f"{name}, GeoKeys", str(path), crs, box)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
