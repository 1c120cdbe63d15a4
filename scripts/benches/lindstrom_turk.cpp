// Lindstrom and Turk's edge collapse (CGAL's) from every post of a raster down to a number of triangles: the strongest
// known peer at equal triangles. It knows nothing of terrain, so its surface may fold over; the evaluator counts that.
//
//     g++ -O2 -DNDEBUG -std=c++17 -o lindstrom_turk lindstrom_turk.cpp      (needs libcgal-dev)
//     lindstrom_turk HEIGHTS SPACING_X SPACING_Y TRIANGLES OUT.mesh
//
// Formats are those of evaluate.cpp. It prints the seconds from heights in memory to the mesh as JSON.
// CGAL's collapse is under the GPL, which is why this is a program of its own that only the benchmark builds.

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

namespace simplification = CGAL::Surface_mesh_simplification;
using Point = CGAL::Simple_cartesian<double>::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

// Vertices stand anywhere; the evaluator's finest lattice is near enough.
constexpr uint32_t STEPS_PER_POST = 65536;

// CGAL's own stop predicates count edges or ratios; what a simulator pays for is triangles.
struct FaceCount {
    std::size_t wanted;

    template <typename Cost, typename Profile>
    bool operator()(const Cost&, const Profile& profile, std::size_t, std::size_t) const {
        return profile.surface_mesh().number_of_faces() <= wanted;
    }
};

template <typename Number> void put(std::ofstream& out, Number number) {
    out.write(reinterpret_cast<const char*>(&number), sizeof number);
}

Mesh full_mesh(const std::vector<float>& heights, uint32_t columns, uint32_t rows, double spacing_x, double spacing_y) {
    Mesh mesh;
    std::size_t posts = std::size_t(columns) * rows;
    mesh.reserve(posts, 3 * posts, 2 * posts);
    for (uint32_t row = 0; row < rows; row++) {
        for (uint32_t column = 0; column < columns; column++) {
            mesh.add_vertex(Point(column * spacing_x, row * spacing_y, heights[std::size_t(row) * columns + column]));
        }
    }
    auto vertex = [&](uint32_t column, uint32_t row) { return Mesh::Vertex_index(row * columns + column); };
    for (uint32_t row = 0; row + 1 < rows; row++) {
        for (uint32_t column = 0; column + 1 < columns; column++) {
            mesh.add_face(vertex(column, row), vertex(column + 1, row), vertex(column + 1, row + 1));
            mesh.add_face(vertex(column, row), vertex(column + 1, row + 1), vertex(column, row + 1));
        }
    }
    return mesh;
}

void write(const Mesh& mesh, double spacing_x, double spacing_y, const char* path) {
    std::ofstream out(path, std::ios::binary);
    out.write("MESHPOST", 8);
    put(out, STEPS_PER_POST);
    put(out, uint32_t(mesh.number_of_vertices()));
    put(out, uint32_t(mesh.number_of_faces()));
    for (auto vertex : mesh.vertices()) {
        const Point& at = mesh.point(vertex);
        put(out, at.x() / spacing_x);
        put(out, at.y() / spacing_y);
        put(out, at.z());
    }
    for (auto face : mesh.faces()) {
        for (auto vertex : vertices_around_face(mesh.halfedge(face), mesh)) {
            put(out, uint32_t(vertex));
        }
    }
}

int main(int count, char** words) {
    if (count != 6) {
        std::fprintf(stderr, "usage: lindstrom_turk HEIGHTS SPACING_X SPACING_Y TRIANGLES OUT.mesh\n");
        return 2;
    }
    double spacing_x = std::atof(words[2]), spacing_y = std::atof(words[3]);
    uint32_t size[2] = {0, 0};
    std::ifstream in(words[1], std::ios::binary);
    in.read(reinterpret_cast<char*>(size), sizeof size);
    std::vector<float> heights(std::size_t(size[0]) * size[1]);
    in.read(reinterpret_cast<char*>(heights.data()), std::streamsize(heights.size() * sizeof(float)));
    if (!in || heights.empty()) {
        std::fprintf(stderr, "error: %s: no heights\n", words[1]);
        return 2;
    }

    auto start = std::chrono::steady_clock::now();
    Mesh mesh = full_mesh(heights, size[0], size[1], spacing_x, spacing_y);
    simplification::edge_collapse(mesh, FaceCount{std::size_t(std::atoll(words[4]))},
                                  CGAL::parameters::get_cost(simplification::LindstromTurk_cost<Mesh>())
                                      .get_placement(simplification::LindstromTurk_placement<Mesh>()));
    mesh.collect_garbage();
    std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;

    write(mesh, spacing_x, spacing_y, words[5]);
    std::printf("{\"seconds\": %.6f}\n", seconds.count());
    return 0;
}
