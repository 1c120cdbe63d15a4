// Judges a triangulated terrain against the raster it was made from: is it a valid surface, and how true is it?
//
//     g++ -O2 -std=c++17 -o evaluate evaluate.cpp
//     evaluate MESH HEIGHTS SPACING_X SPACING_Y [--sight-lines N] [--eyes M,…] [--seams COLUMNS/ROWS WITHIN]
//              [--residuals FILE]
//
// It shares no code with the compiler, so that neither can hide the other's mistakes. It prints one JSON object, and
// exits with 0 for a valid surface, 1 for an invalid one, 2 when it could not read its input.
//
// MESH is a binary little-endian PLY in metres from the south-west post (`tiefort tin --out x.ply`), or ".mesh": the
// letters MESHPOST, 32-bit lattice steps per post, two 32-bit counts, vertices as three doubles (column and row from
// the south-west post in posts, height in metres), triangles as three 32-bit indices. HEIGHTS is 32-bit columns and
// rows, then 32-bit floats, rows from the south. SPACING_X and SPACING_Y are metres between posts. --residuals writes
// surface less raster at every post like HEIGHTS, NaN outside all triangles.
//
// Topology is decided in whole numbers. Corners of a PLY stand on 1/64 of a post, since that is finer than any lattice
// the compiler writes and a 32-bit float in metres is not exact; those of a .mesh are rounded to the steps it names.
// Each post belongs to one triangle by being moved an infinitely small step east and a smaller one north (west on the
// last column, south on the last row). Where a mesh folds over itself the topmost triangle counts, as seen from above;
// posts outside all triangles are counted as a fault and left out of the figures.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

// Lattice steps in one post: of a mesh in metres, and at most.
constexpr int64_t STEPS_PLY = 64, STEPS_MAX = 65536;
// A corner of a PLY further than this from its lattice, in posts, was not written by the compiler.
constexpr double OFF_LATTICE_POSTS = 0.002;
// With more posts a side, products of two sides in lattice steps would not fit 64 bits.
constexpr uint32_t POSTS_A_SIDE_MAX = 16384;

constexpr double EYE_M = 2.5; // unless other eyes are asked for
constexpr double SIGHT_NEAR_M = 200.0, SIGHT_FAR_M = 4000.0;
constexpr double DEGREES = 57.295779513082320877;

struct Vertex {
    int64_t x, y; // lattice steps east and north of the south-west post
    double z;     // metres
};

using Triangle = std::array<uint32_t, 3>;

struct Mesh {
    std::vector<Vertex> vertices;
    std::vector<Triangle> triangles;
    int64_t steps = 1; // of the lattice, in one post
    double off_lattice_posts = 0.0;
};

struct Heights {
    uint32_t columns = 0, rows = 0;
    std::vector<float> posts;
    double spacing_x = 0.0, spacing_y = 0.0;

    double at(int64_t column, int64_t row) const { return posts[size_t(row) * columns + size_t(column)]; }
};

// The last column and the last row, in lattice steps.
struct Extent {
    int64_t east, north;
};

Extent extent(const Mesh& mesh, const Heights& heights) {
    return {int64_t(heights.columns - 1) * mesh.steps, int64_t(heights.rows - 1) * mesh.steps};
}

// --- reading ---

template <typename Number> Number take(std::istream& in, const char* what) {
    Number number;
    if (!in.read(reinterpret_cast<char*>(&number), sizeof number)) {
        throw std::runtime_error(std::string("the file ends within its ") + what);
    }
    return number;
}

std::ifstream opened(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) {
        throw std::runtime_error(path + ": no such file");
    }
    return in;
}

Heights read_heights(const std::string& path, double spacing_x, double spacing_y) {
    std::ifstream in = opened(path);
    Heights heights;
    heights.spacing_x = spacing_x;
    heights.spacing_y = spacing_y;
    heights.columns = take<uint32_t>(in, "size");
    heights.rows = take<uint32_t>(in, "size");
    uint32_t least = std::min(heights.columns, heights.rows), most = std::max(heights.columns, heights.rows);
    if (least < 2 || POSTS_A_SIDE_MAX < most) {
        throw std::runtime_error(path + ": expected 2 to 16384 posts a side");
    }
    heights.posts.resize(size_t(heights.columns) * heights.rows);
    for (float& height : heights.posts) {
        height = take<float>(in, "heights");
        if (!std::isfinite(height)) {
            throw std::runtime_error(path + ": found a void, expected heights everywhere");
        }
    }
    return heights;
}

Mesh read_mesh(const std::string& path) {
    std::ifstream in = opened(path);
    char magic[8];
    if (!in.read(magic, sizeof magic) || std::memcmp(magic, "MESHPOST", sizeof magic) != 0) {
        throw std::runtime_error(path + ": expected MESHPOST at the start");
    }
    Mesh mesh;
    mesh.steps = take<uint32_t>(in, "lattice");
    if (mesh.steps < 1 || STEPS_MAX < mesh.steps) {
        throw std::runtime_error(path + ": expected 1 to 65536 lattice steps per post");
    }
    double steps = double(mesh.steps);
    mesh.vertices.resize(take<uint32_t>(in, "counts"));
    mesh.triangles.resize(take<uint32_t>(in, "counts"));
    for (Vertex& vertex : mesh.vertices) {
        double column = take<double>(in, "vertices"), row = take<double>(in, "vertices");
        vertex = {std::llround(column * steps), std::llround(row * steps), take<double>(in, "vertices")};
    }
    for (Triangle& triangle : mesh.triangles) {
        for (uint32_t& corner : triangle) {
            corner = take<uint32_t>(in, "triangles");
        }
    }
    return mesh;
}

Mesh read_ply(const std::string& path, const Heights& heights) {
    std::ifstream in = opened(path);
    std::string line, kind;
    size_t vertex_count = 0, face_count = 0;
    while (std::getline(in, line) && line != "end_header") {
        std::istringstream words(line);
        std::string first, second, third;
        words >> first >> second >> third;
        if (first == "element") {
            (second == "vertex" ? vertex_count : face_count) = std::stoul(third);
        } else if (first == "property" && third == "x") {
            kind = second;
        }
    }
    if (line != "end_header" || (kind != "float" && kind != "double")) {
        throw std::runtime_error(path + ": expected a PLY with x, y, z as float or double");
    }
    Mesh mesh;
    mesh.steps = STEPS_PLY;
    mesh.vertices.resize(vertex_count);
    mesh.triangles.resize(face_count);
    auto number = [&] { return kind == "float" ? double(take<float>(in, "vertices")) : take<double>(in, "vertices"); };
    auto placed = [&](double posts) {
        int64_t steps = std::llround(posts * STEPS_PLY);
        mesh.off_lattice_posts = std::max(mesh.off_lattice_posts, std::fabs(posts - double(steps) / STEPS_PLY));
        return steps;
    };
    for (Vertex& vertex : mesh.vertices) {
        double x = number(), y = number();
        vertex = {placed(x / heights.spacing_x), placed(y / heights.spacing_y), number()};
    }
    for (Triangle& triangle : mesh.triangles) {
        if (take<uint8_t>(in, "faces") != 3) {
            throw std::runtime_error(path + ": expected triangles only");
        }
        for (uint32_t& corner : triangle) {
            corner = uint32_t(take<int32_t>(in, "faces"));
        }
    }
    return mesh;
}

// --- is it a surface? ---

struct Fault {
    const char* name;
    int64_t count;
};

// Twice the area of a, b, c in square lattice steps; above zero when they turn counter-clockwise.
int64_t doubled_area(const Vertex& a, const Vertex& b, const Vertex& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool on_border(const Vertex& a, const Vertex& b, Extent end) {
    bool across = a.x == b.x && (a.x == 0 || a.x == end.east);
    bool along = a.y == b.y && (a.y == 0 || a.y == end.north);
    return across || along;
}

// Edges that are not shared by exactly two triangles, one on each side, and do not lie on the border.
struct Edges {
    int64_t repeated = 0; // passed twice in one direction: triangles overlap, or three meet
    std::vector<std::array<uint32_t, 2>> open;
};

Edges check_edges(const Mesh& mesh, Extent end) {
    std::vector<std::array<uint32_t, 2>> directed;
    directed.reserve(mesh.triangles.size() * 3);
    for (const Triangle& t : mesh.triangles) {
        for (int i = 0; i < 3; i++) {
            directed.push_back({t[i], t[(i + 1) % 3]});
        }
    }
    std::sort(directed.begin(), directed.end());
    Edges edges;
    for (size_t i = 0; i < directed.size(); i++) {
        auto [from, to] = directed[i];
        edges.repeated += 0 < i && directed[i - 1] == directed[i];
        bool paired = std::binary_search(directed.begin(), directed.end(), std::array<uint32_t, 2>{to, from});
        bool border = on_border(mesh.vertices[from], mesh.vertices[to], end);
        if (!paired && !border) {
            edges.open.push_back({from, to});
        }
        edges.repeated += paired && border; // two triangles at one edge of the border: one of them lies outside
    }
    return edges;
}

// Corners of open edges that stand inside another open edge; looked for in the first few thousand only.
int64_t t_junctions(const Mesh& mesh, const Edges& edges) {
    size_t count = std::min<size_t>(edges.open.size(), 4000);
    int64_t found = 0;
    for (size_t i = 0; i < count; i++) {
        const Vertex& a = mesh.vertices[edges.open[i][0]];
        const Vertex& b = mesh.vertices[edges.open[i][1]];
        for (size_t j = 0; j < count; j++) {
            const Vertex& p = mesh.vertices[edges.open[j][0]];
            int64_t along = (p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y);
            int64_t length = (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y);
            found += doubled_area(a, b, p) == 0 && 0 < along && along < length;
        }
    }
    return found;
}

int64_t repeated_places(const Mesh& mesh) {
    std::vector<std::array<int64_t, 2>> places;
    for (const Vertex& v : mesh.vertices) {
        places.push_back({v.x, v.y});
    }
    std::sort(places.begin(), places.end());
    int64_t count = 0;
    for (size_t i = 1; i < places.size(); i++) {
        count += places[i - 1] == places[i];
    }
    return count;
}

std::vector<Fault> check_surface(const Mesh& mesh, const Heights& heights) {
    Extent end = extent(mesh, heights);
    int64_t clockwise = 0, degenerate = 0, outside = 0, unused = 0;
    __int128 signed_area = 0, area = 0;
    std::vector<bool> used(mesh.vertices.size());
    for (const Triangle& t : mesh.triangles) {
        int64_t doubled = doubled_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
        clockwise += doubled < 0;
        degenerate += doubled == 0;
        signed_area += doubled;
        area += doubled < 0 ? -doubled : doubled;
        for (uint32_t corner : t) {
            used[corner] = true;
        }
    }
    for (size_t i = 0; i < mesh.vertices.size(); i++) {
        const Vertex& v = mesh.vertices[i];
        outside += v.x < 0 || v.y < 0 || end.east < v.x || end.north < v.y;
        unused += !used[i];
    }
    __int128 whole = __int128(2) * end.east * end.north;
    Edges edges = check_edges(mesh, end);
    int64_t folded = std::min<int64_t>(clockwise, int64_t(mesh.triangles.size()) - degenerate - clockwise);
    return {
        {"folded_triangles", folded},
        {"clockwise_mesh", clockwise != folded},
        {"degenerate_triangles", degenerate},
        {"areas_do_not_add_up", signed_area != whole || area != whole},
        {"open_edges", int64_t(edges.open.size())},
        {"t_junctions", t_junctions(mesh, edges)},
        {"repeated_edges", edges.repeated},
        {"repeated_places", repeated_places(mesh)},
        {"vertices_outside", outside},
        {"unused_vertices", unused},
        {"off_lattice", OFF_LATTICE_POSTS < mesh.off_lattice_posts},
    };
}

// --- heights at posts ---

struct Posts {
    std::vector<double> heights; // of the topmost triangle; NaN where there is none
    int64_t uncovered = 0, covered_twice = 0;
};

// Whether a step of (1, tiny) by `east` and `north` from a point on the edge a-b leads to its left.
bool left_after_step(const Vertex& a, const Vertex& b, int64_t east, int64_t north) {
    int64_t first = -(b.y - a.y) * east;
    return first != 0 ? 0 < first : 0 < (b.x - a.x) * north;
}

bool owns(const Vertex (&corner)[3], const int64_t (&side)[3], int64_t east, int64_t north) {
    for (int i = 0; i < 3; i++) {
        if (side[i] < 0) {
            return false;
        }
        if (side[i] == 0 && !left_after_step(corner[(i + 1) % 3], corner[(i + 2) % 3], east, north)) {
            return false;
        }
    }
    return true;
}

void own_posts(const Mesh& mesh, const Triangle& t, const Heights& heights, Posts& posts,
               std::vector<uint8_t>& owners) {
    Vertex corner[3] = {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    int64_t area = doubled_area(corner[0], corner[1], corner[2]);
    if (area == 0) {
        return;
    }
    if (area < 0) {
        std::swap(corner[1], corner[2]);
        area = -area;
    }
    const int64_t steps = mesh.steps;
    auto [west, east] = std::minmax({corner[0].x, corner[1].x, corner[2].x});
    auto [south, north] = std::minmax({corner[0].y, corner[1].y, corner[2].y});
    int64_t last_column = heights.columns - 1, last_row = heights.rows - 1;
    int64_t column_end = std::min(last_column, east / steps), row_end = std::min(last_row, north / steps);
    for (int64_t row = std::max<int64_t>(0, (south + steps - 1) / steps); row <= row_end; row++) {
        for (int64_t column = std::max<int64_t>(0, (west + steps - 1) / steps); column <= column_end; column++) {
            Vertex p = {column * steps, row * steps, 0.0};
            // Each is twice the area opposite to a corner.
            int64_t side[3] = {doubled_area(corner[1], corner[2], p), doubled_area(corner[2], corner[0], p),
                               doubled_area(corner[0], corner[1], p)};
            if (!owns(corner, side, column == last_column ? -1 : 1, row == last_row ? -1 : 1)) {
                continue;
            }
            double z = (side[0] * corner[0].z + side[1] * corner[1].z + side[2] * corner[2].z) / double(area);
            size_t post = size_t(row) * heights.columns + size_t(column);
            posts.heights[post] = owners[post] == 0 ? z : std::max(posts.heights[post], z);
            owners[post] = uint8_t(std::min(owners[post] + 1, 255));
        }
    }
}

Posts heights_at_posts(const Mesh& mesh, const Heights& heights) {
    Posts posts;
    posts.heights.assign(heights.posts.size(), std::numeric_limits<double>::quiet_NaN());
    std::vector<uint8_t> owners(heights.posts.size());
    for (const Triangle& t : mesh.triangles) {
        own_posts(mesh, t, heights, posts, owners);
    }
    posts.uncovered = std::count(owners.begin(), owners.end(), 0);
    posts.covered_twice = std::count_if(owners.begin(), owners.end(), [](uint8_t count) { return 1 < count; });
    return posts;
}

struct Residuals {
    double rms_m = 0.0, max_m = 0.0, mean_abs_m = 0.0;
    int64_t posts = 0, max_column = 0, max_row = 0;
};

Residuals residuals(const Posts& posts, const Heights& heights, const std::function<bool(int64_t, int64_t)>& counts) {
    Residuals found;
    double squares = 0.0, sum = 0.0;
    for (int64_t row = 0; row < heights.rows; row++) {
        for (int64_t column = 0; column < heights.columns; column++) {
            double tin = posts.heights[size_t(row) * heights.columns + size_t(column)];
            double residual = std::fabs(tin - heights.at(column, row));
            if (std::isnan(residual) || !counts(column, row)) {
                continue;
            }
            squares += residual * residual;
            sum += residual;
            found.posts++;
            if (found.max_m < residual) {
                found.max_m = residual;
                found.max_column = column;
                found.max_row = row;
            }
        }
    }
    double posts_counted = double(std::max<int64_t>(found.posts, 1));
    found.rms_m = std::sqrt(squares / posts_counted);
    found.mean_abs_m = sum / posts_counted;
    return found;
}

// Root mean square difference of steepness at inner posts, in degrees.
double slope_rms(const Posts& posts, const Heights& heights) {
    int64_t columns = heights.columns, count = 0;
    double squares = 0.0;
    auto slope = [&](auto height, int64_t at) {
        double east = (height(at + 1) - height(at - 1)) / (2.0 * heights.spacing_x);
        double north = (height(at + columns) - height(at - columns)) / (2.0 * heights.spacing_y);
        return std::atan(std::hypot(east, north)) * DEGREES;
    };
    for (int64_t row = 1; row + 1 < heights.rows; row++) {
        for (int64_t column = 1; column + 1 < columns; column++) {
            int64_t at = row * columns + column;
            double dem = slope([&](int64_t post) { return double(heights.posts[size_t(post)]); }, at);
            double tin = slope([&](int64_t post) { return posts.heights[size_t(post)]; }, at);
            if (!std::isnan(tin)) {
                squares += (tin - dem) * (tin - dem);
                count++;
            }
        }
    }
    return std::sqrt(squares / double(std::max<int64_t>(count, 1)));
}

// Shares of triangles whose least angle, on the map, is below 5, 10 and 20 degrees.
std::array<double, 3> thin_shares(const Mesh& mesh, const Heights& heights) {
    std::array<double, 3> shares{};
    for (const Triangle& t : mesh.triangles) {
        double least = 180.0;
        for (int i = 0; i < 3; i++) {
            const Vertex& a = mesh.vertices[t[i]];
            const Vertex& b = mesh.vertices[t[(i + 1) % 3]];
            const Vertex& c = mesh.vertices[t[(i + 2) % 3]];
            double bx = double(b.x - a.x) * heights.spacing_x, by = double(b.y - a.y) * heights.spacing_y;
            double cx = double(c.x - a.x) * heights.spacing_x, cy = double(c.y - a.y) * heights.spacing_y;
            least = std::min(least, std::atan2(std::fabs(bx * cy - by * cx), bx * cx + by * cy) * DEGREES);
        }
        shares[0] += least < 5.0;
        shares[1] += least < 10.0;
        shares[2] += least < 20.0;
    }
    for (double& share : shares) {
        share /= double(std::max<size_t>(mesh.triangles.size(), 1));
    }
    return shares;
}

// --- line of sight ---

// A number in [0, 1) that depends on its index alone, so that every mesh of an area is asked the same questions.
double random_at(uint64_t index) {
    uint64_t mixed = (index + 1) * 0x9E3779B97F4A7C15u;
    mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9u;
    mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EBu;
    return double((mixed ^ (mixed >> 31)) >> 11) * 0x1p-53;
}

struct Place {
    double x, y; // posts
};

struct Line {
    Place from, to;

    Place at(double t) const { return {from.x + t * (to.x - from.x), from.y + t * (to.y - from.y)}; }
};

std::vector<Line> sight_lines(const Heights& heights, size_t wanted) {
    std::vector<Line> lines;
    double east = heights.columns - 1, north = heights.rows - 1;
    for (uint64_t draw = 0; lines.size() < wanted && draw < 100 * uint64_t(wanted); draw++) {
        Place from = {east * random_at(4 * draw), north * random_at(4 * draw + 1)};
        double azimuth = 360.0 / DEGREES * random_at(4 * draw + 2);
        double range_m = SIGHT_NEAR_M + (SIGHT_FAR_M - SIGHT_NEAR_M) * random_at(4 * draw + 3);
        Place to = {from.x + range_m * std::sin(azimuth) / heights.spacing_x,
                    from.y + range_m * std::cos(azimuth) / heights.spacing_y};
        if (0.0 <= to.x && to.x <= east && 0.0 <= to.y && to.y <= north) {
            lines.push_back({from, to});
        }
    }
    return lines;
}

double bilinear(const Heights& heights, Place p) {
    int64_t column = std::min(int64_t(p.x), int64_t(heights.columns) - 2);
    int64_t row = std::min(int64_t(p.y), int64_t(heights.rows) - 2);
    double u = p.x - double(column), v = p.y - double(row);
    double south = heights.at(column, row) * (1.0 - u) + heights.at(column + 1, row) * u;
    double north = heights.at(column, row + 1) * (1.0 - u) + heights.at(column + 1, row + 1) * u;
    return south * (1.0 - v) + north * v;
}

// On the raster the ground is looked at every half post.
bool visible_on_dem(const Heights& heights, const Line& line, double eye_m) {
    double posts = std::hypot(line.to.x - line.from.x, line.to.y - line.from.y);
    double eye = bilinear(heights, line.from) + eye_m, target = bilinear(heights, line.to) + eye_m;
    for (double step = 0.5; step < posts; step += 0.5) {
        double t = step / posts;
        if (eye + t * (target - eye) < bilinear(heights, line.at(t))) {
            return false;
        }
    }
    return true;
}

// Triangles by the squares of a coarse grid that their bounding boxes touch.
class Squares {
  public:
    Squares(const Mesh& mesh, const Heights& heights) : mesh_(mesh), heights_(heights) {
        double posts = double(heights.columns) * heights.rows;
        side_ = std::max(1.0, 1.5 * std::sqrt(posts / double(std::max<size_t>(mesh.triangles.size(), 1))));
        columns_ = int64_t((heights.columns - 1) / side_) + 1;
        rows_ = int64_t((heights.rows - 1) / side_) + 1;
        starts_.assign(size_t(columns_ * rows_) + 1, 0);
        asked_.assign(mesh.triangles.size(), 0);
        each_square([&](uint32_t, size_t square) { starts_[square + 1]++; });
        for (size_t i = 1; i < starts_.size(); i++) {
            starts_[i] += starts_[i - 1];
        }
        std::vector<size_t> next(starts_.begin(), starts_.end() - 1);
        held_.resize(starts_.back());
        each_square([&](uint32_t triangle, size_t square) { held_[next[square]++] = triangle; });
    }

    // Height of the topmost triangle at `p`, NaN where there is none.
    double height(Place p) const {
        double top = std::numeric_limits<double>::quiet_NaN();
        size_t square = size_t(along(p.y, rows_) * columns_ + along(p.x, columns_));
        for (size_t i = starts_[square]; i < starts_[square + 1]; i++) {
            double enter, leave;
            if (crossed(held_[i], {p, p}, enter, leave)) {
                double z = height_in(held_[i], p);
                top = top < z || std::isnan(top) ? z : top;
            }
        }
        return top;
    }

    // The ground is looked at wherever the line enters or leaves a triangle: between, both are straight.
    bool visible(const Line& line, double eye_m) {
        double eye = height(line.from) + eye_m, target = height(line.to) + eye_m;
        question_++;
        bool clear = !std::isnan(eye) && !std::isnan(target);
        each_square_under(line, [&](size_t square) {
            for (size_t i = starts_[square]; clear && i < starts_[square + 1]; i++) {
                uint32_t triangle = held_[i];
                double ends[2];
                if (asked_[triangle] == question_ || !crossed(triangle, line, ends[0], ends[1])) {
                    continue;
                }
                asked_[triangle] = question_;
                for (double t : ends) {
                    clear = clear && height_in(triangle, line.at(t)) <= eye + t * (target - eye);
                }
            }
            return clear;
        });
        return clear;
    }

  private:
    int64_t along(double posts, int64_t count) const {
        return std::clamp<int64_t>(int64_t(posts / side_), 0, count - 1);
    }

    template <typename Visit> void each_square(Visit visit) const {
        for (uint32_t i = 0; i < mesh_.triangles.size(); i++) {
            auto [a, b, c] = corners(i);
            auto [west, east] = std::minmax({a.x, b.x, c.x});
            auto [south, north] = std::minmax({a.y, b.y, c.y});
            for (int64_t row = along(south, rows_); row <= along(north, rows_); row++) {
                for (int64_t column = along(west, columns_); column <= along(east, columns_); column++) {
                    visit(i, size_t(row * columns_ + column));
                }
            }
        }
    }

    // Squares whose rows the line passes, each with the columns that it passes there; stops when `visit` is false.
    template <typename Visit> void each_square_under(const Line& line, Visit visit) const {
        int64_t south = along(std::min(line.from.y, line.to.y), rows_);
        int64_t north = along(std::max(line.from.y, line.to.y), rows_);
        double rise = line.to.y - line.from.y;
        for (int64_t row = south; row <= north; row++) {
            double t0 = 0.0, t1 = 1.0;
            if (rise != 0.0 && south < north) {
                double low = (double(row) * side_ - line.from.y) / rise;
                double high = (double(row + 1) * side_ - line.from.y) / rise;
                t0 = std::clamp(std::min(low, high) - 1e-9, 0.0, 1.0);
                t1 = std::clamp(std::max(low, high) + 1e-9, 0.0, 1.0);
            }
            auto [west, east] = std::minmax({along(line.at(t0).x, columns_), along(line.at(t1).x, columns_)});
            for (int64_t column = west; column <= east; column++) {
                if (!visit(size_t(row * columns_ + column))) {
                    return;
                }
            }
        }
    }

    struct Corner {
        double x, y, z;
    };

    std::array<Corner, 3> corners(uint32_t triangle) const {
        std::array<Corner, 3> found;
        for (int i = 0; i < 3; i++) {
            const Vertex& v = mesh_.vertices[mesh_.triangles[triangle][i]];
            found[i] = {double(v.x) / double(mesh_.steps), double(v.y) / double(mesh_.steps), v.z};
        }
        return found;
    }

    static double cross(const Corner& a, const Corner& b, Place p) {
        return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    }

    // The part of `line` inside a triangle, whichever way it turns.
    bool crossed(uint32_t triangle, const Line& line, double& enter, double& leave) const {
        std::array<Corner, 3> corner = corners(triangle);
        double turn = cross(corner[0], corner[1], {corner[2].x, corner[2].y}) < 0.0 ? -1.0 : 1.0;
        enter = 0.0;
        leave = 1.0;
        for (int i = 0; i < 3; i++) {
            double from = turn * cross(corner[i], corner[(i + 1) % 3], line.from) + 1e-9;
            double to = turn * cross(corner[i], corner[(i + 1) % 3], line.to) + 1e-9;
            if (from < 0.0 && to < 0.0) {
                return false;
            }
            if (from < 0.0) {
                enter = std::max(enter, from / (from - to));
            } else if (to < 0.0) {
                leave = std::min(leave, from / (from - to));
            }
        }
        return enter <= leave;
    }

    // Height of a triangle's plane at `p`, kept between its corners: a sliver's plane is steep and its edge is near.
    double height_in(uint32_t triangle, Place p) const {
        auto [a, b, c] = corners(triangle);
        double area = cross(a, b, {c.x, c.y});
        auto [lowest, highest] = std::minmax({a.z, b.z, c.z});
        if (area == 0.0) {
            return highest;
        }
        double z = (cross(b, c, p) * a.z + cross(c, a, p) * b.z + cross(a, b, p) * c.z) / area;
        return std::clamp(z, lowest, highest);
    }

    const Mesh& mesh_;
    const Heights& heights_;
    double side_;
    int64_t columns_, rows_;
    std::vector<size_t> starts_;
    std::vector<uint32_t> held_;
    std::vector<uint32_t> asked_; // the last line that each triangle was held against
    uint32_t question_ = 0;
};

struct Sight {
    int64_t lines = 0, same = 0, false_visible = 0, false_hidden = 0, dem_visible = 0, tin_visible = 0;
};

Sight line_of_sight(const Mesh& mesh, const Heights& heights, size_t wanted, double eye_m) {
    Squares squares(mesh, heights);
    Sight sight;
    for (const Line& line : sight_lines(heights, wanted)) {
        bool dem = visible_on_dem(heights, line, eye_m), tin = squares.visible(line, eye_m);
        sight.lines++;
        sight.same += dem == tin;
        sight.false_visible += tin && !dem;
        sight.false_hidden += dem && !tin;
        sight.dem_visible += dem;
        sight.tin_visible += tin;
    }
    return sight;
}

// --- telling ---

struct Arguments {
    std::string mesh, heights, residuals;
    double spacing_x = 0.0, spacing_y = 0.0;
    size_t sight_lines = 20000;
    std::vector<double> eyes_m;
    std::vector<int64_t> seam_columns, seam_rows;
    int64_t seam_within = 0;
};

std::vector<int64_t> numbers(const std::string& text) {
    std::vector<int64_t> found;
    std::istringstream in(text);
    for (std::string word; std::getline(in, word, ',');) {
        found.push_back(std::stoll(word));
    }
    return found;
}

Arguments arguments(int count, char** words) {
    if (count < 5) {
        throw std::runtime_error("usage: evaluate MESH HEIGHTS SPACING_X SPACING_Y [--sight-lines N] "
                                 "[--eyes METRES,…] [--seams COLUMN,…/ROW,… WITHIN_POSTS] "
                                 "[--residuals FILE]");
    }
    Arguments given{words[1], words[2], "", std::stod(words[3]), std::stod(words[4]), 20000, {}, {}, {}, 0};
    for (int i = 5; i < count; i++) {
        std::string word = words[i];
        if (word == "--sight-lines" && i + 1 < count) {
            given.sight_lines = std::stoul(words[++i]);
        } else if (word == "--eyes" && i + 1 < count) {
            std::istringstream in(words[++i]);
            for (std::string eye; std::getline(in, eye, ',');) {
                given.eyes_m.push_back(std::stod(eye));
            }
        } else if (word == "--seams" && i + 2 < count) {
            std::string lines = words[++i];
            size_t slash = std::min(lines.find('/'), lines.size());
            given.seam_columns = numbers(lines.substr(0, slash));
            given.seam_rows = numbers(slash < lines.size() ? lines.substr(slash + 1) : "");
            given.seam_within = std::stoll(words[++i]);
        } else if (word == "--residuals" && i + 1 < count) {
            given.residuals = words[++i];
        } else {
            throw std::runtime_error("found " + word + ", expected --sight-lines, --eyes, --seams or --residuals");
        }
    }
    return given;
}

// RMS within so many posts of the seams, and of all other posts.
void print_seams(const Posts& posts, const Heights& heights, const Arguments& given) {
    auto near = [&](int64_t column, int64_t row) {
        auto reaches = [&](int64_t place) { return [&, place](int64_t line) {
            return std::abs(line - place) <= given.seam_within; }; };
        return std::any_of(given.seam_columns.begin(), given.seam_columns.end(), reaches(column)) ||
               std::any_of(given.seam_rows.begin(), given.seam_rows.end(), reaches(row));
    };
    Residuals seams = residuals(posts, heights, near);
    Residuals others = residuals(posts, heights, [&](int64_t column, int64_t row) { return !near(column, row); });
    std::printf("  \"seams\": {\"posts\": %lld, \"rms_m\": %.9g, \"others_rms_m\": %.9g},\n", (long long)seams.posts,
                seams.rms_m, others.rms_m);
}

void write_residuals(const std::string& path, const Posts& posts, const Heights& heights) {
    std::ofstream out(path, std::ios::binary);
    uint32_t size[2] = {uint32_t(heights.columns), uint32_t(heights.rows)};
    out.write(reinterpret_cast<const char*>(size), sizeof size);
    for (int64_t row = 0; row < heights.rows; row++) {
        for (int64_t column = 0; column < heights.columns; column++) {
            size_t post = size_t(row) * size_t(heights.columns) + size_t(column);
            float residual = float(posts.heights[post] - heights.at(column, row));
            out.write(reinterpret_cast<const char*>(&residual), sizeof residual);
        }
    }
    if (!out.flush()) {
        throw std::runtime_error(path + ": cannot be written");
    }
}

void print_sight(const Sight& sight) {
    double lines = double(std::max<int64_t>(sight.lines, 1));
    std::printf("  \"sight\": {\"lines\": %lld, \"agreement\": %.6f, \"false_visible\": %.6f, \"false_hidden\": %.6f, "
                "\"dem_visible\": %.6f, \"tin_visible\": %.6f},\n",
                (long long)sight.lines, sight.same / lines, sight.false_visible / lines, sight.false_hidden / lines,
                sight.dem_visible / lines, sight.tin_visible / lines);
}

bool judge(const Arguments& given) {
    Heights heights = read_heights(given.heights, given.spacing_x, given.spacing_y);
    bool ply = 4 <= given.mesh.size() && given.mesh.compare(given.mesh.size() - 4, 4, ".ply") == 0;
    Mesh mesh = ply ? read_ply(given.mesh, heights) : read_mesh(given.mesh);
    for (const Triangle& t : mesh.triangles) {
        if (mesh.vertices.size() <= std::max({t[0], t[1], t[2]})) {
            throw std::runtime_error(given.mesh + ": a triangle names a vertex that is not there");
        }
    }
    Posts posts = heights_at_posts(mesh, heights);
    std::vector<Fault> faults = check_surface(mesh, heights);
    faults.push_back({"posts_uncovered", posts.uncovered});
    faults.push_back({"posts_covered_twice", posts.covered_twice});
    bool valid = std::all_of(faults.begin(), faults.end(), [](const Fault& fault) { return fault.count == 0; });
    Residuals all = residuals(posts, heights, [](int64_t, int64_t) { return true; });

    std::printf("{\n  \"valid\": %s,\n  \"faults\": {", valid ? "true" : "false");
    for (size_t i = 0; i < faults.size(); i++) {
        std::printf("%s\"%s\": %lld", i == 0 ? "" : ", ", faults[i].name, (long long)faults[i].count);
    }
    std::printf("},\n  \"triangles\": %zu, \"vertices\": %zu,\n", mesh.triangles.size(), mesh.vertices.size());
    std::printf("  \"rms_m\": %.9g, \"max_m\": %.9g, \"mean_abs_m\": %.9g, \"max_at\": [%lld, %lld],\n", all.rms_m,
                all.max_m, all.mean_abs_m, (long long)all.max_column, (long long)all.max_row);
    auto [below_5, below_10, below_20] = thin_shares(mesh, heights);
    std::printf("  \"least_angle_below\": {\"5\": %.6f, \"10\": %.6f, \"20\": %.6f},\n", below_5, below_10, below_20);
    if (0 < given.seam_within) {
        print_seams(posts, heights, given);
    }
    if (!given.residuals.empty()) {
        write_residuals(given.residuals, posts, heights);
    }
    if (0 < given.sight_lines) {
        print_sight(line_of_sight(mesh, heights, given.sight_lines, EYE_M));
        for (size_t i = 0; i < given.eyes_m.size(); i++) {
            Sight sight = line_of_sight(mesh, heights, given.sight_lines, given.eyes_m[i]);
            std::printf("%s\"%g\": %.6f%s", i == 0 ? "  \"agreement_at_m\": {" : "", given.eyes_m[i],
                        double(sight.same) / double(std::max<int64_t>(sight.lines, 1)),
                        i + 1 < given.eyes_m.size() ? ", " : "},\n");
        }
    }
    std::printf("  \"slope_rms_degrees\": %.6f\n}\n", slope_rms(posts, heights));
    return valid;
}

} // namespace

int main(int count, char** words) {
    try {
        return judge(arguments(count, words)) ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "error: %s\n", error.what());
        return 2;
    }
}
