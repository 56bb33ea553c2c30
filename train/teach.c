/* The loss of a g that learns from another, train.teacher, which reads each photograph twice. The second time it reads
 * it in a drawn orientation, and where the camera is not known it is told its own guess of the distance: what it then
 * says of the diffuse albedo is better, and so is the mean of its normals over the orientations. A student learns to
 * say both at once, and all else as the first answer has it. */
#include "ops.h"
#include "nn/orient.h"
#include "nn/weights/weights.h"
#include "render/scene.h"
#include "tensor/maps.h"
#include "train/state.h"
#include <string.h>

ts_code tr_teacher_load(tr_trainer *t, ts_status *st)
{
    const tr_config *c = &t->config;
    const char *path = c->train.teacher;
    t->teacher = nn_model_load(path, st);
    if (!t->teacher) return ts_context(st, "train.teacher");
    const nn_arch *a = &t->teacher->arch;
    if (!a->conditions || !a->spread || !a->scene || a->images != 1)
        return ts_fail(st, TS_INVALID,
                       "%s: train.teacher must have model.conditions, spread and scene, and read one photograph", path);
    if (nn_arch_side(a) != nn_arch_side(&c->arch))
        return ts_fail(st, TS_INVALID, "%s: train.teacher says maps of %d x %d pixels, the model of %d x %d", path,
                       nn_arch_side(a), nn_arch_side(a), nn_arch_side(&c->arch), nn_arch_side(&c->arch));
    return TS_OK;
}

/* Of cameras that are not known, the one above the centre that the teacher takes for likeliest. */
static void tell_guesses(const nn_input *in, const ag_value *scene, rd_view *views, unsigned char *known)
{
    const int count = in->image.shape.n;
    for (int n = 0; n < count; n++) {
        views[n] = in->views[n], known[n] = in->known[n];
        if (known[n] & NN_KNOWN_CAMERA) continue;
        const float *said = scene->t.data + (size_t)n * 2 * RD_SCENE_NUMBERS;
        const float number[RD_SCENE_NUMBERS] = {[RD_SCENE_DISTANCE] = said[RD_SCENE_DISTANCE]};
        memcpy(views[n].camera, rd_scene_view(number).camera, sizeof views[n].camera);
        known[n] |= NN_KNOWN_CAMERA;
    }
}

/* in with the photographs and views in an orientation. False after an error. */
static bool turn(ag_tape *tape, int orientation, nn_input *in, rd_view *views)
{
    const ts_shape s = in->image.shape;
    const int64_t values = (int64_t)s.h * s.w * s.c;
    ag_value *turned = ag_empty(tape, s);
    if (!turned) return false;
    for (int n = 0; n < s.n; n++) {
        const rd_view view = views[n];
        nn_turn(orientation, s.h, s.c, in->image.data + n * values, turned->t.data + n * values);
        nn_turn_vector(orientation, view.camera, views[n].camera);
        nn_turn_vector(orientation, view.light, views[n].light);
    }
    in->image = turned->t;
    in->views = views;
    return true;
}

bool tr_taught(ag_tape *tape, const nn_model *teacher, const nn_input *in, int orientation, nn_guess *said)
{
    const int count = in->image.shape.n, channels = teacher->arch.channels, side = nn_arch_side(&teacher->arch);
    const int64_t pixels = (int64_t)side * side;
    ts_arena *arena = ag_arena(tape);
    rd_view *views = ts_arena_alloc(arena, (size_t)count * sizeof *views);
    unsigned char *known = ts_arena_alloc(arena, (size_t)count);
    float *maps = ts_arena_alloc(arena, (size_t)(pixels * channels) * sizeof *maps);
    if (!views || !known || !maps) return ag_fail(tape, TS_NOMEM, "no memory for what a teacher says"), false;
    nn_guess again;
    if (!nn_guess_from(tape, teacher, in, said)) return false;
    tell_guesses(in, said->scene, views, known);
    nn_input told = *in;
    told.known = known;
    if (!turn(tape, orientation, &told, views) || !nn_guess_from(tape, teacher, &told, &again)) return false;
    for (int n = 0; n < count; n++) {
        float *to = said->maps->t.data + n * pixels * channels;
        nn_turn_maps_back(orientation, side, channels, again.maps->t.data + n * pixels * channels, maps);
        for (int64_t i = 0; i < pixels * channels; i += channels) {
            memcpy(to + i + MAP_DIFFUSE, maps + i + MAP_DIFFUSE, 3 * sizeof *to);
            memcpy(to + i + MAP_NORMAL, maps + i + MAP_NORMAL, 2 * sizeof *to);
        }
    }
    return true;
}

/* The mean absolute difference of x from what the teacher says. */
static ag_value *differ(ag_tape *tape, ag_value *x, const ag_value *said)
{
    static const signed char own[2 * RD_SCENE_NUMBERS] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    ag_value *one = ag_empty(tape, said->t.shape);
    if (!one) return NULL;
    memset(one->t.data, 0, (size_t)ts_count(one->t.shape) * sizeof(float));
    return ag_laplace(tape, x, one, ag_constant(tape, said->t), own, 1);
}

ag_value *tr_taught_loss(tr_trainer *t, const nn_input *in, tr_row *row)
{
    const tr_config *c = &t->config;
    ag_tape *tape = t->tape;
    nn_guess said, guess;
    ag_reset(t->quiet);
    ag_compute_set(t->quiet, (ts_compute){.exact = c->train.exact, .precision = c->train.precision});
    ts_rng rng = ts_rng_make((uint64_t)c->train.seed, TS_STREAM_TRAIN, (uint64_t)t->step);
    if (!tr_taught(t->quiet, t->teacher, in, ts_rng_int(&rng, NN_ORIENTATIONS), &said))
        return ag_fail(tape, ag_status(t->quiet)->code, "%s", ag_status(t->quiet)->message);
    if (!nn_guess_from(tape, t->model, in, &guess)) return NULL;
    ag_value *maps = ag_laplace(tape, guess.maps, ag_constant(tape, said.spread->t), ag_constant(tape, said.maps->t),
                                nn_spread_of, NN_SPREAD_UNIT);
    ag_value *spread = differ(tape, guess.spread, said.spread), *scene = differ(tape, guess.scene, said.scene);
    ag_value *loss = ag_add(tape, maps,
                            ag_add(tape, ag_scale(tape, spread, (float)c->train.spread_weight),
                                   ag_scale(tape, scene, (float)c->train.scene_weight)));
    if (!loss) return NULL;
    row->map_start = (double)maps->t.data[0];
    row->spread = (double)spread->t.data[0], row->scene = (double)scene->t.data[0];
    return loss;
}
