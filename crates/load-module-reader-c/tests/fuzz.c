/*
 * Asks the C interface everything, with hostile arguments, about load-module files that were damaged on purpose.
 *
 *     fuzz SEEDS WORK FIRST SECONDS [LAST]   files of SEEDS, damaged by the random numbers of FIRST, FIRST + 1, ...
 *     fuzz FINDINGS WORK                     every file of FINDINGS as it is: what was found once, or made by hand
 *
 * Most damaged files have their checksums made right again, so that what lies behind them is reached. A round that
 * ends the process, takes longer than a few seconds, or breaks a promise of the header, prints its number; with this
 * number as FIRST and LAST it is repeated, and its files lie in WORK/modules. scripts/fuzz.sh c builds and runs this.
 */
#include "load_module_reader.h"

#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { SEEDS_MAX = 64, FILES_MAX = 3, FILE_BYTES = 1 << 20, ROUND_SECONDS = 20, ASKED = 24 };

typedef struct {
    char name[256];
    unsigned char *bytes;
    size_t length;
} Seed;

static Seed seeds[SEEDS_MAX];
static size_t seed_count = 0;
static const char *work;
static volatile unsigned long long round_now = 0;
static unsigned long long loaded_count = 0, opened_count = 0;

/* ---- Ending: always with the number of the round. */

static void say_round(void) {
    char text[64];
    int length = snprintf(text, sizeof text, "\nround %llu\n", round_now);
    if (write(2, text, (size_t)length) < 0) _exit(4);
}

static void ended(int signal_number) {
    say_round();
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

#if defined(__SANITIZE_ADDRESS__)
void __asan_set_death_callback(void (*callback)(void));
#endif

static void fail(const char *what) {
    fprintf(stderr, "not so: %s\n", what);
    abort();
}

static void expect(int holds, const char *what) {
    if (!holds) fail(what);
}

/* ---- Random numbers: SplitMix64. */

static uint64_t state;

static uint64_t draw(void) {
    uint64_t z = (state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static uint64_t below(uint64_t bound) { return bound ? draw() % bound : 0; }

/* ---- Little-endian numbers and checksums. */

static uint32_t word(const unsigned char *at) {
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static void put(unsigned char *at, uint64_t value, int bytes) {
    for (int i = 0; i < bytes; i++) at[i] = (unsigned char)(value >> (8 * i));
}

static void put_double(unsigned char *at, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(at, bits, 8);
}

static uint32_t crc32(const unsigned char *bytes, size_t length) {
    static uint32_t table[256];
    if (!table[1]) {
        for (uint32_t i = 0; i < 256; i++) {
            uint32_t sum = i;
            for (int bit = 0; bit < 8; bit++) sum = sum & 1 ? sum >> 1 ^ 0xedb88320u : sum >> 1;
            table[i] = sum;
        }
    }
    uint32_t sum = UINT32_MAX;
    for (size_t i = 0; i < length; i++) sum = table[(sum ^ bytes[i]) & 0xff] ^ sum >> 8;
    return ~sum;
}

static void seal(unsigned char *file, size_t length, uint64_t from, uint64_t bytes) {
    if (from > length || bytes > length - from || bytes < 4) return;
    put(file + from + bytes - 4, crc32(file + from, (size_t)bytes - 4), 4);
}

/* Bytes of an entry of the index: in version 2 each ends with four words about decks, in version 3 with one about parts. */
static uint64_t entry_bytes(const unsigned char *file) { return file[8] == 2 ? 48 : file[8] == 3 ? 36 : 32; }

/* Bytes of the part with decks behind a section, as its entry says. */
static uint64_t deck_bytes(const unsigned char *file, const unsigned char *entry) {
    if (entry_bytes(file) != 48 || !word(entry + 36)) return 0;
    return (20 + 8 * (uint64_t)word(entry + 32) + 7 * (uint64_t)word(entry + 36) + 3) / 4 * 4 + 4;
}

/* Bytes of the table of parts behind a section and of its parts, as its entry says; those of the table alone. */
static uint64_t parts_bytes(const unsigned char *file, const unsigned char *entry) {
    return entry_bytes(file) == 36 ? word(entry + 32) : 0;
}

static uint64_t table_bytes(const unsigned char *table) { return 16 + 12 * (uint64_t)word(table + 12) + 4; }

/* Makes the checksums of parts right in their table, and its own. */
static void seal_parts(unsigned char *file, size_t length, uint64_t at, uint64_t bytes) {
    if (bytes < 36 || at > length || bytes > length - at || table_bytes(file + at) > bytes) return;
    uint64_t part = at + table_bytes(file + at);
    for (uint64_t i = 0; i < word(file + at + 12); i++) {
        unsigned char *entry = file + at + 16 + 12 * i;
        uint64_t own = word(entry + 4);
        if (own > at + bytes - part) break;
        put(entry + 8, crc32(file + part, (size_t)own), 4);
        part += own;
    }
    seal(file, length, at, table_bytes(file + at));
}

/* Load modules times levels, as the header says. */
static uint64_t entries_of(const unsigned char *file) {
    uint64_t rows = word(file + 44) - (uint64_t)word(file + 40), cols = word(file + 52) - (uint64_t)word(file + 48);
    uint64_t levels = (uint64_t)file[10] | (uint64_t)file[11] << 8;
    if (rows > 4096 || cols > 4096 || levels > 64) return 0;
    return rows * cols * levels;
}

static void seal_all(unsigned char *file, size_t length) {
    if (length < 124) return;
    uint64_t header = word(file + 12), entries = entries_of(file), each = entry_bytes(file);
    seal(file, length, 0, header);
    seal(file, length, header, each * entries + 4);
    for (uint64_t i = 0; i < entries && header + each * i + each <= length; i++) {
        const unsigned char *entry = file + header + each * i;
        uint64_t at = word(entry) | (uint64_t)word(entry + 4) << 32;
        seal(file, length, at, word(entry + 8));
        seal(file, length, at + word(entry + 8), deck_bytes(file, entry));
        seal_parts(file, length, at + word(entry + 8), parts_bytes(file, entry));
    }
}

/* ---- Damage. */

static uint64_t odd_number(uint64_t now) {
    static const uint64_t odd[] = {0, 1, 2, 3, 7, 8, 9, 127, 128, 255, 256, 32767, 32768, 65534, 65535, 65536, 131070,
                                   131071, 0x7fffffff, 0x80000000u, 0xfffffffeu, 0xffffffffu, UINT64_MAX,
                                   (uint64_t)1 << 63, (uint64_t)1 << 40, (uint64_t)1 << 30};
    switch (below(5)) {
        case 0: return now + 1;
        case 1: return now - 1;
        case 2: return draw();
        default: return odd[below(sizeof odd / sizeof *odd)];
    }
}

static double odd_double(void) {
    static const double odd[] = {0, -0.0, 1, -1, 1e-320, 1e-300, 1e9, -1e9, 1e9 + 1, 1e11, 1e12, -1e12, 1e15, 1e18,
                                 9.3e18, 1e19, 1e38, 1e150, 1e155, -1e155, 1e300, 1e305, 1e307, -1e307, 1.7e308,
                                 -1.7e308, INFINITY, -INFINITY, NAN};
    return odd[below(sizeof odd / sizeof *odd)];
}

static void damage_header(unsigned char *file, size_t length) {
    static const int fields[][2] = {{8, 2},  {10, 2}, {12, 4}, {16, 8}, {24, 4}, {28, 4}, {32, 4}, {36, 4}, {40, 4},
                                    {44, 4}, {48, 4}, {52, 4}, {56, 4}, {60, 4}, {64, 4}, {68, 4}, {72, 8}, {80, 8}, {88, 2},
                                    {90, 2}};
    if (length < 124) return;
    const int *field = fields[below(sizeof fields / sizeof *fields)];
    if (field[0] == 72 || field[0] == 80) {
        put_double(file + field[0], odd_double());
    } else {
        put(file + field[0], odd_number(word(file + field[0])), field[1]);
    }
}

/* Makes the area larger, or moves it, or changes its grid: all this may be right. */
static void stretch(unsigned char *file, size_t length) {
    if (length < 124) return;
    switch (below(4)) {
        case 0: put(file + 32, word(file + 44) + (below(2) ? below(1000) : below((uint64_t)1 << 32)), 4); break;
        case 1: put(file + 36, word(file + 52) + (below(2) ? below(1000) : below((uint64_t)1 << 32)), 4); break;
        case 2: put(file + 32, 1 << 20, 4), put(file + 36, 1 << 20, 4); break;
        default: put_double(file + 72 + 8 * below(2), ((double)below(2000000001) - 1e9) * (below(2) ? 1 : 1e-3));
    }
}

static unsigned char *entry_at(unsigned char *file, size_t length) {
    if (length < 124) return NULL;
    uint64_t at = word(file + 12) + entry_bytes(file) * below(entries_of(file));
    return entries_of(file) && at + entry_bytes(file) <= length ? file + at : NULL;
}

static void damage_entry(unsigned char *file, size_t length) {
    unsigned char *entry = entry_at(file, length);
    if (!entry) return;
    int field = (int)below((entry_bytes(file) - 4) / 4);
    if (field == 0) put(entry, odd_number(word(entry)), 8);
    else put(entry + 4 + 4 * field, odd_number(word(entry + 4 + 4 * field)), 4);
}

/* Gives all decks of a load module one height, any, which keeps them in order, and tells the index. */
static void shake_decks(unsigned char *file, size_t length, unsigned char *entry) {
    uint64_t at = word(entry) + (uint64_t)word(entry + 8), bytes = deck_bytes(file, entry);
    /* What is written may lie over the entry itself. */
    uint64_t vertices = word(entry + 32);
    if (!bytes || at > length || bytes > length - at) return;
    uint32_t z = below(3) ? (uint32_t)draw() : word(entry + 28) + (uint32_t)below(4096);
    for (uint64_t i = 0; i < vertices; i++) put(file + at + 20 + 8 * i + 4, z, 4);
    put(entry + 40, z, 4);
    put(entry + 44, z, 4);
}

/* Gives the vertices of a load module any heights, and tells the index. */
static void shake_heights(unsigned char *file, size_t length) {
    unsigned char *entry = entry_at(file, length);
    if (!entry) return;
    uint64_t at = word(entry), vertices = word(entry + 12);
    if (word(entry + 4) || at + 56 + 8 * vertices > length) return;
    int32_t low = INT32_MAX, high = INT32_MIN;
    for (uint64_t i = 0; i < vertices; i++) {
        unsigned char *z = file + at + 56 + 8 * i + 4;
        if (below(2)) put(z, below(3) ? draw() : (draw() & 1 ? 0x7fffffff : 0x80000000u), 4);
        int32_t height = (int32_t)word(z);
        low = height < low ? height : low;
        high = high < height ? height : high;
    }
    shake_decks(file, length, entry);
    put(entry + 24, (uint32_t)low, 4);
    put(entry + 28, (uint32_t)high, 4);
}

static void damage_section(unsigned char *file, size_t length) {
    unsigned char *entry = entry_at(file, length);
    if (!entry || word(entry + 4)) return;
    uint64_t at = word(entry), bytes = word(entry + 8);
    if (deck_bytes(file, entry) && below(2)) at += bytes, bytes = deck_bytes(file, entry);
    if (at > length || bytes > length - at || bytes < 24) return;
    for (uint64_t times = 1 + below(3); times; times--) {
        uint64_t place = at + (below(2) && 64 <= bytes ? below(56) : below(bytes - 8));
        int width = 1 << below(4);
        put(file + place, odd_number(word(file + place)), width);
    }
}

/* Other kinds, counts, lengths and lines: in the table of parts, or somewhere behind it. */
static void damage_parts(unsigned char *file, size_t length) {
    unsigned char *entry = entry_at(file, length);
    if (!entry || word(entry + 4)) return;
    uint64_t at = word(entry) + (uint64_t)word(entry + 8), bytes = parts_bytes(file, entry);
    if (bytes < 36 || at > length || bytes > length - at) return;
    if (below(4) == 0) {
        /* A kind that is not known. */
        uint64_t last = word(file + at + 12);
        if (last && last < 9 && 16 + 12 * last <= bytes) put(file + at + 4 + 12 * last, 3 + below(1000), 4);
        return;
    }
    for (uint64_t times = 1 + below(3); times; times--) {
        uint64_t place = at + (below(2) ? below(36) : below(bytes - 3));
        int width = 1 << below(3);
        if (place + (uint64_t)width <= length) put(file + place, odd_number(file[place]), width);
    }
}

static size_t damage_length(unsigned char *file, size_t length) {
    size_t cut = below(2) ? (size_t)below(length + 1) : length - (size_t)below(length < 64 ? length + 1 : 64);
    if (below(3) == 0 && length + 4096 < FILE_BYTES) {
        cut = length + (size_t)below(4096);
        for (size_t i = length; i < cut; i++) file[i] = (unsigned char)draw();
    }
    if (below(2) && 124 <= cut) put(file + 16, cut, 8);
    return cut;
}

static size_t damage_bytes(unsigned char *file, size_t length) {
    for (uint64_t times = 1 + below(8); times && length; times--) file[below(length)] ^= (unsigned char)(1 << below(8));
    if (below(4) == 0 && 16 < length) {
        size_t from = (size_t)below(length), to = (size_t)below(length), bytes = (size_t)below(length / 4 + 1);
        if (from + bytes <= length && to + bytes <= length) memmove(file + to, file + from, bytes);
    }
    return length;
}

static size_t damage(unsigned char *file, size_t length) {
    for (uint64_t times = below(4); times; times--) {
        switch (below(11)) {
            case 9: case 10: damage_parts(file, length); break;
            case 0: damage_header(file, length); break;
            case 1: damage_entry(file, length); break;
            case 2: case 3: damage_section(file, length); break;
            case 4: case 5: shake_heights(file, length); break;
            case 6: length = damage_length(file, length); break;
            case 7: length = damage_bytes(file, length); break;
            default: stretch(file, length);
        }
    }
    if (below(8)) seal_all(file, length);
    return length;
}

/* ---- Questions. */

static double coordinate(double origin, double length) {
    switch (below(6)) {
        case 0: return odd_double();
        case 1: return origin + odd_double();
        case 2: return origin + (double)below(3) * length / 2;
        case 3: return origin + (double)(int64_t)draw() / 9.3e18 * 1e4;
        default: return origin + (double)below(1000001) / 1e6 * length;
    }
}

static void ask_sight(const lmr_ground *ground, const lmr_frame *frame, double height) {
    double wide = frame->side_m * (frame->cols < 20 ? frame->cols : 20);
    double high = frame->side_m * (frame->rows < 20 ? frame->rows : 20);
    double ends[2][3];
    for (int end = 0; end < 2; end++) {
        ends[end][0] = coordinate(frame->east_m, wide);
        ends[end][1] = coordinate(frame->north_m, high);
        ends[end][2] = below(3) ? height + (double)below(2000) - 200 : odd_double();
    }
    if (below(8) == 0) memcpy(ends[1], ends[0], sizeof ends[0]);
    double share = -7;
    int sight = lmr_sight(ground, ends[0], ends[1], below(8) ? &share : NULL);
    expect(sight == LMR_FREE || sight == LMR_HIDDEN || sight == LMR_UNKNOWN, "an answer about sight");
    expect(share == -7 || (sight == LMR_HIDDEN && 0 <= share && share <= 1), "a share between 0 and 1");
    for (int i = 0; i < 6; i++) {
        if (!isfinite(ends[i / 3][i % 3])) expect(sight == LMR_UNKNOWN, "nothing is known of places that are none");
    }
    lmr_sighting found;
    double least = below(8) ? 0.5 : odd_double();
    int past = lmr_sight_past(ground, ends[0], ends[1], (int)below(4), least, below(8) ? &found : NULL);
    expect(past == LMR_INVALID || sight != LMR_HIDDEN || past == LMR_HIDDEN, "objects hide, and show nothing");
    if (lmr_sight_past(ground, ends[0], ends[1], LMR_ALL_OBJECTS, 0.5, &found) != LMR_UNKNOWN) {
        expect(0 <= found.share && found.share <= 1 && 0 <= found.transmission && found.transmission <= 1, "shares");
        expect(0 <= found.wood_m && found.hidden_by <= LMR_BY_WALL, "woods and what hides");
    }
    lmr_obstacle obstacle;
    double radius = below(4) ? (double)below(100) : odd_double();
    if (lmr_obstacle_at(ground, ends[0], radius, &obstacle)) {
        expect(0 <= obstacle.distance_m && obstacle.distance_m <= radius + 1e-6, "it is reached");
        expect(obstacle.kind <= LMR_TREE_ROW && (obstacle.kind <= LMR_WALL) == (obstacle.spacing_m == 0), "its kind");
    }
}

/* The topmost of ground and decks: never below the ground where there is no ceiling, never above one. */
static void ask_below(const lmr_ground *ground, const double place[2], int found, double on_ground) {
    double top = 0, many = 0;
    lmr_surface surface;
    expect(lmr_height_below(ground, place[0], place[1], INFINITY, &top) == found, "a top where there is ground");
    expect(!found || on_ground <= top, "the ground or a deck above it");
    lmr_top highest;
    expect(lmr_top_at(ground, place[0], place[1], &highest) == found, "what lies on top");
    expect(!found || (top <= highest.height_m && LMR_BY_GROUND <= highest.of && highest.of <= LMR_BY_WALL), "its kind");
    double ceiling = below(3) ? (below(2) ? on_ground : top) + (double)below(9) - 4 : odd_double();
    const double places[1][3] = {{place[0], place[1], ceiling}};
    double height = 0;
    int has = lmr_height_below(ground, place[0], place[1], ceiling, &height);
    expect(!has || (found && height <= ceiling && height <= top), "not above the ceiling");
    expect(has || !found || !(on_ground <= ceiling), "the ground where it is low enough");
    expect(lmr_surface_below(ground, place[0], place[1], ceiling, &surface) == has, "a surface where a height is");
    expect(lmr_heights_below(ground, places, &many, 1) == 1 && (has ? many == height : isnan(many)), "one as many");
    if (has) {
        const double *n = surface.normal;
        double length = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
        expect(surface.height_m == height && fabs(length - 1) < 1e-6 && 0 <= n[2], "a unit vector up");
        expect(surface.is_deck <= 1 && (!surface.is_deck || surface.class_of_surface != LMR_HOLE_CLASS), "a class");
        expect(surface.is_deck || height == on_ground, "the ground as it is");
    }
}

static void ask_places(const lmr_ground *ground, const lmr_frame *frame) {
    double places[ASKED][2], heights[ASKED];
    for (int i = 0; i < ASKED; i++) {
        places[i][0] = coordinate(frame->east_m, frame->side_m * (frame->cols < 20 ? frame->cols : 20));
        places[i][1] = coordinate(frame->north_m, frame->side_m * (frame->rows < 20 ? frame->rows : 20));
    }
    expect(lmr_heights(ground, (const double (*)[2])places, heights, ASKED) == 1, "heights");
    double last = 0;
    for (int i = 0; i < ASKED; i++) {
        double height = 0;
        lmr_sample sample;
        int found = lmr_height(ground, places[i][0], places[i][1], &height);
        expect(found ? height == heights[i] && fabs(height) <= 16777216.01 : isnan(heights[i]), "one height as many");
        expect(lmr_sample_at(ground, places[i][0], places[i][1], &sample) == found, "a sample where there is a height");
        if (found) {
            const double *n = sample.normal;
            double length = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
            expect(sample.height_m == height && fabs(length - 1) < 1e-6 && 0 <= n[2], "a unit vector up");
            last = height;
        }
        ask_below(ground, places[i], found, height);
        ask_sight(ground, frame, last);
    }
}

static void draw_lines(const lmr_ground *ground, const lmr_frame *frame, size_t module) {
    size_t count = lmr_line_count(ground, module);
    lmr_line line;
    expect(!lmr_line_at(ground, module, count, &line) && !lmr_line_at(ground, module, SIZE_MAX, &line), "no such line");
    for (size_t i = 0; i < count; i++) {
        expect(lmr_line_at(ground, module, i, &line) == 1 && 2 <= line.vertex_count, "every line");
        expect(line.class_of_way != LMR_HOLE_CLASS && line.kind <= LMR_BREAKLINE && line.form <= LMR_BENCH, "a line");
        expect(line.storey <= LMR_IN_TUNNEL && line.is_kept <= 1 && line.is_in_ground <= line.is_kept, "flags");
        for (size_t v = 0; v < line.vertex_count; v++) {
            expect(line.vertices[v].x <= frame->side_m * 128 && line.vertices[v].y <= frame->side_m * 128, "inside");
        }
    }
}

static void draw_objects(const lmr_ground *ground, const lmr_frame *frame, size_t module) {
    const double side = frame->side_m * 128;
    size_t count = lmr_prism_count(ground, module), corners = 0;
    lmr_prism prism;
    lmr_canopy canopy;
    expect(!lmr_prism_at(ground, module, count, &prism) && !lmr_prism_at(ground, module, SIZE_MAX, &prism), "none");
    for (size_t i = 0; i < count; i++) {
        expect(lmr_prism_at(ground, module, i, &prism) == 1 && prism.kind <= LMR_WALL, "every prism");
        expect(prism.base < prism.roof && 1 <= prism.ring_count, "it has a height and a plan");
        expect(!lmr_ring_at(ground, module, i, prism.ring_count, &corners), "no ring behind the last");
        for (size_t r = 0; r < prism.ring_count; r++) {
            const lmr_corner *ring = lmr_ring_at(ground, module, i, r, &corners);
            expect(ring && 3 <= corners, "every ring");
            for (size_t c = 0; c < corners; c++) {
                expect(ring[c].x <= side && ring[c].y <= side && ring[c].has_wall <= 1, "inside");
            }
        }
    }
    count = lmr_canopy_count(ground, module);
    expect(!lmr_canopy_at(ground, module, count, &canopy) && !lmr_canopy_at(ground, SIZE_MAX, 0, &canopy), "none");
    for (size_t i = 0; i < count; i++) {
        expect(lmr_canopy_at(ground, module, i, &canopy) == 1 && LMR_WOOD <= canopy.kind, "every canopy");
        expect(canopy.kind <= LMR_TREE_ROW && canopy.height && canopy.spacing && canopy.fullness < 100, "what it is");
        for (size_t v = 0; v < canopy.place_count; v++) {
            expect(canopy.places[v][0] <= side && canopy.places[v][1] <= side, "inside");
        }
        for (size_t t = 0; t < 3 * canopy.triangle_count; t++) {
            expect(canopy.triangles[t / 3][t % 3] < canopy.place_count, "an index of a place");
        }
    }
}

static void draw_modules(const lmr_ground *ground, const lmr_frame *frame) {
    size_t count = lmr_module_count(ground);
    lmr_module module;
    expect(!lmr_module_at(ground, count, &module) && !lmr_module_at(ground, SIZE_MAX, &module), "none behind the last");
    volatile uint64_t sum = 0;
    for (size_t i = 0; i < count; i++) {
        expect(lmr_module_at(ground, i, &module) == 1, "every load module");
        expect(module.row < frame->rows && module.col < frame->cols, "inside the area");
        for (size_t v = 0; v < module.vertex_count; v++) {
            expect(module.vertices[v].x <= frame->side_m * 128 && module.vertices[v].y <= frame->side_m * 128, "inside");
            sum += (uint64_t)module.vertices[v].z;
        }
        for (size_t t = 0; t < module.triangle_count; t++) {
            for (int c = 0; c < 3; c++) expect(module.triangles[t][c] < module.vertex_count, "an index of a vertex");
            sum += module.classes[t];
        }
        lmr_decks decks;
        expect(lmr_decks_at(ground, i, &decks) == 1 && !decks.vertices == !decks.triangle_count, "decks or none");
        for (size_t v = 0; v < decks.vertex_count; v++) {
            expect(decks.vertices[v].x <= frame->side_m * 128 && decks.vertices[v].y <= frame->side_m * 128, "inside");
        }
        for (size_t t = 0; t < decks.triangle_count; t++) {
            for (int c = 0; c < 3; c++) expect(decks.triangles[t][c] < decks.vertex_count, "an index of a vertex");
            sum += decks.classes[t];
        }
        draw_lines(ground, frame, i);
        draw_objects(ground, frame, i);
    }
}

/* Every argument that may be missing, missing: nothing is done. */
static void ask_nothing(const lmr_area *area, lmr_ground *ground) {
    char why[16];
    double three[3] = {0, 0, 0}, height = 0, share;
    const double places[1][2] = {{0, 0}};
    lmr_frame frame;
    lmr_sample sample;
    lmr_module module;
    lmr_surface surface;
    lmr_decks decks;
    const double triples[1][3] = {{0, 0, 0}};
    void *odd = (char *)three + 1;
    lmr_close(NULL);
    lmr_unload(NULL);
    expect(!lmr_open(NULL, 0, why, sizeof why) && !lmr_open(NULL, 0, NULL, 5) && !lmr_open("", 9, why, 0), "no area");
    expect(!lmr_describe(NULL, &frame) && !lmr_describe(area, NULL) && !lmr_describe(area, odd), "no frame");
    expect(!lmr_level_count(NULL) && !lmr_module_count(NULL), "none");
    expect(!lmr_load(NULL, 0, 0, 0, why, sizeof why) && !lmr_load(NULL, 0, 0, 0, NULL, sizeof why), "no ground");
    expect(!lmr_load_level(NULL, 0, 0, 0, 0, why, 1) && why[0] == 0, "no ground, and an empty reason");
    expect(!lmr_move(NULL, area, 0, 0, 0, why, sizeof why) && !lmr_move(ground, NULL, 0, 0, 0, NULL, 3), "no move");
    expect(!lmr_height(NULL, 0, 0, &height) && !lmr_height(ground, 0, 0, NULL), "no height");
    expect(!lmr_sample_at(NULL, 0, 0, &sample) && !lmr_sample_at(ground, 0, 0, NULL), "no sample");
    expect(!lmr_height_below(NULL, 0, 0, 0, &height) && !lmr_height_below(ground, 0, 0, 0, NULL), "no height");
    expect(!lmr_surface_below(NULL, 0, 0, 0, &surface) && !lmr_surface_below(ground, 0, 0, 0, NULL), "no surface");
    expect(!lmr_heights_below(NULL, triples, &height, 1) && !lmr_heights_below(ground, NULL, &height, 1), "none");
    expect(!lmr_decks_at(NULL, 0, &decks) && !lmr_decks_at(ground, 0, NULL), "no decks");
    lmr_sighting sighting;
    lmr_top top;
    lmr_obstacle obstacle;
    lmr_prism prism;
    lmr_canopy canopy;
    size_t count;
    expect(lmr_sight_past(NULL, three, three, 2, 0.5, &sighting) == LMR_INVALID, "no sight past objects");
    expect(lmr_sight_past(ground, NULL, three, 2, 0.5, &sighting) == LMR_INVALID, "nor without an end");
    expect(!lmr_top_at(NULL, 0, 0, &top) && !lmr_top_at(ground, 0, 0, NULL), "no top");
    expect(!lmr_obstacle_at(NULL, three, 1, &obstacle) && !lmr_obstacle_at(ground, NULL, 1, &obstacle), "no obstacle");
    expect(!lmr_prism_at(NULL, 0, 0, &prism) && !lmr_prism_at(ground, 0, 0, NULL), "no prism");
    expect(!lmr_ring_at(NULL, 0, 0, 0, &count) && !lmr_ring_at(ground, 0, 0, 0, NULL), "no ring");
    expect(!lmr_canopy_at(NULL, 0, 0, &canopy) && !lmr_canopy_at(ground, 0, 0, NULL), "no canopy");
    lmr_line line;
    expect(!lmr_line_count(NULL, 0) && !lmr_line_count(ground, SIZE_MAX), "no lines");
    expect(!lmr_line_at(NULL, 0, 0, &line) && !lmr_line_at(ground, 0, 0, NULL), "no line");
    expect(!lmr_module_at(NULL, 0, &module) && !lmr_module_at(ground, 0, NULL), "no load module");
    expect(!lmr_heights(NULL, places, &height, 1) && !lmr_heights(ground, NULL, &height, 1), "no heights");
    if (ground) {
        expect(!lmr_heights(ground, places, NULL, 1) && !lmr_heights(ground, places, &height, SIZE_MAX), "no room");
        expect(lmr_heights(ground, NULL, NULL, 0) == 1, "no heights wanted");
        expect(!lmr_heights_below(ground, triples, NULL, 1) && !lmr_heights_below(ground, triples, &height, SIZE_MAX),
               "no room");
        expect(lmr_heights_below(ground, NULL, NULL, 0) == 1, "no heights wanted");
        expect(lmr_sight(ground, NULL, three, &share) == LMR_INVALID, "no eye");
        expect(lmr_sight(ground, three, NULL, &share) == LMR_INVALID, "no target");
    }
    expect(lmr_sight(NULL, three, three, &share) == LMR_INVALID, "no ground");
}

static uint32_t odd_reach(void) { return below(2) ? (uint32_t)below(9) : below(2) ? LMR_ALL : (uint32_t)odd_number(0); }

static void ask_area(const lmr_area *area, const lmr_area *other) {
    char why[300];
    lmr_frame frame;
    opened_count++;
    expect(lmr_describe(area, &frame) == 1 && frame.rows && frame.cols && 0 < frame.side_m, "a frame");
    expect(isfinite(frame.east_m) && isfinite(frame.north_m), "a corner");
    uint32_t levels = lmr_level_count(area);
    expect(1 <= levels && levels <= 8, "levels");
    uint32_t level = below(4) ? (uint32_t)below(levels) : (uint32_t)odd_number(levels);
    double wide = frame.side_m * frame.cols, high = frame.side_m * frame.rows;
    lmr_ground *ground = lmr_load_level(area, coordinate(frame.east_m, wide), coordinate(frame.north_m, high),
                                        odd_reach(), level, why, below(4) ? sizeof why : (size_t)below(20));
    if (below(2) || !ground) {
        lmr_unload(ground);
        ground = lmr_load(area, frame.east_m, frame.north_m, below(2) ? LMR_ALL : 3, why, sizeof why);
    }
    ask_nothing(area, ground);
    for (int moves = 0; ground && moves < 4; moves++) {
        loaded_count += lmr_module_count(ground);
        ask_places(ground, &frame);
        draw_modules(ground, &frame);
        size_t before = lmr_module_count(ground);
        if (!lmr_move(ground, other && below(4) == 0 ? other : area, coordinate(frame.east_m, wide),
                      coordinate(frame.north_m, high), odd_reach(), why, sizeof why)) {
            expect(lmr_module_count(ground) == before && 0 < strlen(why), "the ground as it was, and a reason");
        }
    }
    lmr_unload(ground);
}

/* ---- Files. */

static void write_file(const char *path, const unsigned char *bytes, size_t length) {
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(bytes, 1, length, file) != length || fclose(file)) {
        perror(path);
        exit(2);
    }
}

static int by_name(const void *a, const void *b) { return strcmp(((const Seed *)a)->name, ((const Seed *)b)->name); }

static void read_seeds(const char *folder) {
    DIR *dir = opendir(folder);
    if (!dir) {
        perror(folder);
        exit(2);
    }
    for (struct dirent *entry; (entry = readdir(dir)) && seed_count < SEEDS_MAX;) {
        char path[1024];
        struct stat stat_of;
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (!strstr(entry->d_name, ".slm") || stat(path, &stat_of) || FILE_BYTES / 2 < stat_of.st_size) continue;
        Seed *seed = &seeds[seed_count++];
        snprintf(seed->name, sizeof seed->name, "%s", entry->d_name);
        seed->length = (size_t)stat_of.st_size;
        seed->bytes = malloc(seed->length + 1);
        FILE *file = fopen(path, "rb");
        if (!seed->bytes || !file || fread(seed->bytes, 1, seed->length, file) != seed->length) exit(2);
        fclose(file);
    }
    closedir(dir);
    qsort(seeds, seed_count, sizeof *seeds, by_name);
    if (!seed_count) {
        fprintf(stderr, "%s: found no .slm files\n", folder);
        exit(2);
    }
}

static lmr_area *open_work(void) {
    char why[300];
    lmr_area *area = lmr_open(work, (int)below(3), why, sizeof why);
    expect(area || strlen(why), "an area or a reason");
    return area;
}

static void ask_work(void) {
    lmr_area *area = open_work();
    lmr_area *other = area && below(4) == 0 ? open_work() : NULL;
    if (area) ask_area(area, other);
    else ask_nothing(NULL, NULL);
    lmr_close(other);
    lmr_close(area);
}

/* The place of a file of a round; those that a round does not need are removed. */
static void path_of(char *path, size_t size, int place) { snprintf(path, size, "%s/modules/%d.slm", work, place); }

static void run_round(unsigned long long number) {
    static unsigned char file[FILE_BYTES + 16];
    state = number * 0x2545f4914f6cdd1du + 1;
    int files = below(4) ? 1 : 1 + (int)below(FILES_MAX);
    size_t base = (size_t)below(seed_count);
    for (int place = 0; place < FILES_MAX; place++) {
        char path[1024];
        path_of(path, sizeof path, place);
        if (files <= place) {
            remove(path);
            continue;
        }
        const Seed *seed = &seeds[place && below(4) == 0 ? below(seed_count) : (base + (size_t)place) % seed_count];
        memcpy(file, seed->bytes, seed->length);
        write_file(path, file, damage(file, seed->length));
    }
    alarm(ROUND_SECONDS);
    ask_work();
    alarm(0);
}

static void replay(void) {
    for (size_t i = 0; i < seed_count; i++) {
        char path[1024];
        for (int place = 0; place < FILES_MAX; place++) {
            path_of(path, sizeof path, place);
            remove(path);
        }
        path_of(path, sizeof path, 0);
        write_file(path, seeds[i].bytes, seeds[i].length);
        for (round_now = 0; round_now < 40; round_now++) {
            state = round_now;
            alarm(ROUND_SECONDS);
            ask_work();
            alarm(0);
        }
    }
    printf("%zu files asked, %llu opened, %llu load modules\n", seed_count, opened_count, loaded_count);
}

int main(int argc, char **argv) {
    if (argc != 3 && argc != 5 && argc != 6) return 2;
    signal(SIGALRM, ended);
    signal(SIGABRT, ended);
#if defined(__SANITIZE_ADDRESS__)
    __asan_set_death_callback(say_round);
#endif
    work = argv[2];
    char modules[1024];
    snprintf(modules, sizeof modules, "%s/modules", work);
    mkdir(work, 0777);
    mkdir(modules, 0777);
    read_seeds(argv[1]);
    if (argc == 3) {
        replay();
        return 0;
    }
    unsigned long long first = strtoull(argv[3], NULL, 10);
    unsigned long long last = argc == 6 ? strtoull(argv[5], NULL, 10) : UINT64_MAX;
    time_t end = time(NULL) + (time_t)strtoll(argv[4], NULL, 10);
    for (round_now = first; round_now <= last && time(NULL) < end; round_now++) run_round(round_now);
    printf("%llu rounds from %llu: %llu times opened, %llu load modules asked\n", round_now - first, first,
           opened_count, loaded_count);
    return 0;
}
