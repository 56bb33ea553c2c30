#include "infer/guess.h"
#include "infer/exposure.h"
#include "infer/metal.h"
#include <math.h>

int lgd_guess_known(const lgd_options *o)
{
    return (o->power ? 0 : NN_KNOWN_POWER) |
        (o->fov > 0                       ? NN_KNOWN_CAMERA
             : o->fov == LGD_FOV_OF_PHOTO ? NN_KNOWN_CAMERA | NN_KNOWN_LIGHT
                                          : 0);
}

/* Power over distance squared at the centre of the sample, of a light above it. */
static double irradiance(const rd_view *view) { return (double)view->power / pow((double)view->light[2], 2); }

/* Where the power is not known, of photographs besides the first neither is their exposure; their lights are first as
 * much stronger or weaker than supposed as that one's. */
static ts_code expose_others(const ag_tape *tape, const nn_arch *a, lgd_given *p, double factor, ts_status *st)
{
    const rd_grid grid = rd_grid_on(rd_grid_full(nn_arch_side(a)), ag_compute(tape)->threads);
    for (int k = 1; k < p->count; k++) {
        double own;
        p->views[k].power *= (float)factor;
        if (lgd_exposure_beside(grid, p->r0, a->channels, &p->views[k], p->image[k], p->side, &own, st))
            return st->code;
        p->views[k].power *= (float)own;
    }
    return TS_OK;
}

ts_code lgd_guess_first(ag_tape *tape, const nn_model *net, lgd_given *p, const lgd_options *o, int revisions,
                        bool (*seen)(const nn_first_guess *guess, void *user), void *user, nn_first_guess *guess,
                        ts_status *st)
{
    const nn_arch *a = &net->arch;
    const double before = irradiance(&p->views[0]);
    const nn_first_ask ask = {.image = p->image[0],
                              .side = p->side,
                              .taken = {p->views[0], lgd_guess_known(o), p->count},
                              .orientations = o->orientations,
                              .revisions = revisions,
                              .seen = seen,
                              .user = user};
    const ts_code code = nn_first_guess_make(tape, net, &ask, guess, st);
    if (code) return code;
    p->views[0] = guess->view;
    p->r0 = guess->r0;
    p->deviation = guess->deviation;
    if (o->power) {
        *o->power = irradiance(&p->views[0]) / before;
        if (expose_others(tape, a, p, *o->power, st)) return st->code;
    }
    if (p->count == 1) return TS_OK;
    const lgd_metal_photos photos = {p->image, p->views, p->count, p->side, lgd_guess_known(o)};
    return lgd_tell_metal(rd_grid_on(rd_grid_full(nn_arch_side(a)), ag_compute(tape)->threads), &photos,
                          guess->deviation, nn_arch_steps(a, p->count), a->channels, guess->r0, st);
}
