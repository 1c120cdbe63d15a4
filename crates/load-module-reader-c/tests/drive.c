/*
 * Opens the database named on the command line in every way, and asks everything there is to ask. Behind the name: how
 * many levels of detail it has.
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
    if (argc != 3) return 2;
    for (int keep = LMR_ON_DISK; keep <= LMR_MAPPED; keep++) {
        lmr_area *area = lmr_open(argv[1], keep, why, sizeof why);
        expect(area != NULL, why);
        if (area) {
            ask(area);
            ask_levels(area, (uint32_t)atoi(argv[2]));
        }
        lmr_close(area);
    }
    expect(lmr_open("no/such/database", LMR_ON_DISK, why, sizeof why) == NULL, "no database there");
    expect(strncmp(why, "no/such/database", 16) == 0 && strlen(why) == sizeof why - 1, "the reason, cut to fit");
    printf("%d faults\n", faults);
    return faults != 0;
}
