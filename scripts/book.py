#!/usr/bin/env python3
"""Writes what the book shows and no bench measures: what the tutorial prints and draws, the figures of the sample area,
and the diagrams of the concepts, small SVG files on an opaque ground, so that they read on a dark page, too.

    scripts/book.py                    all of it
    scripts/book.py --only tutorial    or: sample, diagrams
    scripts/book.py --check            says which diagrams are not current, and exits with 1 if any is
    scripts/book.py --tiefort PATH     with this program [default: target/release/tiefort, built if missing]

Blocks of text below a line `<!-- output of: COMMAND -->` are what the command prints.
"""

import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from benches.common import FIGURES, ROOT, parser_of, program, put

TUTORIAL = ROOT / "docs" / "tutorial.md"
PICTURES = ROOT / "docs" / "pictures"
PICTURE_BYTES_MAX = 300_000
OUTPUT = re.compile(r"(<!-- output of: (.*?) -->\n```text\n).*?(```)", re.DOTALL)
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.DOTALL | re.MULTILINE)


def shell(command, folder):
    """What a command prints, run in a folder with the program on the path."""
    ran = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=folder, capture_output=True, text=True)
    if ran.returncode not in (0, 1):
        sys.exit(f"{command}\n{ran.stdout}{ran.stderr}")
    return ran.stdout


def keep(path, name):
    """A picture of the book, which must be small."""
    size = path.stat().st_size
    assert size <= PICTURE_BYTES_MAX, f"{name}: {size} bytes, expected at most {PICTURE_BYTES_MAX}"
    shutil.copy(path, PICTURES / name)


def tutorial(folder):
    """Runs the blocks of the tutorial one after the other, but for the viewer's."""
    page = TUTORIAL.read_text()
    for block in BLOCK.findall(page):
        if "tiefort view" not in block:
            shell(block, folder)
    page = OUTPUT.sub(lambda found: f"{found[1]}{shell(found[2], folder)}{found[3]}", page)
    TUTORIAL.write_text(page)
    for name in ["relief.png", "perspective.png", "density.png"]:
        keep(folder / name, name)


def sample(folder):
    """Builds the sample area, and puts what came out into the page of figures."""
    shell(f"tiefort build '{ROOT}/configs/ntc.toml' --out ntc.tdb --quiet", folder)
    report = json.loads((folder / "ntc.tdb" / "report.json").read_text())
    size = sum(path.stat().st_size for path in (folder / "ntc.tdb").rglob("*") if path.is_file())
    modules = sum(path.stat().st_size for path in (folder / "ntc.tdb" / "modules").iterdir())
    module, window, features = report["per_load_module"], report["per_4km"], report["features"]
    rows = [
        ("triangles", f"{report['triangles']:,}"),
        ("largest load module", f"{module['max']} of {module['limit']}"),
        ("mean of load modules", f"{module['mean']:.2f} of {module['mean_limit']:g}"),
        ("largest 4 km square", f"{window['max']:,} of {window['limit']:,}"),
        ("breaches", str(len(report["breaches"]))),
        ("RMS residual", f"{report['residual']['rms_m']:.3f} m"),
        *((f"RMS residual, {row['name']}", f"{row['residual']['rms_m']:.3f} m") for row in report["classes"][:2]),
        *((f"{row['name']} in the ground", f"{row['line_km'] + row['strip_km'] + row['channel_km']:.1f} km of "
           f"{row['wanted_km']:.1f} km") for row in features["classes"] if row["wanted_km"]),
        ("lakes", str(sum(row["lakes"] for row in features["classes"]))),
        ("load modules on the disk", f"{modules / 1e6:.1f} MB"),
        ("the whole database", f"{size / 1e6:.1f} MB"),
    ]
    put(FIGURES, "sample", "| | |\n| - | -: |\n" + "".join(f"| {name} | {value} |\n" for name, value in rows))


# --- diagrams ---


INK, FAINT, BLUE, RED, GREEN, TAN = "#22282e", "#9aa4ad", "#1f6fb2", "#c0392b", "#3f7d4e", "#e9dfc8"
COLOURS = ["#cfe3f5", "#d8ecd6", "#f6e2bd", "#e6d7f0"]


class Picture:
    """An SVG picture in the making; y grows downwards."""

    def __init__(self, width, height, title):
        self.parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
            ' font-family="system-ui, sans-serif" font-size="14">',
            f"<title>{title}</title>",
            f'<rect width="{width}" height="{height}" rx="8" fill="#fdfcf9" stroke="#d9d5cb"/>',
        ]

    def line(self, points, color=INK, width=1.5, dash=None, fill="none"):
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(f'<polyline points="{path}" fill="{fill}" stroke="{color}" stroke-width="{width}"{dashes}/>')

    def box(self, x, y, width, height, fill="none", color=INK, stroke=1.5, dash=None):
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}" '
                          f'stroke="{color}" stroke-width="{stroke}"{dashes}/>')

    def dot(self, x, y, radius=3.5, fill=INK, color="none"):
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{fill}" stroke="{color}"/>')

    def text(self, x, y, text, color=INK, anchor="start", weight="normal", size=14):
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" text-anchor="{anchor}" font-weight="{weight}" '
                          f'font-size="{size}">{text}</text>')

    def arrow(self, start, end, color=INK):
        self.line([start, end], color, 1.5)
        angle = math.atan2(end[1] - start[1], end[0] - start[0])
        wings = [(end[0] - 9 * math.cos(angle + turn), end[1] - 9 * math.sin(angle + turn)) for turn in (0.4, -0.4)]
        self.line([wings[0], end, wings[1], wings[0]], color, 1, fill=color)

    def done(self):
        return "\n".join([*self.parts, "</svg>"]) + "\n"


def posts_svg():
    """Posts, a cell, the spacing, and triangles whose corners stand on posts or on eighths between them."""
    picture = Picture(690, 270, "Posts in rows and columns, a cell between four of them, and triangles over them")
    left, top, step = 40, 40, 44
    picture.box(left + step, top + 2 * step, step, step, fill=TAN, color=TAN)
    corners = [(0, 0), (5, 0), (5, 4), (0, 4), (1.75, 2.125), (3.375, 1.25)]
    place = lambda corner: (left + corner[0] * step, top + corner[1] * step)
    for triangle in [(0, 1, 5), (1, 2, 5), (0, 5, 4), (5, 2, 4), (2, 3, 4), (3, 0, 4)]:
        picture.line([place(corners[index]) for index in (*triangle, triangle[0])], BLUE, 1.5)
    for row in range(5):
        for column in range(6):
            picture.dot(left + column * step, top + row * step, 3, FAINT)
    for corner in corners:
        picture.dot(*place(corner), 5, BLUE)
    picture.line([(left, top + 4 * step + 22), (left + step, top + 4 * step + 22)], INK, 1.5)
    picture.text(left, top + 4 * step + 40, "spacing")
    x = left + 5 * step + 40
    for row, (color, radius, text) in enumerate([
            (FAINT, 3, "post: one height of the raster, by row and column"),
            (BLUE, 5, "vertex of the TIN: on a post, or on eighths"),
    ]):
        picture.dot(x + 6, 62 + row * 40, radius, color)
        picture.text(x + 22, 67 + row * 40, text)
    picture.box(x, 134, 14, 14, fill=TAN, color=FAINT, stroke=1)
    picture.text(x + 22, 146, "cell: the square between four posts")
    picture.line([(x, 181), (x + 14, 181)], BLUE, 2)
    picture.text(x + 22, 186, "edge of a triangle")
    return picture.done()


def area_svg():
    """The area, its tiles, its load modules and a window of 8 x 8."""
    picture = Picture(660, 330, "An area of 24 x 16 load modules in 3 x 2 tiles, with a window of 8 x 8")
    left, top, side = 30, 30, 16
    picture.box(left + 3 * side, top + 4 * side, side, side, fill="#f3c969", color=INK)
    for column in range(25):
        picture.line([(left + column * side, top), (left + column * side, top + 16 * side)], "#cfcabd", 1)
    for row in range(17):
        picture.line([(left, top + row * side), (left + 24 * side, top + row * side)], "#cfcabd", 1)
    for column in range(4):
        picture.line([(left + column * 8 * side, top), (left + column * 8 * side, top + 16 * side)], INK, 2.5)
    for row in range(3):
        picture.line([(left, top + row * 8 * side), (left + 24 * side, top + row * 8 * side)], INK, 2.5)
    picture.box(left + 11 * side, top + 5 * side, 8 * side, 8 * side, fill="#c0392b18", color=RED, stroke=2, dash="6 4")
    x = left + 24 * side + 22
    picture.box(x, 44, 16, 16, fill="#f3c969")
    picture.text(x + 26, 57, "load module: 500 m,")
    picture.text(x + 26, 75, "what a simulator loads")
    picture.box(x, 104, 16, 16, stroke=2.5)
    picture.text(x + 26, 117, "tile: what one task")
    picture.text(x + 26, 135, "works on")
    picture.box(x, 164, 16, 16, color=RED, stroke=2, dash="4 3")
    picture.text(x + 26, 177, "window: any 8 x 8 load")
    picture.text(x + 26, 195, "modules, so 4 km a side")
    picture.text(left, top + 16 * side + 22, "row 0, column 0 is the south-west corner")
    return picture.done()


def ranks_svg():
    """Tiles in four colours, in the order in which they may be refined."""
    picture = Picture(640, 270, "Tiles in four colours; tiles of one colour run at the same time")
    left, top, side = 30, 30, 52
    for row in range(4):
        for column in range(5):
            north = 3 - row
            color = 2 * (row % 2) + column % 2
            picture.box(left + column * side, top + north * side, side, side, fill=COLOURS[color])
            picture.text(left + (column + 0.5) * side, top + (north + 0.62) * side, str(color + 1), anchor="middle",
                         weight="bold", size=18)
    middle = (left + 1.5 * side, top + 1.5 * side)
    picture.arrow((left + 0.72 * side, middle[1] - 12), (left + 1.25 * side, middle[1] - 12), RED)
    x = left + 5 * side + 30
    for row, text in enumerate([
            "1 first, then 2, 3 and 4",
            "tiles of one colour never touch, so",
            "all of them may run at the same time",
            "",
            "rank: colour, then row, then column",
            "a tile takes over the points that a",
            "neighbour of lower rank has chosen",
            "on the seam between them (arrow)",
    ]):
        picture.text(x, 50 + 22 * row, text)
    return picture.done()


def seam_svg():
    """Two tiles that share a seam, and the border points on it."""
    picture = Picture(640, 250, "Two tiles with the same points on the seam between them")
    top, bottom, left, middle, right = 35, 205, 40, 230, 420
    for first, color in [(left, COLOURS[0]), (middle, COLOURS[1])]:
        picture.box(first, top, middle - left, bottom - top, fill=color, color="none")
    border = [(middle, y) for y in (top, 78, 116, 170, bottom)]
    west = [(left, top), (left, bottom), (110, 70), (150, 150), (85, 185)]
    east = [(right, top), (right, bottom), (300, 60), (345, 130), (290, 175)]
    # Corners of triangles: 0 to 4 are the border points from north to south, 5 to 9 those of the tile.
    fans = [(0, 1, 7), (1, 2, 7), (2, 3, 8), (3, 4, 8), (2, 8, 7), (7, 8, 9), (8, 4, 9), (5, 0, 7), (5, 7, 9),
            (5, 9, 6)]
    near = [(0, 5, 7), (0, 1, 7), (1, 2, 7), (2, 9, 7), (2, 3, 9), (3, 4, 9), (7, 8, 9), (7, 5, 8), (5, 6, 8),
            (8, 6, 9)]
    for points, triangles in [(border + west, [*fans, (9, 4, 6)]), (border + east, [*near, (9, 6, 4)])]:
        for triangle in triangles:
            picture.line([points[corner] for corner in (*triangle, triangle[0])], BLUE, 1.2)
        for point in points[7:]:
            picture.dot(*point, 4, BLUE)
    picture.line([(middle, top), (middle, bottom)], RED, 3)
    for point in border:
        picture.dot(*point, 5, RED)
    picture.text(left + 6, bottom + 22, "tile of lower rank")
    picture.text(middle + 60, bottom + 22, "tile of higher rank")
    picture.text(right + 24, 80, "seam: posts that two", RED)
    picture.text(right + 24, 98, "tiles share", RED)
    picture.text(right + 24, 134, "border points: the")
    picture.text(right + 24, 152, "same for both tiles,")
    picture.text(right + 24, 170, "so there is no crack")
    return picture.done()


def residual_svg():
    """A profile: the ground, the TIN over it, residuals and a refused post."""
    picture = Picture(640, 250, "A profile of the ground with two triangles over it, and the residuals between them")
    left, step, base = 40, 32, 190
    heights = [30, 46, 70, 88, 118, 112, 96, 62, 50, 58, 44, 30]
    ground = [(left + place * step, base - height) for place, height in enumerate(heights)]
    tin = [ground[0], ground[4], ground[11]]
    picture.line(ground, GREEN, 2)
    picture.line(tin, BLUE, 2.5)
    for place, (x, y) in enumerate(ground):
        first, last = (tin[0], tin[1]) if place <= 4 else (tin[1], tin[2])
        share = (x - first[0]) / (last[0] - first[0])
        surface = first[1] + share * (last[1] - first[1])
        if 1 < abs(surface - y):
            picture.line([(x, y), (x, surface)], RED, 2)
        picture.dot(x, y, 3, GREEN)
    for x, y in tin:
        picture.dot(x, y, 5, BLUE)
    picture.dot(*ground[7], 7, "none", RED)
    picture.line([(ground[7][0], ground[7][1] + 10), (ground[7][0] + 10, base + 24)], FAINT, 1)
    picture.text(ground[7][0] - 70, base + 40, "a refused post: worth a point, but no room", RED)
    x = left + 11 * step + 36
    for row, (color, text) in enumerate([(GREEN, "DEM: heights of posts"), (BLUE, "TIN: triangles"),
                                         (RED, "residual: DEM less TIN")]):
        picture.line([(x, 60 + 30 * row), (x + 18, 60 + 30 * row)], color, 2.5)
        picture.text(x + 28, 65 + 30 * row, text)
    return picture.done()


def limits_svg():
    """Counts of load modules beside the limit, with the pool above it."""
    picture = Picture(690, 290, "Triangles of nine load modules, the limit, and what the pool allows above it")
    left, base, scale = 60, 225, 1.6
    counts = [12, 34, 58, 100, 100, 100, 71, 40, 18]
    picture.box(left, base - 115 * scale, 9 * 38, 15 * scale, fill="#f3c96966", color="none")
    for place, count in enumerate(counts):
        fill = "#9cc3e6" if count == 100 else COLOURS[0]
        picture.box(left + 6 + place * 38, base - count * scale, 26, count * scale, fill=fill)
        label = "112" if place == 4 else str(count)
        picture.text(left + 19 + place * 38, base + 18, label, anchor="middle", size=12)
    picture.box(left + 6 + 4 * 38, base - 112 * scale, 26, 12 * scale, fill="#f3c969")
    picture.line([(left, base), (left + 9 * 38, base)], INK)
    picture.line([(left, base - 100 * scale), (left + 9 * 38, base - 100 * scale)], RED, 2)
    mean = sum(counts) / len(counts)
    picture.line([(left, base - mean * scale), (left + 9 * 38, base - mean * scale)], GREEN, 2, "6 4")
    picture.text(left - 8, base - 100 * scale + 5, "100", RED, "end")
    picture.text(left + 9 * 19, base + 44, "triangles in each load module", anchor="middle")
    x = left + 9 * 38 + 20
    picture.text(x, base - 100 * scale + 5, "limit of a load module", RED)
    picture.text(x, base - 118 * scale, "pool: a few above it, for the", "#8a6d1f")
    picture.text(x, base - 118 * scale + 17, "whole area together", "#8a6d1f")
    picture.text(x, base - mean * scale - 4, "budget: what the area may", GREEN)
    picture.text(x, base - mean * scale + 13, "spend, as a mean", GREEN)
    picture.text(x, base - 24, "a full load module refuses posts;")
    picture.text(x, base - 6, "beyond limit and pool: a breach")
    return picture.done()


def levels_svg():
    """Three levels of one load module: sides keep their vertices, inner vertices go."""
    picture = Picture(640, 230, "Three levels of a load module with the same vertices on its sides")
    side, top = 150, 40
    inner = [(40, 40), (95, 30), (120, 75), (70, 80), (30, 110), (85, 120), (125, 122), (60, 55)]
    for level, count in enumerate([8, 4, 1]):
        left = 40 + level * 200
        picture.box(left, top, side, side, fill=COLOURS[0])
        for share in (0, 0.3, 0.6, 1):
            for x, y in [(share, 0), (share, 1), (0, share), (1, share)]:
                picture.dot(left + x * side, top + y * side, 4.5, RED)
        for x, y in inner[-count:]:
            picture.dot(left + x, top + y, 4, BLUE)
        picture.text(left + side / 2, top + side + 24, f"level {level}" + (", the finest" if level == 0 else ""),
                     anchor="middle")
    picture.text(40, 26, "red: vertices on sides, the same in all levels", RED)
    picture.text(370, 26, "blue: vertices inside", BLUE)
    return picture.done()


DRAWINGS = {"posts": posts_svg, "area": area_svg, "ranks": ranks_svg, "seam": seam_svg, "residual": residual_svg,
            "limits": limits_svg, "levels": levels_svg}


def diagrams(_):
    """Draws every diagram again."""
    for name, draw in DRAWINGS.items():
        (PICTURES / f"{name}.svg").write_text(draw())


def stale():
    """Diagrams that are not what would be drawn."""
    for name, draw in DRAWINGS.items():
        path = PICTURES / f"{name}.svg"
        if not path.exists() or path.read_text() != draw():
            yield path


def book():
    parser = parser_of(book)
    parser.add_argument("--only", choices=["tutorial", "sample", "diagrams"])
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    if arguments.check:
        found = list(stale())
        for path in found:
            print(f"{path}: scripts/book.py --only diagrams draws it again", file=sys.stderr)
        return 1 if found else 0
    if arguments.only != "diagrams":
        os.environ["PATH"] = f"{program(arguments).parent}:{os.environ['PATH']}"
    for part in [tutorial, sample, diagrams]:
        if arguments.only in (None, part.__name__):
            with tempfile.TemporaryDirectory() as folder:
                part(pathlib.Path(folder))
    return 0


book.__doc__ = __doc__

if __name__ == "__main__":
    sys.exit(book())
