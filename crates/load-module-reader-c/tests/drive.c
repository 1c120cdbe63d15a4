/*
 * Opens the database named on the command line in every way, and asks everything there is to ask. Behind the name: how
 * many levels of detail it has, and 1 where there is a deck, 2 with lines too, 3 with objects too.
 */
#include "load_module_reader.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int faults = 0;

static void expect(int holds, const char *what) {
    if (!holds) {
        printf("not so: %s\n", what);
        faults++;
    }
}

/* At every level there is load module 0,0; those coarser than the finest are a metre higher. */
static void ask_levels(const lmr_area *area, uint32_t levels) {
    char why[256] = "";
    lmr_frame frame;
    lmr_describe(area, &frame);
    expect(lmr_level_count(area) == levels, "as many levels as there are");
    for (uint32_t level = 0; level < levels; level++) {
        lmr_ground *ground = lmr_load_level(area, frame.east_m, frame.north_m, 7, level, why, sizeof why);
        double height = 0, expected = level == 0 ? 1000.0 : 1001.0;
        expect(ground != NULL && lmr_height(ground, frame.east_m, frame.north_m, &height), why);
        expect(height == expected, "the height of that level");
        expect(lmr_move(ground, area, 0, 0, LMR_ALL, why, sizeof why), why);
        expect(lmr_height(ground, frame.east_m, frame.north_m, &height) && height == expected, "the level stays");
        lmr_unload(ground);
    }
    expect(lmr_load_level(area, frame.east_m, frame.north_m, 7, levels, why, sizeof why) == NULL, "no more levels");
    expect(strncmp(why, "found level ", 12) == 0, why);
    expect(lmr_load_level(area, frame.east_m, frame.north_m, 7, UINT32_MAX, why, sizeof why) == NULL, "nor any");
}

/* The bridge is the middle of a line, and a track that is left out is another one; or there are none. */
static void ask_lines(const lmr_area *area, int has_lines) {
    char why[256];
    lmr_ground *ground = lmr_load(area, 505250, 3875250, LMR_ALL, why, sizeof why);
    expect(ground != NULL && lmr_line_count(ground, 0) == (has_lines ? 2u : 0u), "as many lines");
    lmr_line road, track;
    expect(!lmr_line_at(ground, 0, 2, &road) && !lmr_line_at(ground, 1, 0, &road), "no other lines");
    expect(lmr_line_at(ground, 0, 0, &road) == has_lines && lmr_line_at(ground, 0, 1, &track) == has_lines, "lines");
    if (has_lines) {
        expect(road.class_of_way == 3 && road.width == 2560 && road.vertex_count == 2, "the road");
        expect(road.kind == LMR_TRAVELLED && road.form == LMR_STRIP && road.storey == LMR_ON_BRIDGE, "what it is");
        expect(road.is_kept && !road.is_in_ground && road.vertices[1].x == 41600, "where it is");
        expect(track.class_of_way == 4 && track.form == LMR_NOTHING && !track.is_kept, "the track is left out");
    }
    lmr_unload(ground);
}

/* Over the middle of the load module hangs a deck, 5 m above the ground, class 3; or there is none. */
static void ask_decks(const lmr_area *area, int has_decks) {
    char why[256] = "";
    lmr_frame frame;
    lmr_describe(area, &frame);
    lmr_ground *ground = lmr_load(area, frame.east_m, frame.north_m, 0, why, sizeof why);
    const double east = frame.east_m + 250, north = frame.north_m + 250;
    double on_ground = 0, top = 0, under = 0;
    expect(lmr_height(ground, east, north, &on_ground), "the ground");
    expect(lmr_height_below(ground, east, north, INFINITY, &top), "the topmost");
    expect(top == (has_decks ? 1010.0 : on_ground), "the deck lies on top, where there is one");
    expect(lmr_height_below(ground, east, north, 1009.9, &under) && under == on_ground, "the ground lies under it");
    expect(lmr_height_below(ground, east, north, 1010.0, &under) && under == top, "not above: at it is enough");
    expect(!lmr_height_below(ground, east, north, 990, &under) && under == top, "all lies above");
    expect(!lmr_height_below(ground, east, north, NAN, &under), "no ceiling at all");
    lmr_surface surface;
    expect(lmr_surface_below(ground, east, north, INFINITY, &surface) && surface.height_m == top, "a surface");
    expect(surface.is_deck == has_decks && (!has_decks || surface.class_of_surface == 3), "the deck's class");
    expect(!has_decks || surface.normal[2] == 1.0, "it is level");
    expect(lmr_surface_below(ground, east, north, 1009, &surface) && !surface.is_deck, "the ground's surface");
    const double places[3][3] = {{east, north, INFINITY}, {east, north, 1009}, {east, north, 0}};
    double heights[3];
    expect(lmr_heights_below(ground, places, heights, 3), "three heights at once");
    expect(heights[0] == top && heights[1] == on_ground && isnan(heights[2]), "over, under, and below all");
    const double over[3] = {east - 100, north, 1011}, beyond[3] = {east + 100, north, 1011};
    const double below[3] = {east - 100, north, 1009}, far_below[3] = {east + 100, north, 1009};
    double share = -1;
    expect(lmr_sight(ground, over, beyond, NULL) == LMR_FREE, "over the deck");
    expect(lmr_sight(ground, below, far_below, NULL) == LMR_FREE, "under the deck");
    expect(lmr_sight(ground, over, far_below, &share) == (has_decks ? LMR_HIDDEN : LMR_FREE), "through the deck");
    expect(!has_decks || fabs(share - 0.5) < 1e-6, "half way");
    lmr_decks decks;
    expect(lmr_decks_at(ground, 0, &decks) && !lmr_decks_at(ground, 1, &decks), "decks to draw");
    expect(decks.vertex_count == (has_decks ? 4u : 0u) && decks.triangle_count == (has_decks ? 2u : 0u), "as many");
    expect(has_decks ? decks.vertices[0].z == 129280 && decks.classes[0] == 3 : !decks.vertices, "the lists");
    lmr_unload(ground);
}

/* In the east stands a tower with a court, its wall open to the east, and in the north lies a wood; or neither. */
static void ask_objects(const lmr_area *area, int has_objects) {
    char why[256];
    lmr_ground *ground = lmr_load(area, 505250, 3875250, LMR_ALL, why, sizeof why);
    size_t corners = 0;
    lmr_prism tower;
    lmr_canopy wood;
    expect(lmr_prism_count(ground, 0) == (size_t)has_objects && lmr_prism_count(ground, 1) == 0, "as many prisms");
    expect(lmr_canopy_count(ground, 0) == (size_t)has_objects, "as many canopies");
    expect(lmr_prism_at(ground, 0, 0, &tower) == has_objects && !lmr_prism_at(ground, 0, 1, &tower), "the tower");
    expect(lmr_canopy_at(ground, 0, 0, &wood) == has_objects && !lmr_canopy_at(ground, 1, 0, &wood), "the wood");
    const lmr_corner *ring = lmr_ring_at(ground, 0, 0, 0, &corners);
    expect(!ring == !has_objects && !lmr_ring_at(ground, 0, 0, 2, &corners), "its roofline, and no third ring");
    const double west[3] = {505300, 3875100, 1005}, east[3] = {505490, 3875100, 1005};
    const double south[3] = {505100, 3875300, 1005}, north[3] = {505100, 3875450, 1005};
    lmr_sighting found;
    int seen = lmr_sight_past(ground, west, east, LMR_ALL_OBJECTS, 0.5, &found);
    expect(seen == (has_objects ? LMR_HIDDEN : LMR_FREE), "the tower hides");
    expect(!has_objects || (found.hidden_by == LMR_BY_BUILDING && fabs(found.share * 190 - 100) < 1e-6), "where");
    expect(lmr_sight_past(ground, west, east, LMR_NO_OBJECTS, 0.5, NULL) == LMR_FREE, "not when it is left out");
    seen = lmr_sight_past(ground, south, north, LMR_ALL_OBJECTS, 0.5, &found);
    expect(seen == (has_objects ? LMR_HIDDEN : LMR_FREE), "the wood hides");
    expect(!has_objects || (found.hidden_by == LMR_BY_WOOD && fabs(found.wood_m - 100) < 0.1), "so much wood");
    expect(lmr_sight_past(ground, south, north, LMR_BUILDINGS, 0.5, &found) == LMR_FREE, "it is no building");
    expect(found.hidden_by == 0 && found.share == 1, "nothing hides");
    expect(lmr_sight_past(ground, south, north, 3, 0.5, &found) == LMR_INVALID, "no such objects");
    expect(lmr_sight_past(ground, south, north, 2, 0, &found) == LMR_INVALID, "no such least");
    lmr_top top;
    double height;
    expect(lmr_top_at(ground, 505410, 3875100, &top) && lmr_height(ground, 505410, 3875100, &height), "a top");
    expect(has_objects ? top.height_m == 1020 && top.of == LMR_BY_BUILDING : top.height_m == height, "the roof");
    expect(!lmr_top_at(ground, 0, 0, &top), "no top far away");
    lmr_obstacle wall, stems;
    const double beside[3] = {505398, 3875100, 1000}, inside[3] = {505100, 3875400, 1001};
    expect(lmr_obstacle_at(ground, beside, 1, &wall) == 0, "past the wall");
    expect(lmr_obstacle_at(ground, beside, 3, &wall) == has_objects, "against the wall");
    expect(lmr_obstacle_at(ground, inside, 3, &stems) == has_objects, "into the wood");
    if (has_objects) {
        expect(tower.id == 7 && tower.roof == 1020 * 128 && tower.ring_count == 2, "what the tower is");
        lmr_ring_at(ground, 0, 0, 0, &corners);
        expect(corners == 4 && ring[0].x == 51200 && ring[0].has_wall && !ring[1].has_wall, "its corners");
        expect(wood.id == 9 && wood.kind == LMR_WOOD && wood.fullness == 90 && wood.triangle_count == 2, "the wood");
        expect(wood.places[2][1] == 57600 && wood.triangles[1][2] == 3, "its plan");
        expect(wall.kind == LMR_TOWER && wall.distance_m == 2 && wall.spacing_m == 0, "a wall stops");
        expect(stems.kind == LMR_WOOD && stems.distance_m == 0 && stems.spacing_m == 4, "stems are apart");
    }
    lmr_unload(ground);
}

static void ask(const lmr_area *area) {
    char why[256] = "";
    lmr_frame frame;
    lmr_describe(area, &frame);
    expect(frame.rows == 1 && frame.cols == 1 && frame.side_m == 500.0, "one load module of 500 m");
    lmr_ground *ground = lmr_load(area, frame.east_m + 250, frame.north_m + 250, 7, why, sizeof why);
    expect(ground != NULL, why);
    double height = 0;
    expect(lmr_height(ground, frame.east_m, frame.north_m, &height) && height == 1000.0, "1000 m in the south-west");
    expect(lmr_height(ground, frame.east_m + 500, frame.north_m + 500, &height) && height == 1002.0,
           "1002 m in the north-east");
    expect(!lmr_height(ground, frame.east_m - 1, frame.north_m, &height), "nothing beyond the area");
    lmr_sample sample;
    expect(lmr_sample_at(ground, frame.east_m + 400, frame.north_m + 100, &sample), "a sample");
    expect(sample.class_of_ground == 0 && sample.normal[2] > 0.99 && sample.normal[1] < 0, "it faces up and south");
    const double places[3][2] = {
        {frame.east_m, frame.north_m}, {frame.east_m, frame.north_m + 500}, {frame.east_m, frame.north_m + 501}};
    double heights[3];
    lmr_heights(ground, places, heights, 3);
    expect(heights[0] == 1000.0 && heights[1] == 1001.0 && isnan(heights[2]), "three heights at once");
    const double eye[3] = {frame.east_m + 10, frame.north_m + 10, 1002};
    const double seen[3] = {frame.east_m + 490, frame.north_m + 490, 1004};
    const double buried[3] = {frame.east_m + 490, frame.north_m + 490, 1000.5};
    const double beyond[3] = {frame.east_m + 600, frame.north_m + 490, 1010};
    double share = -1;
    expect(lmr_sight(ground, eye, seen, &share) == LMR_FREE, "a free line");
    expect(lmr_sight(ground, eye, buried, &share) == LMR_HIDDEN && 0 < share && share <= 1, "a hidden one");
    expect(lmr_sight(ground, eye, beyond, NULL) == LMR_UNKNOWN, "one that leaves");
    lmr_module module;
    expect(lmr_module_count(ground) == 1 && lmr_module_at(ground, 0, &module), "a load module to draw");
    expect(module.vertex_count == 4 && module.triangle_count == 2 && module.vertices[3].z == 128256, "its vertices");
    expect(module.triangles[1][1] == 3 && module.classes[1] == 1, "its triangles and classes");
    expect(!lmr_module_at(ground, 1, &module), "no second one");
    expect(lmr_move(ground, area, 0, 0, 7, why, sizeof why) && lmr_module_count(ground) == 0, "nothing far away");
    expect(lmr_move(ground, area, 0, 0, LMR_ALL, why, sizeof why) && lmr_module_count(ground) == 1, "all of it");
    lmr_unload(ground);
}

int main(int argc, char **argv) {
    char why[32];
    if (argc != 4) return 2;
    for (int keep = LMR_ON_DISK; keep <= LMR_MAPPED; keep++) {
        lmr_area *area = lmr_open(argv[1], keep, why, sizeof why);
        expect(area != NULL, why);
        if (area) {
            ask(area);
            ask_levels(area, (uint32_t)atoi(argv[2]));
            ask_decks(area, argv[3][0] != '0');
            ask_lines(area, argv[3][0] >= '2');
            ask_objects(area, argv[3][0] == '3');
        }
        lmr_close(area);
    }
    expect(lmr_open("no/such/database", LMR_ON_DISK, why, sizeof why) == NULL, "no database there");
    expect(strncmp(why, "no/such/database", 16) == 0 && strlen(why) == sizeof why - 1, "the reason, cut to fit");
    printf("%d faults\n", faults);
    return faults != 0;
}
