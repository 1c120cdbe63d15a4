/*
 * Reads the load modules of a terrain database, and answers what a simulator asks of the ground.
 *
 * Link with libload_module_reader_c.a (cargo build --release -p load-module-reader-c) and, on Linux,
 * with -lpthread -ldl -lm.
 *
 *     char why[256];
 *     lmr_area *area = lmr_open("ntc.tdb", LMR_MAPPED, why, sizeof why);
 *     if (!area) { fprintf(stderr, "%s\n", why); exit(2); }
 *     lmr_ground *ground = lmr_load(area, east, north, 7, why, sizeof why);
 *     for (;;) {
 *         double height;
 *         lmr_move(ground, area, east, north, 7, why, sizeof why);
 *         if (lmr_height(ground, east, north, &height)) drive(height);
 *     }
 *     lmr_unload(ground);
 *     lmr_close(area);
 *
 * Places are eastings and northings in metres of the area's coordinate system; heights are metres above its
 * vertical datum. Functions that only ask may be called for one ground from many threads at once.
 * Files are checked when they are read: no file, however damaged, makes a function do harm, wait for ever, or take
 * memory for more than the files hold. Only with LMR_MAPPED, a file that another program makes shorter while it is
 * mapped ends this one (SIGBUS).
 * Any number may be given as a coordinate, infinite ones and NaN too: where there cannot be ground, nothing is loaded.
 * A pointer that is NULL (or not aligned as its type asks) is never followed. `why` and `share` may be NULL; without
 * any other argument that it needs, a function does nothing and answers as on failure: NULL, 0 or LMR_INVALID, with
 * the reason in `why` where it has one. lmr_close and lmr_unload take NULL and do nothing.
 */
#ifndef LOAD_MODULE_READER_H
#define LOAD_MODULE_READER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A database that is open. */
typedef struct lmr_area lmr_area;
/* Load modules that are loaded. */
typedef struct lmr_ground lmr_ground;

/* Where the bytes of files are kept while an area is open. */
enum { LMR_ON_DISK = 0, LMR_IN_MEMORY = 1, LMR_MAPPED = 2 };

/* The class of triangles over a hole: no source has a height there, and their heights only close the surface. */
#define LMR_HOLE_CLASS 255

/* For `reach`: the whole area. */
#define LMR_ALL UINT32_MAX

typedef struct {
    uint32_t rows, cols;     /* of load modules */
    double side_m;           /* of a load module */
    double east_m, north_m;  /* south-west corner of the area */
} lmr_frame;

typedef struct {
    double height_m;
    double normal[3];        /* unit vector out of the ground: east, north, up */
    uint8_t class_of_ground; /* 0 is the default, LMR_HOLE_CLASS a hole */
} lmr_sample;

/* The ground or a deck. */
typedef struct {
    double height_m;
    double normal[3];         /* unit vector upwards out of it: east, north, up */
    uint8_t class_of_surface; /* 0 is the default, LMR_HOLE_CLASS a hole in the ground */
    uint8_t is_deck;          /* 1 on a deck, 0 on the ground */
} lmr_surface;

/* Quanta of 1/128 m: x and y from the load module's south-west corner, z above the vertical datum. */
typedef struct {
    uint16_t x, y;
    int32_t z;
} lmr_vertex;

/* A load module for drawing. What it points to lives until the ground is moved or unloaded. */
typedef struct {
    uint32_t row, col;
    double east_m, north_m;           /* of its south-west corner */
    const lmr_vertex *vertices;
    size_t vertex_count;
    const uint16_t (*triangles)[3];   /* counter-clockwise seen from above */
    const uint8_t *classes;           /* one for each triangle */
    size_t triangle_count;
} lmr_module;

/* The decks above the ground of a load module, for drawing: triangles as those of the ground, but they cover only some
 * of the square, and may lie above each other. Without decks both counts are 0 and the lists NULL. What is pointed to
 * lives until the ground is moved or unloaded. */
typedef struct {
    const lmr_vertex *vertices;
    size_t vertex_count;
    const uint16_t (*triangles)[3];   /* counter-clockwise seen from above */
    const uint8_t *classes;           /* one for each triangle */
    size_t triangle_count;
} lmr_decks;

/* What a line is the middle of, what it is in the ground, and where it runs. */
enum { LMR_TRAVELLED = 0, LMR_CHANNEL = 1, LMR_BREAKLINE = 2 };
enum { LMR_NOTHING = 0, LMR_LINE = 1, LMR_STRIP = 2, LMR_BENCH = 3 };
enum { LMR_ON_GROUND = 0, LMR_ON_BRIDGE = 1, LMR_IN_TUNNEL = 2 };

/* The middle line of a road, a rail, a river or a stream in the square of a load module, or of a part of it in which
 * nothing changes. A way that goes on in the next load module has the same vertex there. Ways that the budget left out
 * of the ground are there too: is_kept is 0. Only the finest level has lines. What is pointed to lives until the ground
 * is moved or unloaded. */
typedef struct {
    const lmr_vertex *vertices;       /* 2 or more; z is the height decided for the way */
    size_t vertex_count;
    uint16_t width;                   /* of the way in quanta of 1/128 m; 0 for a line without any */
    uint8_t class_of_way;
    uint8_t kind;                     /* LMR_TRAVELLED, LMR_CHANNEL (runs downstream), LMR_BREAKLINE */
    uint8_t form;                     /* LMR_NOTHING to LMR_BENCH */
    uint8_t storey;                   /* LMR_ON_GROUND, LMR_ON_BRIDGE, LMR_IN_TUNNEL */
    uint8_t is_kept;                  /* 0 where the way is left out */
    uint8_t is_in_ground;             /* 1 where triangles of the ground have its edges */
} lmr_line;

/* What an object is: prisms, then canopies. */
enum {
    LMR_BUILDING = 0, LMR_TOWER = 1, LMR_WALL = 2,
    LMR_WOOD = 3, LMR_SCRUB = 4, LMR_ORCHARD = 5, LMR_TREE_ROW = 6
};

/* A building, tower or stretch of wall in the square of a load module: a level roof and upright walls. Pieces of one
 * object in several load modules have the same id. */
typedef struct {
    uint64_t id;
    int32_t base, roof;               /* quanta of 1/128 m above the vertical datum */
    uint8_t kind;                     /* LMR_BUILDING, LMR_TOWER, LMR_WALL */
    size_t ring_count;                /* the roofline counter-clockwise, then courtyards clockwise */
} lmr_prism;

/* A corner of a ring, in quanta from the load module's south-west corner. */
typedef struct {
    uint16_t x, y;
    uint8_t has_wall;                 /* 0 where the object goes on in the next load module up to the next corner */
} lmr_corner;

/* Leaves over the ground: their top follows the ground. What is pointed to lives until the ground is moved or unloaded.
 */
typedef struct {
    uint64_t id;
    const uint16_t (*places)[2];      /* quanta from the load module's south-west corner */
    size_t place_count;
    const uint16_t (*triangles)[3];   /* of the plan, counter-clockwise: indices into places */
    size_t triangle_count;
    uint16_t height;                  /* quanta above the ground right below */
    uint16_t spacing;                 /* quanta between stems */
    uint8_t kind;                     /* LMR_WOOD, LMR_SCRUB, LMR_ORCHARD, LMR_TREE_ROW */
    uint8_t fullness;                 /* per cent of the light that 10 m of it take away */
} lmr_canopy;

/* Which objects lmr_sight_past looks at, and what hides. */
enum { LMR_NO_OBJECTS = 0, LMR_BUILDINGS = 1, LMR_ALL_OBJECTS = 2 };
enum { LMR_BY_GROUND = 1, LMR_BY_DECK = 2, LMR_BY_BUILDING = 3, LMR_BY_WOOD = 4, LMR_BY_ROW = 5,
    LMR_BY_WALL = 6 };

typedef struct {
    double share;                     /* how far along the line is hidden; 1 where it is not */
    double transmission;              /* the share of light that woods leave */
    double wood_m;                    /* metres inside woods */
    uint8_t hidden_by;                /* 0, or LMR_BY_GROUND to LMR_BY_WALL */
} lmr_sighting;

typedef struct {
    double height_m;
    uint8_t of;                       /* LMR_BY_GROUND to LMR_BY_WALL */
} lmr_top;

/* What stands in a vehicle's way. */
typedef struct {
    uint64_t id;
    double distance_m;                /* to its plan; 0 inside */
    double spacing_m;                 /* between stems; 0 of what cannot be passed */
    uint8_t kind;                     /* LMR_BUILDING to LMR_TREE_ROW */
} lmr_obstacle;

/* What lmr_sight answers. */
enum { LMR_FREE = 0, LMR_HIDDEN = 1, LMR_UNKNOWN = 2, LMR_INVALID = 3 };

/* Opens a database, or a folder of load-module files. NULL on failure, with the reason in `why` (cut to fit). */
lmr_area *lmr_open(const char *dir, int keep, char *why, size_t why_size);
void lmr_close(lmr_area *area);
/* 1, or 0 without area or frame. */
int lmr_describe(const lmr_area *area, lmr_frame *frame);
/* Levels of detail of every load module, 1 or more: 0 is the finest, the last one the coarsest. 0 without area. */
uint32_t lmr_level_count(const lmr_area *area);

/* Loads the 2 * reach + 1 load modules a side around a place, less what lies beyond the area. NULL on failure. */
lmr_ground *lmr_load(const lmr_area *area, double east_m, double north_m, uint32_t reach, char *why, size_t why_size);
/* The same at another level of detail. */
lmr_ground *lmr_load_level(const lmr_area *area, double east_m, double north_m, uint32_t reach, uint32_t level,
                           char *why, size_t why_size);
/* The same level around another place of the same area: only what is new is read. 1, or 0 on failure; then the ground
 * is as it was. */
int lmr_move(lmr_ground *ground, const lmr_area *area, double east_m, double north_m, uint32_t reach,
             char *why, size_t why_size);
void lmr_unload(lmr_ground *ground);

/* Of the ground, whatever decks hang above it.
 * 1, or 0 where nothing is loaded, without ground or without a place to write to; then nothing is written. */
int lmr_height(const lmr_ground *ground, double east_m, double north_m, double *height_m);
int lmr_sample_at(const lmr_ground *ground, double east_m, double north_m, lmr_sample *sample);
/* Many heights at once; NaN where nothing is loaded. 1, or 0 without ground, or without lists although count is not 0.
 * The lists must not overlap. */
int lmr_heights(const lmr_ground *ground, const double (*places_m)[2], double *heights_m, size_t count);
/* Of the topmost of ground and decks (bridges) that is not above ceiling_m, metres above the vertical datum. With the
 * height of a vehicle's wheels and a step it is what the vehicle drives on, over a bridge or under it; with INFINITY,
 * what lies on top. Where a deck touches the ground it is the deck.
 * 1, or 0 where nothing is loaded, where all is above ceiling_m or that is NaN, without ground or without a place to
 * write to; then nothing is written. */
int lmr_height_below(const lmr_ground *ground, double east_m, double north_m, double ceiling_m, double *height_m);
int lmr_surface_below(const lmr_ground *ground, double east_m, double north_m, double ceiling_m, lmr_surface *surface);
/* Many at once, each at an easting, a northing and a ceiling; NaN where lmr_height_below answers 0. 1 or 0 as
 * lmr_heights. */
int lmr_heights_below(const lmr_ground *ground, const double (*places_m)[3], double *heights_m, size_t count);
/* Whether the ground or a deck stands between two places (east, north, height). A line passes over and under decks, and
 * is hidden where it goes through one; a place at the height of a deck stands on it, and is not seen from below.
 * LMR_HIDDEN sets `share`: how far along.
 * LMR_UNKNOWN: the line leaves what is loaded first, or a coordinate is not finite or beyond any ground (1e12 m from
 * the area's corner). LMR_INVALID: ground, from_m or to_m is NULL. */
int lmr_sight(const lmr_ground *ground, const double from_m[3], const double to_m[3], double *share);

/* The same past buildings, walls and woods. A line is hidden where it goes through a wall or a roof, at its beginning
 * where that lies inside one, and in a wood where less of the light than `least` (over 0 up to 1, usually 0.5) is left.
 * LMR_INVALID also where objects or least are something else. `sighting` may be NULL. */
int lmr_sight_past(const lmr_ground *ground, const double from_m[3], const double to_m[3], int objects, double least,
                   lmr_sighting *sighting);
/* The highest of the ground, decks, roofs and tops of woods over a place. 1 or 0 as lmr_height. */
int lmr_top_at(const lmr_ground *ground, double east_m, double north_m, lmr_top *top);
/* What a vehicle hits that stands at a place (east, north, height of its wheels) and reaches radius_m around it: the
 * nearest building, tower or wall between 0.3 and 3 m above its wheels, else what has the densest stems. 1, or 0 where
 * its way is free, nothing is loaded, without ground or without a place to write to. */
int lmr_obstacle_at(const lmr_ground *ground, const double place_m[3], double radius_m, lmr_obstacle *obstacle);

/* Load modules that are loaded, row by row from the south-west. 0 without ground. */
size_t lmr_module_count(const lmr_ground *ground);
/* 1, or 0 when there is no such one, without ground or without a place to write to. */
int lmr_module_at(const lmr_ground *ground, size_t index, lmr_module *module);
int lmr_decks_at(const lmr_ground *ground, size_t index, lmr_decks *decks);
/* Lines of a load module. 0 when there is no such one, or without ground. */
size_t lmr_line_count(const lmr_ground *ground, size_t index);
/* One of them: 1, or 0 when there is no such one, without ground or without a place to write to. */
int lmr_line_at(const lmr_ground *ground, size_t index, size_t line, lmr_line *out);
/* Buildings, towers and walls of a load module. 0 when there is no such one, or without ground. */
size_t lmr_prism_count(const lmr_ground *ground, size_t index);
/* One of them: 1, or 0 when there is no such one, without ground or without a place to write to. */
int lmr_prism_at(const lmr_ground *ground, size_t index, size_t prism, lmr_prism *out);
/* The corners of one ring of it, as many as corner_count is set to; NULL when there is no such one, without ground or
 * without a place to write to. They live until the ground is moved or unloaded. */
const lmr_corner *lmr_ring_at(const lmr_ground *ground, size_t index, size_t prism, size_t ring, size_t *corner_count);
/* Woods, scrub, orchards and rows of a load module, and one of them, as above. */
size_t lmr_canopy_count(const lmr_ground *ground, size_t index);
int lmr_canopy_at(const lmr_ground *ground, size_t index, size_t canopy, lmr_canopy *out);

#ifdef __cplusplus
}
#endif

#endif
