/* What a family paints on: a height field in patch widths and the reflectance of every pixel, with tools that all
 * families share. */
#ifndef IO_CANVAS_H
#define IO_CANVAS_H
#include "data/materials/noise.h"
#include "tensor/rng.h"
#include <stdbool.h>
#include <stddef.h>

enum { CANVAS_PLANES = 32 }; /* scratch planes that one family may hold at a time */

typedef float io_rgb[3];

/* A uniform substance: diffuse albedo, specular F0 (linear), perceptual roughness. */
typedef struct io_substance {
    io_rgb diffuse, specular;
    float roughness;
} io_substance;

typedef struct io_canvas {
    int size, count; /* count = size * size */
    float width;     /* a patch width in pixels: size, or more where only a part of the patch is seen */
    float pixel;     /* 1 / width, in patch widths */
    ts_rng rng;
    float *x, *y;  /* pixel centres in patch widths, x right and y up, in [-1/2, 1/2] */
    float *height; /* patch widths */
    float *diffuse[3], *specular[3], *roughness;
    float *planes; /* scratch */
    int used;
} io_canvas;

/* Floats of memory for a canvas with its scratch, and with only the eight painted planes. */
enum { CANVAS_PAINTED = 8, CANVAS_ALL = 2 + CANVAS_PAINTED + CANVAS_PLANES };

/* The whole patch is seen, or of its sides 1 / closer around (x, y), as far as that lies in the patch; sets width and
 * pixel and fills x and y. */
void cv_view(io_canvas *c, float closer, float x, float y);
/* The column or row that (x, y) lies in, the nearest one of what lies beside. */
int cv_column(const io_canvas *c, float x);
int cv_row(const io_canvas *c, float y);

float *cv_plane(io_canvas *c);        /* the next scratch plane, contents undefined; cv_drop gives the last ones back */
void cv_drop(io_canvas *c, int mark); /* mark = an earlier c->used */

/* What draws from c->rng: these, and every function below and in palette.h and weathering.h that calls them. C leaves
 * open in which order operands, arguments and initialisers are evaluated, so no two of them may draw: name the numbers
 * first. (&&, || and ?: have an order.) */
uint32_t cv_seed(io_canvas *c);
float cv_range(io_canvas *c, float lo, float hi);
float cv_log_range(io_canvas *c, float lo, float hi); /* uniform in the logarithm */
bool cv_chance(io_canvas *c, float p);

/* The patch seen scale times (in u; scale / stretch in v), turned by turns * 360 degrees and moved at random. Two
 * planes. */
nz_frame cv_frame(io_canvas *c, float scale, float stretch, float turns);
/* The same frame, bent by smooth noise of the given frequency (in frame units) and largest displacement. Two planes. */
nz_frame cv_bend(io_canvas *c, nz_frame f, float frequency, int octaves, float amount);
/* Noise into a new plane. */
float *cv_noise(io_canvas *c, nz_frame f, nz_kind kind, float frequency, int octaves, float gain);
/* Planes for a cell pattern. */
nz_cells cv_cells(io_canvas *c);

/* In place: 0 where plane is below edge - width, 1 above edge + width, smooth between; width is at least 1e-5. */
void cv_threshold(io_canvas *c, float *plane, float edge, float width);
/* The value that coverage (0 .. 1) of a plane with mean 0 and standard deviation 1 lies above. */
float cv_level(float coverage);

void cv_fill(io_canvas *c, const io_substance *s);
/* Every painted value but the height goes to s where mask is 1. */
void cv_cover(io_canvas *c, const float *mask, float amount, const io_substance *s);
/* Diffuse colour alone goes to the colour; metals keep theirs. */
void cv_tint(io_canvas *c, const float *mask, float amount, const io_rgb colour);
/* Diffuse and specular colours times (1 + amount * plane), at least a tenth; specular of dielectrics is left alone. */
void cv_shade(io_canvas *c, const float *plane, float amount);
/* roughness += amount * plane. */
void cv_roughen(io_canvas *c, const float *plane, float amount);
/* height += amount * plane. */
void cv_raise(io_canvas *c, const float *plane, float amount);

/* How deep every pixel lies below its surroundings (a Gaussian of sigma radius, in patch widths), about -1 .. 1 (deep).
 * A new plane. */
float *cv_cavity(io_canvas *c, float radius);

/* The canvas as maps (tensor/maps.h): heights give normals by central differences. */
void cv_write(const io_canvas *c, float *maps);
#endif
