#include "data/materials/homogeneous.h"
#include <math.h>

enum { MODES = 4 };   /* of half a period each, along x and y */
#define MOST 0.4      /* deviation of a logarithm that is one material's */
#define DARKEST 1e-3f /* whose logarithm is taken */
#define PI 3.14159265358979323846f

typedef struct basis {
    float *wave[MODES]; /* [size]: orthonormal over a row's pixel centres */
} basis;

static basis make_basis(io_canvas *c)
{
    basis b;
    float *plane = cv_plane(c);
    const float pixel = 1.0f / (float)c->size; /* of what is seen, which may be a part of the patch */
    for (int k = 0; k < MODES; k++) {
        b.wave[k] = plane + k * c->size;
        const float scale = sqrtf((k ? 2.0f : 1.0f) / (float)c->size);
        for (int i = 0; i < c->size; i++) b.wave[k][i] = scale * cosf(PI * (float)k * ((float)i + 0.5f) * pixel);
    }
    return b;
}

/* The part of a plane's logarithm that is made of the waves, but for its mean. */
static void slow_part(const io_canvas *c, const basis *b, const float *logarithm, float *slow)
{
    double sum[MODES][MODES] = {{0}};
    const int size = c->size;
    for (int y = 0; y < size; y++)
        for (int k = 0; k < MODES; k++) {
            double row = 0;
            for (int x = 0; x < size; x++) row += (double)(logarithm[y * size + x] * b->wave[k][x]);
            for (int l = 0; l < MODES; l++) sum[l][k] += row * (double)b->wave[l][y];
        }
    sum[0][0] = 0;
    for (int y = 0; y < size; y++) {
        float row[MODES];
        for (int k = 0; k < MODES; k++) {
            double at = 0;
            for (int l = 0; l < MODES; l++) at += sum[l][k] * (double)b->wave[l][y];
            row[k] = (float)at;
        }
        for (int x = 0; x < size; x++) {
            float value = 0;
            for (int k = 0; k < MODES; k++) value += row[k] * b->wave[k][x];
            slow[y * size + x] = value;
        }
    }
}

static float *logarithm_of(io_canvas *c, const float *plane)
{
    float *to = cv_plane(c);
    for (int i = 0; i < c->count; i++) to[i] = logf(nz_max(plane[i], DARKEST));
    return to;
}

/* Parts of different materials side by side stay: evened out they would be shaded toward each other. */
static bool one_material(const io_canvas *c, const float *logarithm)
{
    double sum = 0, squares = 0;
    for (int i = 0; i < c->count; i++) {
        const double v = (double)logarithm[i];
        sum += v, squares += v * v;
    }
    const double mean = sum / c->count;
    return squares / c->count - mean * mean <= MOST * MOST;
}

static void even_out(const io_canvas *c, const basis *b, float amount, float least, float most, const float *logarithm,
                     float *slow, float *plane)
{
    for (int i = 0; i < c->count; i++) least = nz_min(least, plane[i]), most = nz_max(most, plane[i]);
    slow_part(c, b, logarithm, slow);
    for (int i = 0; i < c->count; i++) plane[i] = nz_clamp(plane[i] * expf(-amount * slow[i]), least, most);
}

void cv_homogeneous(io_canvas *c)
{
    const float amount = cv_range(c, 0.6f, 1);
    if (c->size < MODES) return; /* its waves would not fit a plane */
    const int mark = c->used;
    const basis b = make_basis(c);
    float *slow = cv_plane(c), *colour[3];
    const float *rough = logarithm_of(c, c->roughness);
    for (int k = 0; k < 3; k++) colour[k] = logarithm_of(c, c->diffuse[k]);
    if (one_material(c, colour[0]) && one_material(c, colour[1]) && one_material(c, colour[2]))
        for (int k = 0; k < 3; k++) even_out(c, &b, amount, 0.004f, 0.9f, colour[k], slow, c->diffuse[k]);
    if (one_material(c, rough)) even_out(c, &b, amount, 0.02f, 1, rough, slow, c->roughness);
    cv_drop(c, mark);
}
