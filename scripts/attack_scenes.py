"""Scenes for attack.py: ground, roads and water, and jobs over them, each from a seed.

Heights are posts of the working grid itself, in quanta of 1/128 m from the south-west, NaN for a void; they are written
as an Esri ASCII grid, so that a judge knows every post without resampling.
"""

import json
import math
import os
import pathlib
import random
import struct
import zlib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
QUANTA = 128
CRS = "EPSG:32611"
# The same, for programs that are given a raster alone.
PRJ = (
    'PROJCS["WGS_1984_UTM_Zone_11N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",'
    'SPHEROID["WGS_1984",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["Degree",0.0174532925199433]],'
    'PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",-117],'
    'PARAMETER["scale_factor",0.9996],'
    'PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["Meter",1]]'
)


def data_folder():
    """Folder of the real rasters, or None."""
    for folder in (os.environ.get("TIEFORT_DATA"), ROOT.parent / "shared/data"):
        if folder and pathlib.Path(folder, "dem").is_dir():
            return pathlib.Path(folder)
    return None


class Grid:
    """The working grid of a scene: load modules of so many cells a side."""

    def __init__(self, draw):
        while True:
            self.spacing_m = draw.choice([5, 10, 12.5, 25, 25, 30])
            self.cells = draw.choice([8, 10, 16, 20])
            self.rows, self.columns = draw.randint(2, 6), draw.randint(2, 6)
            self.side_m = self.spacing_m * self.cells
            if self.side_m <= 500 and self.rows * self.columns * self.cells**2 <= 8000:
                break
        self.size = (self.rows * self.cells + 1, self.columns * self.cells + 1)
        self.tiles = (draw.randint(1, self.rows // 2), draw.randint(1, self.columns // 2))
        self.origin_m = (500000 + draw.randrange(100) * self.spacing_m, 3900000 + draw.randrange(100) * self.spacing_m)
        self.width_m, self.height_m = self.columns * self.side_m, self.rows * self.side_m

    def place(self, x, y):
        """Coordinates of a place in metres from the area's corner."""
        return [round(self.origin_m[0] + x, 4), round(self.origin_m[1] + y, 4)]


# Ground, in metres.


def plane(draw, grid):
    y, x = np.mgrid[0 : grid.size[0], 0 : grid.size[1]] * grid.spacing_m
    return draw.uniform(-0.1, 0.1) * x + draw.uniform(-0.1, 0.1) * y + draw.choice([0, 100, 1000, -50])


def smooth(draw, grid, rough=None):
    """Hills: waves of falling height and growing number."""
    y, x = np.mgrid[0 : grid.size[0], 0 : grid.size[1]] * grid.spacing_m
    found, high = np.zeros(grid.size), draw.choice([2, 20, 80, 300])
    length = draw.uniform(0.5, 2) * max(grid.width_m, grid.height_m)
    for _ in range(7):
        angle, phase = draw.uniform(0, math.tau), draw.uniform(0, math.tau)
        found += high * np.sin((x * math.cos(angle) + y * math.sin(angle)) * math.tau / length + phase)
        high, length = high * (rough or 0.55), max(length * 0.6, 3 * grid.spacing_m)
    return found


def cliffs(draw, grid):
    y, x = np.mgrid[0 : grid.size[0], 0 : grid.size[1]] * grid.spacing_m
    found = plane(draw, grid)
    for _ in range(draw.randint(1, 3)):
        angle, high = draw.uniform(0, math.tau), draw.choice([10, 60, 100, 300])
        along = x * math.cos(angle) + y * math.sin(angle)
        found += np.where(along > draw.uniform(0.2, 0.8) * along.max(), high, 0)
    return found


def mesas(draw, grid):
    found = plane(draw, grid)
    for _ in range(draw.randint(1, 6)):
        row, column = draw.randrange(grid.size[0]), draw.randrange(grid.size[1])
        y, x = np.mgrid[0 : grid.size[0], 0 : grid.size[1]]
        away = np.hypot(y - row, x - column) if draw.random() < 0.5 else np.maximum(abs(y - row), abs(x - column))
        found[away < draw.randint(2, 15)] += draw.choice([60, 20, -40, 150])
    return found


def urban(draw, grid):
    """A surface model: blocks on streets."""
    found = plane(draw, grid)
    for _ in range(draw.randint(5, 60)):
        row, column = draw.randrange(grid.size[0]), draw.randrange(grid.size[1])
        found[row : row + draw.randint(1, 6), column : column + draw.randint(1, 6)] += draw.uniform(3, 60)
    return found


def noise(draw, grid):
    generator = np.random.default_rng(draw.getrandbits(32))
    return plane(draw, grid) + generator.normal(0, draw.choice([0.5, 3, 30]), grid.size)


def spikes(draw, grid):
    generator = np.random.default_rng(draw.getrandbits(32))
    rare = generator.random(grid.size) < draw.choice([0.003, 0.02, 0.2])
    return smooth(draw, grid) + np.where(rare, generator.uniform(-300, 300, grid.size), 0)


def quarry(draw, grid):
    found = smooth(draw, grid, 0.4)
    y, x = np.mgrid[0 : grid.size[0], 0 : grid.size[1]]
    away = np.hypot(y - grid.size[0] * draw.uniform(0.2, 0.8), x - grid.size[1] * draw.uniform(0.2, 0.8))
    for bench in range(draw.randint(2, 6)):
        found[away < 18 - 3 * bench] -= draw.choice([8, 12, 20])
    return found


def terraces(draw, grid):
    step = draw.choice([1, 5, 25])
    return np.floor(smooth(draw, grid) / step) * step


def valley(draw, grid):
    """A gorge across the area, for bridges."""
    y, x = np.mgrid[0 : grid.size[0], 0 : grid.size[1]] * grid.spacing_m
    away = abs(x - grid.width_m * draw.uniform(0.3, 0.7) + 0.2 * y)
    deep, wide = draw.choice([15, 40, 90]), grid.spacing_m * draw.uniform(2, 8)
    return plane(draw, grid) - deep * np.exp(-((away / wide) ** 2))


MADE_UP = [smooth, cliffs, mesas, urban, noise, spikes, quarry, terraces, valley]


def window(draw, grid, folder):
    """A window of a real raster, its posts taken as they are; None where no raster can be read here."""
    files = sorted(folder.glob("dem/*.tif")) + sorted(folder.glob("vectors/*/*.tif"))
    for file in draw.sample(files, len(files)):
        found = read_tiff(file)
        if found is None or found.shape[0] < grid.size[0] or found.shape[1] < grid.size[1]:
            continue
        row, column = (draw.randint(0, found.shape[at] - grid.size[at]) for at in (0, 1))
        cut = found[row : row + grid.size[0], column : column + grid.size[1]]
        if np.isnan(cut).mean() < 0.3:
            return cut[::-1].copy(), file.stem
    return None


READ = {}


def read_tiff(path):
    """Heights of a GeoTIFF of strips or tiles, plain or deflated, from the north; None where it is of another kind."""
    if path not in READ:
        READ[path] = decode_tiff(path.read_bytes())
    return READ[path]


def decode_tiff(data):
    order = "<" if data[:2] == b"II" else ">"
    (at,) = struct.unpack_from(order + "I", data, 4)
    tags = {}
    for entry in range(struct.unpack_from(order + "H", data, at)[0]):
        tag, kind, count, _ = struct.unpack_from(order + "HHII", data, at + 2 + 12 * entry)
        letter = {2: "c", 3: "H", 4: "I", 12: "d"}.get(kind)
        if letter:
            place = at + 10 + 12 * entry
            if count * struct.calcsize(letter) > 4:
                (place,) = struct.unpack_from(order + "I", data, place)
            tags[tag] = struct.unpack_from(f"{order}{count}{letter}", data, place)
    wide, high, bits = tags[256][0], tags[257][0], tags[258][0]
    packed, predictor = tags.get(259, (1,))[0], tags.get(317, (1,))[0]
    kind = {(16, 2): "i2", (32, 3): "f4", (16, 1): "u2", (32, 2): "i4"}.get((bits, tags.get(339, (1,))[0]))
    if packed not in (1, 8, 32946) or kind is None:
        return None
    tiled = 322 in tags
    block = (tags[323][0], tags[322][0]) if tiled else (tags.get(278, (high,))[0], wide)
    offsets, lengths = (tags[324], tags[325]) if tiled else (tags[273], tags[279])
    found = np.full((high, wide), np.nan)
    across = -(-wide // block[1])
    for number, (offset, length) in enumerate(zip(offsets, lengths)):
        row, column = number // across * block[0], number % across * block[1]
        rows = block[0] if tiled else min(block[0], high - row)
        raw = data[offset : offset + length] if packed == 1 else zlib.decompress(data[offset : offset + length])
        part = unpredicted(raw, (rows, block[1]), order + kind, predictor)
        part = part[: high - row, : wide - column]
        found[row : row + part.shape[0], column : column + part.shape[1]] = part
    nodata = b"".join(tags.get(42113, ())).rstrip(b"\0 ").decode() or "-32768"
    found[(found == float(nodata)) | (found < -1000) | (found > 9500)] = np.nan
    return found


def unpredicted(raw, shape, kind, predictor):
    if predictor == 3:
        size = int(kind[-1])
        planes = np.frombuffer(raw, "u1").reshape(shape[0], -1).cumsum(1, dtype="u1").reshape(shape[0], size, shape[1])
        return planes.transpose(0, 2, 1).copy().view(">f4").reshape(shape)
    part = np.frombuffer(raw, kind)[: shape[0] * shape[1]].reshape(shape)
    return part.cumsum(1, dtype=kind) if predictor == 2 else part


def ground(draw, grid):
    """Heights of posts in quanta, and what kind of ground they are."""
    folder = data_folder()
    if folder and draw.random() < 0.3:
        found = window(draw, grid, folder)
        if found:
            return np.floor(found[0] * QUANTA + 0.5), found[1]
    kind = draw.choice(MADE_UP)
    return np.floor(kind(draw, grid) * QUANTA + 0.5), kind.__name__


def pierce(draw, grid, posts):
    """Makes voids: patches, single posts, a strip along a side."""
    for _ in range(draw.randint(1, 4)):
        row, column = draw.randrange(grid.size[0]), draw.randrange(grid.size[1])
        shape = draw.randrange(4)
        if shape == 0:
            posts[row, column] = np.nan
        elif shape == 1:
            posts[row : row + draw.randint(2, 20), column : column + draw.randint(2, 20)] = np.nan
        elif shape == 2:
            y, x = np.mgrid[0 : grid.size[0], 0 : grid.size[1]]
            posts[np.hypot(y - row, x - column) < draw.randint(2, 12)] = np.nan
        else:
            posts[: draw.randint(1, 5)] = np.nan


def write_posts(path, grid, posts):
    west, south = grid.origin_m
    lines = [f"ncols {grid.size[1]}", f"nrows {grid.size[0]}", f"xllcenter {west}", f"yllcenter {south}",
             f"cellsize {grid.spacing_m}", "nodata_value -9999"]
    for row in posts[::-1]:
        lines.append(" ".join("-9999" if math.isnan(z) else f"{z / QUANTA:.7f}" for z in row))
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".prj").write_text(PRJ)


# Roads and water.


class Network:
    """Features over a grid, each a geometry with tags; coordinates in metres from the area's corner."""

    def __init__(self, draw, grid):
        self.draw, self.grid, self.features = draw, grid, []
        makers = [self.road, self.road, self.road, self.bridge, self.bridge, self.river, self.river, self.lake,
                  self.lake, self.causeway, self.crossing, self.doubled, self.on_border, self.at_border, self.star,
                  self.ring, self.closed_river, self.riverbank, self.dam, self.breakline, self.dirty,
                  self.runway, self.railway]
        for _ in range(draw.choice([1, 2, 4, 8, 14])):
            draw.choice(makers)()

    def add(self, kind, places, tags):
        self.features.append((kind, places, tags))

    def somewhere(self, margin=0.05):
        draw, grid = self.draw, self.grid
        return (draw.uniform(-margin, 1 + margin) * grid.width_m, draw.uniform(-margin, 1 + margin) * grid.height_m)

    def walk(self, steps=None):
        """A line that wanders from somewhere to somewhere."""
        (x, y), (to_x, to_y) = self.somewhere(), self.somewhere()
        steps = steps or self.draw.randint(1, 12)
        wide = self.draw.choice([0, 0.02, 0.1]) * self.grid.width_m
        return [(x + (to_x - x) * at / steps + self.draw.uniform(-wide, wide),
                 y + (to_y - y) * at / steps + self.draw.uniform(-wide, wide)) for at in range(steps + 1)]

    def highway(self):
        kind = self.draw.choice(["motorway", "trunk", "primary", "secondary", "residential", "service", "track"])
        tags = {"highway": kind}
        if self.draw.random() < 0.2:
            tags["width"] = str(self.draw.choice([1, 3, 8, 25]))
        return tags

    def road(self):
        self.add("LineString", self.walk(), self.highway())

    def railway(self):
        self.add("LineString", self.walk(), {"railway": "rail"})

    def runway(self):
        (x, y), far = self.somewhere(-0.1), self.draw.uniform(100, 500)
        self.add("LineString", [(x, y), (x + far, y + self.draw.uniform(-50, 50))], {"aeroway": "runway"})

    def bridge(self):
        """A road whose middle is a bridge, or a tunnel."""
        line, tags = self.walk(self.draw.randint(3, 10)), self.highway()
        one, other = sorted(self.draw.sample(range(len(line)), 2))
        middle = {"bridge": "yes", "layer": str(self.draw.choice([1, 1, 2, 3]))}
        if self.draw.random() < 0.15:
            middle = {"tunnel": "yes", "layer": "-1"}
        for part, more in ((line[: one + 1], {}), (line[one : other + 1], middle), (line[other:], {})):
            if len(part) > 1:
                self.add("LineString", part, tags | more)

    def river(self):
        kind = self.draw.choice(["river", "stream", "canal", "ditch"])
        self.add("LineString", self.walk(), {"waterway": kind})

    def blob(self, least=3, most=14):
        (x, y), corners = self.somewhere(0), self.draw.randint(least, most)
        radius = self.draw.uniform(0.03, 0.25) * min(self.grid.width_m, self.grid.height_m)
        points = []
        for at in range(corners):
            away, angle = radius * self.draw.uniform(0.5, 1), math.tau * at / corners
            points.append((x + away * math.cos(angle), y + away * math.sin(angle)))
        return (x, y), radius, points + points[:1]

    def lake(self):
        (x, y), radius, rim = self.blob()
        rings = [rim]
        if self.draw.random() < 0.3:
            small = radius * self.draw.uniform(0.1, 0.4)
            turns = [math.tau * at / 5 for at in (0, 4, 3, 2, 1, 0)]
            rings.append([(x + small * math.cos(turn), y + small * math.sin(turn)) for turn in turns])
        self.add("Polygon", rings, {"natural": "water"})
        if self.draw.random() < 0.5:
            self.add("LineString", [self.somewhere(), (x + radius, y), (x, y)], {"waterway": "river"})
        if self.draw.random() < 0.3:
            self.add("LineString", [(x, y), (x, y - radius), self.somewhere()], {"waterway": "stream"})

    def causeway(self):
        """A road through a lake, along its shore, or into it."""
        (x, y), radius, rim = self.blob(5)
        self.add("Polygon", [rim], {"natural": "water"})
        how = self.draw.randrange(4)
        line = [(x - 2 * radius, y), (x + 2 * radius, y + radius / 3)]
        if how == 1:
            line = rim[: len(rim) // 2 + 1]
        elif how == 2:
            line = [(x - 2 * radius, y), (x, y)]
        elif how == 3:
            line = [(px + 3, py + 2) for px, py in rim]
        self.add("LineString", line, self.highway())

    def crossing(self):
        """A road over a road, a river or a railway, with a bridge or without."""
        x, y = self.somewhere(-0.2)
        far = self.draw.uniform(50, 600)
        over = self.draw.choice([{}, {}, {"bridge": "yes", "layer": "1"}])
        under = self.draw.choice([{"waterway": "river"}, self.highway(), {"railway": "rail"}])
        slant = self.draw.uniform(-0.5, 0.5) * far
        if over:
            tags = self.highway()
            near = min(far, self.draw.uniform(10, 120))
            self.add("LineString", [(x - far, y), (x - near, y)], tags)
            self.add("LineString", [(x - near, y), (x + near, y)], tags | over)
            self.add("LineString", [(x + near, y), (x + far, y)], tags)
        else:
            self.add("LineString", [(x - far, y), (x + far, y)], self.highway())
        self.add("LineString", [(x - slant, y - far), (x + slant, y + far)], under)

    def doubled(self):
        """A way again: in the same place, turned round, or beside itself."""
        lines = [feature for feature in self.features if feature[0] == "LineString"]
        if not lines:
            return self.road()
        _, places, tags = self.draw.choice(lines)
        aside = self.draw.choice([0, 0, 0.001, 0.3, 2, 9])
        again = [(x + aside, y - aside) for x, y in places]
        again = again[::-1] if self.draw.random() < 0.4 else again
        self.add("LineString", again, tags if self.draw.random() < 0.5 else self.highway())

    def on_border(self):
        """Along a line of load modules or the area's own border, a little beside it at times."""
        draw, grid = self.draw, self.grid
        aside = draw.choice([0, 0, 0.001, 1, grid.spacing_m / 2])
        at = draw.randint(0, grid.columns) * grid.side_m + aside
        line = [(at, -10), (at, grid.height_m / 2), (at, grid.height_m + 10)]
        if draw.random() < 0.5:
            at = draw.randint(0, grid.rows) * grid.side_m + aside
            line = [(-10, at), (grid.width_m * 0.4, at), (grid.width_m + 10, at)]
        self.add("LineString", line, draw.choice([self.highway(), {"waterway": "river"}, {"railway": "rail"}]))

    def at_border(self):
        """A way that ends at the border, by a millimetre."""
        x, y = self.somewhere(0)
        end = self.draw.choice([-0.001, 0, 0.001])
        self.add("LineString", [(x, y), (x, end)], self.highway())

    def star(self):
        x, y = self.somewhere(0)
        for at in range(self.draw.randint(3, 12)):
            angle, far = at * 0.7, self.draw.uniform(20, 300)
            self.add("LineString", [(x, y), (x + far * math.cos(angle), y + far * math.sin(angle))], self.highway())

    def ring(self):
        _, _, rim = self.blob(6)
        self.add("LineString", rim, self.highway())

    def closed_river(self):
        _, _, rim = self.blob(5)
        self.add("LineString", rim, {"waterway": self.draw.choice(["river", "stream"])})

    def riverbank(self):
        line, wide = self.walk(6), self.draw.uniform(5, 40)
        self.add("LineString", line, {"waterway": "river"})
        rim = [(x, y + wide) for x, y in line] + [(x, y - wide) for x, y in line[::-1]]
        self.add("Polygon", [rim + rim[:1]], {"natural": "water", "water": "river"})

    def dam(self):
        (x, y), radius, rim = self.blob(6)
        self.add("Polygon", [rim], {"natural": "water"})
        self.add("LineString", [(x, y - 2 * radius), (x, y + 2 * radius)], {"waterway": "dam"})

    def breakline(self):
        self.add("LineString", self.walk(), {"test": "breakline"})

    def dirty(self):
        draw, (x, y) = self.draw, self.somewhere(0)
        how = draw.randrange(4)
        if how == 0:
            self.add("LineString", [(x, y), (x, y)], self.highway())
        elif how == 1:
            self.add("Polygon", [[(x, y), (x + 90, y + 90), (x + 90, y), (x, y + 90), (x, y)]], {"natural": "water"})
        elif how == 2:
            self.add("LineString", [(x, y), (x + 200, y + 1), (x + 1, y + 1), (x + 60, y - 60)], self.highway())
        else:
            line = [(x + 40 * math.sin(at * 2.1), y + 40 * math.cos(at * 1.3)) for at in range(12)]
            self.add("LineString", line, self.highway())

    def write(self, path, draw=None):
        """Writes the features, in another order where `draw` is given."""
        found = []
        for number, (kind, places, tags) in enumerate(self.features):
            place = lambda point: self.grid.place(*point)
            coordinates = place(places) if kind == "Point" else \
                [[place(point) for point in ring] for ring in places] if kind == "Polygon" else \
                [place(point) for point in places]
            found.append({"type": "Feature", "id": number, "properties": tags,
                          "geometry": {"type": kind, "coordinates": coordinates}})
        if draw:
            draw.shuffle(found)
        path.write_text(json.dumps({"type": "FeatureCollection", "features": found}))


def leaves(draw, shape):
    """Heights of leaves on the posts of the ground: woods of several heights, clearings, voids, noise."""
    rows, cols = np.indices(shape)
    waves = np.sin(rows * draw.uniform(0.1, 2)) + np.cos(cols * draw.uniform(0.1, 2))
    found = np.maximum(0, QUANTA * draw.choice([4, 12, 200]) * waves)
    found[(rows + cols) % draw.choice([7, 1000]) == 0] = np.nan
    return found


class Objects(Network):
    """Buildings, walls and woods, some of them bad; drawn apart, so that networks of a seed stay as they are."""

    def __init__(self, draw, grid):
        self.draw, self.grid, self.features = draw, grid, []
        makers = [self.house, self.house, self.house, self.row_of_houses, self.wood, self.wood, self.wall, self.bad,
                  self.points]
        for _ in range(draw.choice([1, 4, 15, 60])):
            draw.choice(makers)()

    def building(self):
        tags = {"building": self.draw.choice(["yes", "house", "church", "garage"])}
        if self.draw.random() < 0.5:
            tags["height"] = self.draw.choice(["3", "12 m", "25.5", "140"])
        elif self.draw.random() < 0.5:
            tags["building:levels"] = str(self.draw.randint(1, 30))
        return tags

    def block(self, x, y, wide, deep, turn=0.0):
        corners = [(0, 0), (wide, 0), (wide, deep), (0, deep), (0, 0)]
        cos, sin = math.cos(turn), math.sin(turn)
        return [(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in corners]

    def house(self):
        (x, y), draw = self.somewhere(), self.draw
        if draw.random() < 0.3:
            # On a line between load modules, or on the corner of four.
            x = 500 * round(x / 500) + draw.uniform(-20, 20)
            y = 500 * round(y / 500) + draw.uniform(-20, 20) if draw.random() < 0.5 else y
        wide, deep = draw.uniform(4, 60), draw.uniform(4, 60)
        rings = [self.block(x, y, wide, deep, draw.choice([0, 0, draw.uniform(0, 3)]))]
        if min(wide, deep) > 20 and draw.random() < 0.3:
            rings = [self.block(x, y, wide, deep), self.block(x + 6, y + 6, wide - 12, deep - 12)]
        self.add("Polygon", rings, self.building())

    def row_of_houses(self):
        (x, y), side = self.somewhere(0), self.draw.uniform(6, 15)
        for number in range(self.draw.randint(3, 30)):
            self.add("Polygon", [self.block(x + number * side, y, side, side)], self.building())

    def wood(self):
        tags = self.draw.choice([{"natural": "wood"}, {"landuse": "forest"}, {"natural": "scrub"},
                                 {"landuse": "orchard"}, {"natural": "wood", "height": "30"}])
        self.add("Polygon", [self.blob(3, 60)[2]], tags)

    def wall(self):
        tags = self.draw.choice([{"barrier": "wall"}, {"barrier": "hedge"}, {"natural": "tree_row"},
                                 {"barrier": "city_wall"}])
        self.add("LineString", self.walk(), tags)

    def points(self):
        """Trees and towers, one over the other, on lines between load modules and outside; and what is no point."""
        draw, (x, y) = self.draw, self.somewhere()
        kinds = [{"natural": "tree"}, {"natural": "tree", "height": "30"}, {"man_made": "mast"}, {"power": "tower"},
                 {"man_made": "cooling_tower", "width": "80"}, {"man_made": "tower", "width": "0"}, {"building": "yes"}]
        for _ in range(draw.choice([1, 5, 200])):
            at = draw.choice([(x, y), (500 * round(x / 500), y + draw.uniform(-60, 60)),
                              (x + draw.uniform(-90, 90), y + draw.uniform(-90, 90))])
            self.add("Point", at, draw.choice(kinds))

    def bad(self):
        (x, y), tags = self.somewhere(0), self.building()
        far = 1e7 if self.draw.random() < 0.2 else 60
        ring = self.draw.choice([
            [(x, y), (x + 40, y + 40), (x + 40, y), (x, y + 40), (x, y)],
            [(x, y), (x + far, y), (x + 30, y), (x, y)],
            [(x, y), (x + 1, y), (x + 1, y + 1), (x, y)],
            [(x, y), (x + far, y + 1), (x + far, y + far), (x, y + 30), (x, y)],
        ])
        tags["height"] = self.draw.choice(["-5", "1e9", "3 storeys", "nan", "9"])
        for _ in range(self.draw.choice([1, 1, 2])):
            self.add("Polygon", [ring], tags)


# Jobs.


class Job:
    """Sections of a job with their keys, each value as TOML writes it."""

    def __init__(self, draw, scene, tag=""):
        self.draw, self.folder, self.grid, self.posts = draw, scene.folder, scene.grid, scene.posts
        # Goes into the names of the files that belong to this job alone.
        self.tag = tag
        grid, has_features = scene.grid, bool(scene.network)
        west, south = grid.origin_m
        self.sections = {"area": {"name": '"attack"', "crs": f'"{CRS}"', "origin_m": f"[{west}, {south}]",
                                  "size_m": f"[{grid.width_m}, {grid.height_m}]", "spacing_m": f"{grid.spacing_m}"}}
        self.limits = {}
        self.object_limits = (400, 12800)
        self.pinned = []
        self.clip = not has_features and draw.random() < 0.2
        self.paper = not has_features and not self.clip and draw.random() < 0.1
        self.dem()
        self.features(has_features)
        self.objects(scene.objects)
        self.importance()
        self.tiles()
        self.budget()
        self.tin()
        self.lod()

    def maybe(self, section, key, values, likely=0.5):
        if self.draw.random() < likely:
            self.sections.setdefault(section, {})[key] = self.draw.choice(values)

    def polygon(self, name):
        """Writes a polygon somewhere in the area and returns the name of its file."""
        name = self.tag + name
        x, y = self.draw.uniform(0, self.grid.width_m), self.draw.uniform(0, self.grid.height_m)
        wide, high = self.draw.uniform(30, 800), self.draw.uniform(30, 800)
        ring = [(x, y), (x + wide, y), (x + wide * 0.8, y + high), (x, y + high), (x, y)]
        self.write(name, [{"type": "Feature", "properties": {}, "geometry": self.shape("Polygon", [ring])}])
        return name

    def shape(self, kind, places):
        if kind == "Point":
            return {"type": kind, "coordinates": self.grid.place(*places)}
        return {"type": kind, "coordinates": [[self.grid.place(*point) for point in ring] for ring in places]}

    def write(self, name, features):
        crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{CRS[5:]}"}}
        told = {"type": "FeatureCollection", "crs": crs, "features": features}
        (self.folder / name).write_text(json.dumps(told))

    def dem(self):
        draw = self.draw
        own = {"sources": f'[{{ file = "dem.asc", crs = "{CRS}" }}]'}
        if np.isnan(self.posts).any():
            own["voids"] = draw.choice(['"hole"', "{ fill_within_posts = 3, hole = true }"])
        self.sections["dem"] = own
        self.maybe("dem", "resampling", ['"bilinear"', '"cubic"'], 0.2)

    def features(self, wanted):
        draw = self.draw
        if not wanted:
            if draw.random() < 0.15:
                name = self.polygon("water.geojson")
                self.sections["dem"]["water"] = draw.choice([f'"{name}"', f'{{ file = "{name}", weight = 8 }}'])
            return
        self.sections["features"] = {"sources": f'[{{ file = "features.geojson", crs = "{CRS}" }}]'}
        self.maybe("features", "share_max", ["0.05", "0.3", "0.8", "1"])
        self.maybe("features", "buildings", ["true", "false"], 0.1)
        self.maybe("features", "clearance_road_m", ["0", "3", "9"], 0.2)
        self.maybe("features", "clearance_rail_m", ["0", "12"], 0.1)
        self.maybe("features", "clearance_water_m", ["0", "5"], 0.2)
        self.maybe("features", "bank_m", ["0", "30", "400"], 0.2)
        rules = ['{ where = { test = "breakline" }, kind = "breakline" }']
        for kind, value in (("track", "track"), ("primary", "primary"), ("residential", "minor")):
            if draw.random() < 0.3:
                form = draw.choice(["line", "auto", "strip", "bench"])
                grade = draw.choice(["", ", grade_max_percent = 4", ", grade_max_percent = 40"])
                name = draw.choice(["", f', class = "{kind}-own"'])
                rules.append(f'{{ where = {{ highway = "{kind}" }}, kind = "{value}", form = "{form}"{grade}{name} }}')
        if draw.random() < 0.1:
            rules.append('{ where = { waterway = [] }, kind = "none" }')
        if draw.random() < 0.1:
            rules.append('{ where = { highway = [] }, kind = "motorway" }')
        self.sections["features"]["rules"] = f"[{', '.join(rules)}]"

    def objects(self, wanted):
        if not wanted or self.clip:
            return
        draw = random.Random(f"objects of {self.folder.name} {self.tag}")
        sources = [f'{{ file = "objects.geojson", crs = "{CRS}" }}']
        if draw.random() < 0.3:
            name, least, cell = f"{self.tag}leaves.asc", draw.choice(["1", "5", "12"]), draw.choice(["4", "12.5", "50"])
            write_posts(self.folder / name, self.grid, leaves(draw, self.posts.shape))
            sources.append(f'{{ file = "{name}", crs = "{CRS}", least_m = {least}, cell_m = {cell} }}')
        own = {"sources": f"[{', '.join(sources)}]"}
        if draw.random() < 0.5:
            self.object_limits = draw.choice([(40, 500), (400, 3000), (100000, 3200000)])
            keys = "per_load_module = {}, per_4km_square = {}".format(*self.object_limits)
            own["limits"] = f"{{ {keys}, joint = {draw.choice(['true', 'false'])} }}"
        if draw.random() < 0.3:
            own["corners_max"] = draw.choice(["4", "8", "40"])
        if draw.random() < 0.3:
            own["area_min_m2"] = draw.choice(["0", "200"])
        if draw.random() < 0.2:
            own["rules"] = '[{ where = { building = ["church"] }, height_m = 40 }, ' \
                '{ where = { building = ["garage"] }, kind = "none" }]'
        self.sections["objects"] = own

    def importance(self):
        draw = self.draw
        if draw.random() < 0.6:
            return
        self.sections["importance"] = {"default": draw.choice(["1", "8", "0.5"])}
        self.maybe("importance", "smooth", ['"binomial-7"', '"none"'])
        areas = []
        if draw.random() < 0.6:
            weight = draw.choice(["0", "1", "16", "65.535"])
            areas.append(f'{{ file = "{self.polygon("area.geojson")}", class = "area", weight = {weight} }}')
        if draw.random() < 0.4:
            areas.append('{ slope_above_percent = 20, smooth_m = 100, class = "steep", weight = 2 }')
        if areas:
            self.sections["importance"]["areas"] = f"[{', '.join(areas)}]"

    def tiles(self):
        """The same number of tiles for every job of a scene: other tiles would be another area."""
        draw, grid = self.draw, self.grid
        self.sections["tiles"] = {"columns": str(grid.tiles[1]), "rows": str(grid.tiles[0])}
        self.maybe("tiles", "order", ['"colour"', '"raster"'], 0.3)
        steps = [step for step in (1, 2, 4, 5, 8, 10) if grid.cells % step == 0]
        self.step = draw.choice(steps[1:])
        self.sections["load_modules"] = {"side_m": f"{grid.side_m}", "border_step_m": f"{self.step * grid.spacing_m}"}
        words = ['"fixed"'] if self.clip or self.paper else ['"refined"', '"fixed"']
        self.maybe("load_modules", "outer_border", words, 0.3)
        if self.clip:
            self.sections["load_modules"]["edges"] = '"clip"'
            self.maybe("load_modules", "clip_heights", ['"coplanar"', '"dem"'])
            self.maybe("tiles", "borders", ['"inherit"', '"regular"'], 0.3)

    def budget(self):
        draw, grid = self.draw, self.grid
        modules = grid.rows * grid.columns
        # What points on a fixed outer border need beside the corners of load modules.
        least = 2 + 2 * (grid.rows + grid.columns) * (grid.cells / self.step + 2) / modules
        mean = math.ceil(least + draw.choice([1, 6, 24, 80, 250]))
        most = min(65000, max(mean, math.ceil(3 * grid.cells / self.step + 8)) + draw.choice([0, 10, 100]))
        self.limits = {"mean_per_load_module": mean, "per_load_module": most}
        if draw.random() < 0.2:
            self.limits["pool"] = draw.choice([3, 50, 1000])
        if draw.random() < 0.2:
            self.limits["count"] = "polygons"
        self.limits["per_4km_square"] = max(4096, math.ceil(mean * modules * draw.choice([0.8, 1, 2])))
        if draw.random() < 0.2:
            self.limits["per_4km_square"] = math.ceil(mean * modules * draw.choice([0.8, 0.95]))
        quoted = {key: f'"{value}"' if key == "count" else str(value) for key, value in self.limits.items()}
        self.sections["limits"] = quoted

    def tin(self):
        draw = self.draw
        own = self.sections["tin"] = {}
        method = "paper" if self.paper else draw.choice(["optimised"] * 8 + ["greedy"])
        if self.clip:
            method = draw.choice(["greedy", "paper"])
        own["method"] = f'"{method}"'
        if method == "optimised":
            self.maybe("tin", "effort", ['"fast"', '"normal"', '"best"'])
            self.maybe("tin", "height_fit", ['"l2"', '"off"'], 0.2)
            self.maybe("tin", "lattice", ['"eighth"', '"post"'], 0.2)
            self.maybe("tin", "sight", ["true", "false"], 0.3)
            self.maybe("tin", "max_residual_m", ["0", "2", "50"], 0.1)
        else:
            own["points"] = str(draw.choice([20, 150, 600]))
        self.maybe("tin", "target_rms_m", ["0.5", "5"], 0.1)
        self.maybe("tin", "allocation", ['"global"', '"equal"'], 0.2)
        if draw.random() < 0.1 and method != "paper":
            word = draw.choice(["vip", "lattice", "fowler-little", "regular", "contour"])
            own["start"] = f'{{ method = "{word}", points = {draw.choice([10, 60])} }}'
        if draw.random() < 0.15:
            self.pins()

    def pins(self):
        draw, grid, features = self.draw, self.grid, []
        for _ in range(draw.randint(1, 6)):
            row, column = draw.randrange(grid.size[0]), draw.randrange(grid.size[1])
            if any((column, row) == place[1:] for place in self.pinned):
                # Two pins at a post contradict each other.
                continue
            x, y = column * grid.spacing_m, row * grid.spacing_m
            properties = draw.choice([{"pin": "add"}, {"pin": "forbid"}, {"pin": "height", "height_m": 123.5}])
            shape = self.shape("Point", (x, y))
            if draw.random() < 0.2:
                properties = draw.choice([{"pin": "exclude"}, {"pin": "importance", "factor": 4}])
                wide, high = draw.uniform(1, 12) * grid.spacing_m, draw.uniform(1, 12) * grid.spacing_m
                shape = self.shape("Polygon", [[(x, y), (x + wide, y), (x + wide, y + high), (x, y + high), (x, y)]])
            self.pinned.append((properties["pin"], column, row))
            features.append({"type": "Feature", "properties": properties, "geometry": shape})
        self.write(f"{self.tag}pins.geojson", features)
        self.sections["tin"]["pins"] = f'"{self.tag}pins.geojson"'

    def lod(self):
        draw = self.draw
        if draw.random() < 0.55:
            return
        shares = draw.choice([[0.5], [0.9, 0.01], [0.75, 0.5, 0.25], [0.2]])
        levels = [f"{{ inner_share = {share} }}" for share in shares]
        if "features" in self.sections and draw.random() < 0.5:
            left = draw.sample(["track", "minor", "stream", "lake", "river", "primary"], draw.randint(1, 3))
            quoted = ", ".join(f'"{name}"' for name in left)
            levels[-1] = f"{{ inner_share = {shares[-1]}, leave_out = [{quoted}] }}"
        self.sections["lod"] = {"levels": f"[{', '.join(levels)}]"}
        self.maybe("lod", "border", ['"full"', '"own"'])

    def text(self, without=()):
        """The job as TOML, without some sections (`"features"`) or keys (`"tin.pins"`)."""
        lines = []
        for section, keys in self.sections.items():
            if section in without:
                continue
            lines.append(f"[{section}]")
            lines += [f"{key} = {value}" for key, value in keys.items() if f"{section}.{key}" not in without]
        return "\n".join(lines) + "\n"


class Scene:
    """Ground, features and a job in a folder, all from a seed."""

    def __init__(self, seed, folder):
        self.draw = random.Random(seed)
        self.folder = folder
        self.grid = Grid(self.draw)
        self.posts, self.kind = ground(self.draw, self.grid)
        if self.draw.random() < 0.2:
            pierce(self.draw, self.grid, self.posts)
        if np.isnan(self.posts).all():
            self.posts[0, 0] = 0
        write_posts(folder / "dem.asc", self.grid, self.posts)
        self.network = Network(self.draw, self.grid) if self.draw.random() < 0.55 else None
        if self.network:
            self.network.write(folder / "features.geojson")
        apart = random.Random(f"objects {seed}")
        self.objects = Objects(apart, self.grid) if apart.random() < 0.4 else None
        if self.objects:
            self.objects.write(folder / "objects.geojson")
        self.job = Job(self.draw, self)
