#include "infer/guess.h"
#include "infer/exposure.h"
#include "nn/clip.h"
#include "nn/deviation.h"
#include "nn/level.h"
#include "nn/metal.h"
#include "nn/revise.h"
#include "tensor/maps.h"

int lgd_guess_known(const lgd_options *o)
{
    return (o->power ? 0 : NN_KNOWN_POWER) |
        (o->fov > 0                       ? NN_KNOWN_CAMERA
             : o->fov == LGD_FOV_OF_PHOTO ? NN_KNOWN_CAMERA | NN_KNOWN_LIGHT
                                          : 0);
}

ts_code lgd_guess_revise(ag_tape *tape, const nn_model *net, lgd_given *p, int revisions,
                         bool (*seen)(int step, const float *maps, void *user), void *user, nn_first_guess *g,
                         int *made, ts_status *st)
{
    const int size = nn_arch_side(&net->arch);
    const ts_shape maps = {1, size, size, MAP_CHANNELS}, spread = {1, size, size, NN_SPREADS};
    *made = 0;
    const ag_value *image = revisions > 0 ? ag_empty(tape, (ts_shape){p->count, size, size, 3}) : NULL;
    if (image && nn_clip_to(p->image, p->side, &image->t, ag_arena(tape), ag_compute(tape)->threads, st))
        return st->code;
    nn_revision r = {.given = p->count, .views = p->views, .known = p->known, .kind = p->kind};
    if (image) {
        r.image = image->t;
        r.maps = ag_constant(tape, ts_view(g->r0, maps));
        r.spread = ag_constant(tape, ts_view(g->spread, spread));
        while (*made < revisions && (!seen || seen(*made, g->r0, user)) && nn_revise(tape, net, &r)) {
            g->r0 = r.maps->t.data, g->spread = r.spread->t.data;
            ++*made;
        }
    }
    if (ag_status(tape)->code) {
        *st = *ag_status(tape);
        return st->code;
    }
    const nn_belief belief = {.photographs = p->count, .revised = true, .finer = p->side > size};
    if (*made > 0) {
        nn_deviations((int64_t)size * size, g->spread, belief, ag_compute(tape)->threads, g->deviation);
        nn_deviations_of_kind(p->kind, (int64_t)size * size, g->deviation);
    }
    p->r0 = g->r0;
    return TS_OK;
}

ts_code lgd_guess_first(ag_tape *tape, const nn_model *net, lgd_given *p, const lgd_options *o, nn_first_guess *guess,
                        ts_status *st)
{
    const nn_arch *a = &net->arch;
    const rd_grid grid = rd_grid_on(rd_grid_full(nn_arch_side(a)), ag_compute(tape)->threads);
    const double before = lgd_irradiance(&p->views[0]);
    const nn_first_ask ask = {.image = p->image[0],
                              .side = p->side,
                              .taken = {p->views[0], lgd_guess_known(o), p->count, p->kind},
                              .orientations = o->orientations};
    const ts_code code = nn_first_guess_make(tape, net, &ask, guess, st);
    if (code) return code;
    p->views[0] = guess->view;
    p->r0 = guess->r0;
    p->deviation = guess->deviation;
    if (o->power) {
        *o->power = lgd_irradiance(&p->views[0]) / before;
        if (lgd_expose_others(grid, p->r0, a->channels, p->count, p->views, p->image, p->side, *o->power, st))
            return st->code;
    }
    const nn_photos photos = {p->image, p->views, p->count, p->side, lgd_guess_known(o)};
    if (p->count == 1 && photos.known == NN_KNOWN_ALL)
        return nn_find_levels(grid, p->image[0], p->side, &p->views[0], p->kind, guess->deviation, a->channels,
                              guess->r0, st);
    if (p->count == 1 || p->kind != NN_KIND_UNKNOWN) return TS_OK;
    return nn_tell_metal(grid, &photos, guess->deviation, nn_arch_steps(a, p->count), a->channels, guess->r0, st);
}
