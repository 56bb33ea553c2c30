/* The training batches of a configuration as bytes, for a peer that trains on the same ones
 * (bench/curve_torch.py). */
#include "bench/batches.h"
#include "render/losses.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "train/state.h"
#include <stdlib.h>

static bool put(const float *from, size_t count) { return fwrite(from, sizeof *from, count, stdout) == count; }

static bool put_views(const rd_view *views, int count)
{
    for (int i = 0; i < count; i++)
        if (!put(views[i].light, 3) || !put(views[i].camera, 3)) return false;
    return true;
}

ts_code bench_batches(const char *path, ts_status *st)
{
    tr_config c = tr_config_default();
    if (tr_config_read(&c, path, st) || tr_config_check(&c, st)) return st->code;
    if (c.arch.images > 1 || c.train.window)
        return ts_fail(st, TS_INVALID,
                       "%s: a peer takes one photograph of whole patches (model.images 1, train.window 0)", path);
    const int batch = c.train.batch, patch = c.data.patch;
    const size_t pixels = (size_t)batch * (size_t)patch * (size_t)patch;
    const io_procedural source = tr_materials_of(&c);
    float *images = malloc(pixels * 3 * sizeof *images);
    rd_view *views = malloc((size_t)batch * RD_LOSS_VIEWS * sizeof *views),
            *captures = malloc((size_t)batch * sizeof *captures);
    io_loader *loader = io_loader_create(&source, patch, (io_share){batch, 0, batch}, 0, c.data.prefetch,
                                         c.data.threads, st);
    if (!st->code && (!images || !views || !captures)) ts_fail(st, TS_NOMEM, "no memory for %d photographs", batch);
    for (int64_t step = 0; step < c.train.steps && !st->code; step++) {
        const float *maps = io_loader_next(loader, st);
        if (!maps) break;
        const uint64_t index = (uint64_t)step * (uint64_t)batch;
        tr_capture_views(c.data.sheet, (uint64_t)c.data.seed, index, batch, 1, captures);
        tr_photographs(&c, (uint64_t)c.data.seed, index, batch, patch, maps, captures, 1, images, NULL);
        ts_rng rng = ts_rng_make((uint64_t)c.train.seed, TS_STREAM_SCENE, (uint64_t)step);
        for (int i = 0; i < batch; i++) rd_loss_views(&rng, views + i * RD_LOSS_VIEWS);
        if (!put(images, pixels * 3) || !put(maps, pixels * MAP_CHANNELS) || !put_views(views, batch * RD_LOSS_VIEWS))
            ts_fail(st, TS_IO, "standard output: cannot write");
    }
    io_loader_destroy(&loader);
    free(images), free(views), free(captures);
    return st->code;
}
