/* Kernels of side 1: a matrix product over all pixels, without a window. */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/team.h"

typedef struct run_job {
    const conv_plan *p;
    int chunk, groups; /* pixels; of panels */
} run_job;

static void run_unit(const void *job, int64_t unit)
{
    const run_job *j = job;
    const conv_plan *p = j->p;
    const ptrdiff_t pixels = (ptrdiff_t)p->n * p->h * p->w, first = unit / j->groups * j->chunk,
                    count = pixels - first < j->chunk ? pixels - first : j->chunk;
    int panel0, panel1;
    conv_part(conv_panels(p->oc), j->groups, (int)(unit % j->groups), &panel0, &panel1);
    if (!p->bf16) {
        conv_run_pixels(p, first, count, panel0, panel1);
        return;
    }
    conv_plan now = *p;
    float *x = ts_scratch(0, sizeof(float) * (size_t)j->chunk * (size_t)p->ic);
    conv_put_pixels(p, p->x + first * p->channels, count, x, p->ic);
    now.x = x;
    now.y = p->y + first * p->oc;
    conv_run_pixels(&now, 0, count, panel0, panel1);
}

/* Side 1: all pixels of all images are one row, read where they are, or from a chunk as bf16. */
void conv_run_pointwise(const conv_plan *p)
{
    const ptrdiff_t pixels = (ptrdiff_t)p->n * p->h * p->w;
    const int panels = conv_panels(p->oc), chunk = 16 * ts_conv_k()->pixels;
    const int chunks = (int)((pixels + chunk - 1) / chunk);
    int groups = chunks < 8 ? (8 + chunks - 1) / chunks : 1;
    if (groups > panels) groups = panels;
    ts_spread_tasks(p->threads, (int64_t)groups * chunks, run_unit, &(run_job){p, chunk, groups});
}
