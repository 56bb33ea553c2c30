/* The losses of a g that learns from another, train.teacher, by train.lesson. Where the camera is not known, a g says
 * more of the diffuse albedo when it reads the photograph a second time and is told its own guess of the distance: a
 * student of diffuse learns to say that at once, and all else as the teacher's first answer has it. A student of
 * normals learns them from the materials, and keeps all else as the teacher has it: trained on the maps alone, levels
 * of F0 and roughness wander while normals gain (docs/training-over-phone.md). Steps of photographs whose light and
 * camera are measured, data.measured, the materials teach; a student of what is known learns no more than these, and
 * keeps what the teacher says of others. */
#include "nn/weights/weights.h"
#include "ops.h"
#include "render/losses.h"
#include "render/scene.h"
#include "tensor/hash.h"
#include "tensor/maps.h"
#include "train/state.h"
#include <string.h>

ts_code tr_teacher_load(tr_trainer *t, ts_status *st)
{
    const tr_config *c = &t->config;
    const char *path = c->train.teacher;
    t->teacher = nn_model_load(path, st);
    uint64_t hash;
    if (!t->teacher || ts_hash_file(path, &hash, st) != TS_OK ||
        tr_same_source(hash, path, "weights", t->teacher_hash, st) != TS_OK)
        return ts_context(st, "train.teacher");
    const nn_arch *a = &t->teacher->arch;
    if (!a->conditions || !a->spread || !a->scene || a->images != 1 || a->channels != MAP_CHANNELS)
        return ts_fail(
            st, TS_INVALID,
            "%s: train.teacher must have model.conditions, spread and scene, read one photograph and say %d channels",
            path, MAP_CHANNELS);
    if (nn_arch_side(a) != nn_arch_side(&c->arch))
        return ts_fail(st, TS_INVALID, "%s: train.teacher says maps of %d x %d pixels, the model of %d x %d", path,
                       nn_arch_side(a), nn_arch_side(a), nn_arch_side(&c->arch), nn_arch_side(&c->arch));
    return TS_OK;
}

static ts_rng rng_of(const tr_config *c, int64_t step)
{
    return ts_rng_make((uint64_t)c->train.seed, TS_STREAM_LESSON, (uint64_t)step);
}

bool tr_measured(const tr_config *c, int64_t step)
{
    ts_rng rng = rng_of(c, step);
    return (double)ts_rng_uniform(&rng) < c->data.measured;
}

/* Who knows the light's power has its pictures in proportion to the light: they have no tone curve, and nothing else
 * shines. */
tr_config tr_measured_camera(const tr_config *c)
{
    tr_config m = *c;
    m.data.told_view = m.data.told_power = 1;
    m.data.exposure = m.data.meter = m.data.automatic = m.data.white_balance = m.data.vignette = 0;
    m.data.ambient = m.data.tone = m.data.sharpen = m.data.glare = 0;
    return m;
}

const tr_config *tr_taken_with(const tr_config *c, int64_t step, tr_config *measured)
{
    if (!tr_measured(c, step)) return c;
    ts_rng rng = rng_of(c, step);
    ts_rng_uniform(&rng); /* tr_measured's */
    tr_config *m = measured;
    *m = tr_measured_camera(c);
    if (ts_rng_uniform(&rng) < 0.5f)
        m->data.fov_min = m->data.fov_max = m->data.flash = m->data.flash_size = m->data.tilt = m->data.off_centre = 0;
    return m;
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

bool tr_taught(ag_tape *tape, const nn_model *teacher, const nn_input *in, nn_guess *said)
{
    const int count = in->image.shape.n, channels = teacher->arch.channels;
    rd_view *views = ts_arena_alloc(ag_arena(tape), (size_t)count * sizeof *views);
    unsigned char *known = ts_arena_alloc(ag_arena(tape), (size_t)count);
    if (!views || !known) return ag_fail(tape, TS_NOMEM, "no memory for %d cameras", count), false;
    nn_guess again;
    if (!nn_guess_from(tape, teacher, in, said)) return false;
    tell_guesses(in, said->scene, views, known);
    nn_input told = *in;
    told.views = views, told.known = known;
    if (!nn_guess_from(tape, teacher, &told, &again)) return false;
    const int64_t pixels = (int64_t)said->maps->t.shape.h * said->maps->t.shape.w;
    for (int64_t i = 0; i < count * pixels; i++)
        if (!(in->known[i / pixels] & NN_KNOWN_CAMERA))
            memcpy(said->maps->t.data + i * channels + MAP_DIFFUSE, again.maps->t.data + i * channels + MAP_DIFFUSE,
                   3 * sizeof(float));
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

/* The teacher's maps, but for the normals, which are those of target. */
static ag_value *with_normals_of(ag_tape *tape, const ts_tensor *said, const ag_value *target)
{
    const ts_tensor maps = ts_new(ag_arena(tape), said->shape);
    if (!maps.data) return ag_fail(tape, TS_NOMEM, "no memory for the maps of %d materials", said->shape.n);
    const int64_t pixels = ts_count(said->shape) / MAP_CHANNELS;
    memcpy(maps.data, said->data, (size_t)ts_count(said->shape) * sizeof(float));
    for (int64_t i = 0; i < pixels; i++)
        memcpy(maps.data + i * MAP_CHANNELS + MAP_NORMAL, target->t.data + i * MAP_CHANNELS + MAP_NORMAL,
               2 * sizeof(float));
    return ag_constant(tape, maps);
}

ag_value *tr_taught_loss(tr_trainer *t, const nn_input *in, ag_value *target, tr_row *row)
{
    const bool normals = t->config.train.lesson == TR_LESSON_NORMALS,
               diffuse = t->config.train.lesson == TR_LESSON_DIFFUSE;
    const tr_config *c = &t->config;
    ag_tape *tape = t->tape;
    nn_guess said, guess;
    ag_reset(t->quiet);
    ag_compute_set(t->quiet, (ts_compute){.exact = c->train.exact, .precision = c->train.precision});
    if (!(diffuse ? tr_taught : nn_guess_from)(t->quiet, t->teacher, in, &said))
        return ag_fail(tape, ag_status(t->quiet)->code, "%s", ag_status(t->quiet)->message);
    if (!nn_guess_from(tape, t->model, in, &guess)) return NULL;
    ag_value *goal = normals ? with_normals_of(tape, &said.maps->t, target) : ag_constant(tape, said.maps->t);
    ag_value *maps = ag_laplace(tape, guess.maps, ag_constant(tape, said.spread->t), goal, nn_spread_of,
                                NN_SPREAD_UNIT);
    ag_value *spread = differ(tape, guess.spread, said.spread), *scene = differ(tape, guess.scene, said.scene);
    ag_value *loss = ag_add(tape, maps,
                            ag_add(tape, ag_scale(tape, spread, (float)c->train.spread_weight),
                                   ag_scale(tape, scene, (float)c->train.scene_weight)));
    if (normals) loss = tr_add_normal_errors(t, loss, guess.maps, target);
    if (!loss) return NULL;
    row->map_start = (double)maps->t.data[0];
    row->spread = (double)spread->t.data[0], row->scene = (double)scene->t.data[0];
    return loss;
}
