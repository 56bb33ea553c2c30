/* The training data: materials, their noise beside its naive twin, the camera. On one thread, as a loader's
 * thread and one photograph are. */
#include "bench/bench.h"
#include "data/camera.h"
#include "data/materials/procedural.h"
#include "tensor/kernels/noise.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 256, PIXELS = SIDE * SIDE };

typedef struct subject {
    io_procedural procedural;
    io_camera camera;
    uint64_t next;
    int size;
    float *maps, *image;
    const struct ts_noise_kernels *noise;
} subject;

/* One material of each family. */
static void families(void *user)
{
    subject *s = user;
    io_material m = {.size = s->size, .maps = s->maps};
    for (int f = 0; f < io_family_count(); f++) {
        s->procedural.families = UINT64_C(1) << f;
        io_procedural_make(&s->procedural, s->next++, &m);
    }
}

static void octave(void *user)
{
    subject *s = user;
    s->noise->octave(PIXELS, s->maps, s->maps + PIXELS, 8, 1, 2, 3, false, 0.5f, s->image);
}

static void cell(void *user)
{
    subject *s = user;
    s->noise->cell(PIXELS, s->maps, s->maps + PIXELS, (ts_noise_cells){8, 1, 0, 3}, s->image, s->image + PIXELS, NULL,
                   NULL, NULL);
}

static void photograph(void *user)
{
    subject *s = user;
    memcpy(s->image, s->maps, (size_t)s->size * (size_t)s->size * 3 * sizeof *s->image);
    io_camera_apply(&s->camera, 1, s->next++, s->size, s->image);
}

BENCH(data)
{
    subject s = {.procedural = {.seed = 1},
                 .maps = malloc(PIXELS * MAP_CHANNELS * sizeof(float)),
                 .image = calloc(PIXELS * 3, sizeof(float))};
    bench_heading("Materials and photographs, one thread");
    for (s.size = 64; s.maps && s.image && s.size <= SIDE; s.size *= 2) {
        char label[64];
        bench_time t = bench_measure(families, &s);
        snprintf(label, sizeof label, "material %d^2, mean of the families", s.size);
        t.seconds /= io_family_count();
        bench_row_unit(label, t, 1 / t.seconds, "materials/s");
    }
    for (int i = 0; s.maps && s.image && i < 2; i++) {
        for (int k = 0; k < 2 * PIXELS; k++) s.maps[k] = (float)(k < PIXELS ? k % SIDE : (k - PIXELS) / SIDE) / SIDE;
        s.noise = i ? &ts_noise_naive : ts_noise_k();
        bench_time t = bench_measure(octave, &s);
        bench_row_unit(i ? "an octave of noise 256^2, naive twin" : "an octave of noise 256^2", t,
                       PIXELS / t.seconds * 1e-6, "Mpixel/s");
        t = bench_measure(cell, &s);
        bench_row_unit(i ? "cells 256^2, naive twin" : "cells 256^2", t, PIXELS / t.seconds * 1e-6, "Mpixel/s");
    }
    s.camera = (io_camera){.noise = 0.3f,
                           .noise_spread = 1,
                           .blur = 0.7f,
                           .quantise = true,
                           .exposure = 0.1f,
                           .vignette = 0.1f,
                           .jpeg = 75};
    s.size = SIDE;
    if (s.maps && s.image) {
        for (int k = 0; k < 3 * PIXELS; k++) s.maps[k] = (float)(k % 255) / 200;
        bench_time t = bench_measure(photograph, &s);
        bench_row_unit("camera 256^2", t, 1 / t.seconds, "photographs/s");
        s.camera.tone = s.camera.sharpen = 1;
        t = bench_measure(photograph, &s);
        bench_row_unit("camera 256^2, tone curve and sharpening", t, 1 / t.seconds, "photographs/s");
    }
    free(s.maps);
    free(s.image);
}
