"""Holds the evaluator against meshes that are right, and against ones broken on purpose."""

import array
import json
import pathlib
import struct
import subprocess
import tempfile

SIDE = 9  # posts
STEPS = 64


def ground(column, row):
    """Curved, with a wall: lines of sight end at it."""
    return column * column / 4.0 + row + (60.0 if column == 4 else 0.0)


def grid():
    """Every post a vertex, two triangles a cell."""
    vertices = [(float(c), float(r), ground(c, r)) for r in range(SIDE) for c in range(SIDE)]
    triangles = []
    for row in range(SIDE - 1):
        for column in range(SIDE - 1):
            a = row * SIDE + column
            triangles += [(a, a + 1, a + SIDE + 1), (a, a + SIDE + 1, a + SIDE)]
    return vertices, triangles


def two_triangles():
    corners = [(0, 0), (SIDE - 1, 0), (SIDE - 1, SIDE - 1), (0, SIDE - 1)]
    return [(float(c), float(r), ground(c, r)) for c, r in corners], [(0, 1, 2), (0, 2, 3)]


def moved(vertices, index, east, north):
    vertices = list(vertices)
    x, y, z = vertices[index]
    vertices[index] = (x + east, y + north, z)
    return vertices


def broken():
    """Name, mesh, and a fault that must be among those found."""
    vertices, triangles = grid()
    middle = 4 * SIDE + 4
    yield "a triangle is missing", (vertices, triangles[:20] + triangles[21:]), "open_edges"
    yield "a triangle of the border is missing", (vertices, triangles[1:]), "posts_uncovered"
    yield "a triangle is there twice", (vertices, triangles + triangles[:1]), "repeated_edges"
    a, b, c = triangles[30]
    yield "a triangle turns clockwise", (vertices, [*triangles[:30], (a, c, b), *triangles[31:]]), "folded_triangles"
    yield "the whole mesh turns clockwise", (vertices, [(a, c, b) for a, b, c in triangles]), "clockwise_mesh"
    yield "a vertex is pulled over its neighbours", (moved(vertices, middle, 1.5, 0.25), triangles), "folded_triangles"
    yield "it also covers posts twice", (moved(vertices, middle, 2.5, 0.25), triangles), "posts_covered_twice"
    yield "a vertex lies on the far edge", (moved(vertices, middle, 1.0, 0.5), triangles), "degenerate_triangles"
    yield "the border is pulled in", (moved(vertices, 4, 0.0, 0.5), triangles), "posts_uncovered"
    yield "the border is pushed out", (moved(vertices, 4, 0.0, -0.5), triangles), "vertices_outside"
    yield "a vertex belongs to no triangle", ([*vertices, (1.5, 1.25, 0.0)], triangles), "unused_vertices"

    # A crack: the triangles at one vertex are divided between two of one place and different heights.
    x, y, z = vertices[middle]
    ring = [i for i, triangle in enumerate(triangles) if middle in triangle]
    split = [tuple(len(vertices) if v == middle and i in ring[:3] else v for v in t) for i, t in enumerate(triangles)]
    yield "a crack", ([*vertices, (x, y, z + 1.0)], split), "open_edges"
    yield "a crack of no width", ([*vertices, (x, y, z)], split), "repeated_places"

    # A T-junction: one of two triangles at an edge is cut at its middle, the other is not.
    a, b, c = triangles[40]
    middle_of_edge = tuple((vertices[a][axis] + vertices[b][axis]) / 2 for axis in range(3))
    new = len(vertices)
    cut = [*triangles[:40], (a, new, c), (new, b, c), *triangles[41:]]
    yield "a T-junction", ([*vertices, middle_of_edge], cut), "t_junctions"


def write_mesh(path, mesh):
    vertices, triangles = mesh
    flat = array.array("d", [number for vertex in vertices for number in vertex])
    corners = array.array("I", [corner for triangle in triangles for corner in triangle])
    head = struct.pack("<8sIII", b"MESHPOST", STEPS, len(vertices), len(triangles))
    path.write_bytes(head + flat.tobytes() + corners.tobytes())


def write_ply(path, mesh, spacing_m):
    vertices, triangles = mesh
    head = f"ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {len(vertices)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    body = b"".join(struct.pack("<3f", x * spacing_m, y * spacing_m, z) for x, y, z in vertices)
    body += b"".join(struct.pack("<B3i", 3, *triangle) for triangle in triangles)
    path.write_bytes(head.encode() + body)


class Tester:
    def __init__(self, folder):
        self.folder, self.failed = folder, 0
        self.program, self.heights = folder / "evaluate", folder / "ground.heights"
        source = pathlib.Path(__file__).resolve().parent / "evaluate.cpp"
        flags = ["-O1", "-std=c++17", "-fsanitize=undefined", "-fno-sanitize-recover"]
        subprocess.run(["g++", *flags, "-o", self.program, source], check=True)
        posts = array.array("f", [ground(column, row) for row in range(SIDE) for column in range(SIDE)])
        self.heights.write_bytes(struct.pack("<II", SIDE, SIDE) + posts.tobytes())

    def judged(self, path, spacing_m=100.0):
        command = [self.program, path, self.heights, str(spacing_m), str(spacing_m), "--sight-lines", "500"]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        judged = json.loads(done.stdout)
        assert judged["valid"] == (done.returncode == 0), "the exit code says what the object says"
        return judged

    def residuals(self, path):
        """Surface less ground at every post, as the evaluator writes it."""
        out = self.folder / "posts.residuals"
        subprocess.run([self.program, path, self.heights, "100", "100", "--residuals", out], capture_output=True)
        found = array.array("f", out.read_bytes()[8:])
        assert struct.unpack("<II", out.read_bytes()[:8]) == (SIDE, SIDE)
        return found

    def expect(self, name, holds, found):
        print(f"{'ok    ' if holds else 'FAILED'} {name}" + ("" if holds else f": {found}"))
        self.failed += not holds

    def right_meshes(self):
        path = self.folder / "right.mesh"
        write_mesh(path, grid())
        judged = self.judged(path)
        self.expect("a grid of all posts is valid", judged["valid"], judged)
        exact = judged["rms_m"] == judged["max_m"] == judged["slope_rms_degrees"] == 0
        self.expect("it has no residual", exact, judged)
        # Bilinear cells and their two triangles differ within a cell only, and the wall is the same in both.
        self.expect("it sees what the raster sees", judged["sight"]["agreement"] > 0.97, judged["sight"])
        self.expect("its angles are 45 degrees", judged["least_angle_below"]["20"] == 0, judged)

        write_mesh(path, two_triangles())
        flat = self.judged(path)
        self.expect("two triangles are valid", flat["valid"], flat)
        self.expect("they see through the wall", flat["sight"]["false_visible"] > 0.2, flat["sight"])
        largest = max(abs(ground(c, r) - plane(c, r)) for c in range(SIDE) for r in range(SIDE))
        self.expect("their largest residual is the one worked out here", abs(flat["max_m"] - largest) < 1e-9, flat)
        found = self.residuals(path)
        wanted = [plane(c, r) - ground(c, r) for r in range(SIDE) for c in range(SIDE)]
        near = all(abs(one - other) < 1e-4 for one, other in zip(found, wanted, strict=True))
        self.expect("every residual is the one worked out here", near, list(found))

        ply = self.folder / "right.ply"
        write_ply(ply, (moved(grid()[0], 40, 0.125, -0.25), grid()[1]), 25.27)
        judged = self.judged(ply, 25.27)
        self.expect("a PLY in metres, its vertices in eighths of a post, is valid", judged["valid"], judged)
        write_ply(ply, (moved(grid()[0], 40, 0.12, 0.0), grid()[1]), 25.27)
        judged = self.judged(ply, 25.27)
        self.expect("a PLY off its lattice is not", judged["faults"]["off_lattice"] == 1, judged)

    def broken_meshes(self):
        path = self.folder / "broken.mesh"
        for name, mesh, fault in broken():
            write_mesh(path, mesh)
            judged = self.judged(path)
            self.expect(f"{name}: {fault}", not judged["valid"] and 0 < judged["faults"][fault], judged["faults"])

    def unreadable_files(self):
        path = self.folder / "short.mesh"
        write_mesh(path, grid())
        path.write_bytes(path.read_bytes()[:-1])
        done = subprocess.run([self.program, path, self.heights, "25", "25"], capture_output=True, text=True)
        self.expect("a file that ends too soon is told", done.returncode == 2 and "ends within" in done.stderr, done)


def plane(column, row):
    """Height of the two triangles between the corners of the square."""
    last = SIDE - 1
    south_west, north_east = ground(0, 0), ground(last, last)
    other = ground(last, 0) if row <= column else ground(0, last)
    east, north = column / last, row / last
    if row <= column:
        return south_west + (other - south_west) * east + (north_east - other) * north
    return south_west + (other - south_west) * north + (north_east - other) * east


def selftest():
    """Holds the evaluator of benches against meshes that are right, and against ones broken on purpose.

    Needs g++ and nothing else. Exits with 1 when the evaluator misses a fault or sees one that is not there.
    """
    with tempfile.TemporaryDirectory() as folder:
        tester = Tester(pathlib.Path(folder))
        tester.right_meshes()
        tester.broken_meshes()
        tester.unreadable_files()
    print("the evaluator is as it should be" if not tester.failed else f"{tester.failed} failed")
    return 1 if tester.failed else 0
