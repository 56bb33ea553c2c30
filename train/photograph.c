/* Photographs of materials, with the camera's faults: the networks' input. */
#include "cli/camera.h"
#include "data/under_sheet.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include "train/state.h"
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

io_procedural tr_materials_of(const tr_config *c)
{
    return (io_procedural){.seed = (uint64_t)c->data.seed,
                           .families = c->data.families,
                           .often = c->data.often,
                           .hues = (float)c->data.hues,
                           .darker = (float)c->data.darker,
                           .relief = (float)c->data.relief,
                           .blend = (float)c->data.blend,
                           .uneven = (float)c->data.uneven,
                           .closer = (float)c->data.closer,
                           .homogeneous = (float)c->data.homogeneous,
                           .plain = (float)c->data.plain,
                           .smoother = (float)c->data.smoother,
                           .steeper = (float)c->data.steeper,
                           .collected = (float)c->data.collected};
}

ts_code tr_same_source(uint64_t hash, const char *path, const char *what, char known[TR_HASH], ts_status *st)
{
    char text[TR_HASH];
    snprintf(text, sizeof text, "%016" PRIx64, hash);
    if (*known && strcmp(text, known) != 0)
        return ts_fail(st, TS_INVALID, "%s: has other %s than the run was begun with (--resume needs the same)", path,
                       what);
    strcpy(known, text);
    return TS_OK;
}

ts_code tr_read_collection(tr_trainer *t, ts_status *st)
{
    const char *path = t->config.data.collection;
    t->collection = io_collection_read(path, 0, t->listener.stop, t->listener.user, st);
    if (!t->collection) return st->code;
    return tr_same_source(io_collection_hash(t->collection), path, "maps", t->collection_hash, st);
}

io_camera tr_camera_of(const tr_config *c)
{
    return (io_camera){.noise = (float)c->data.noise,
                       .noise_spread = (float)c->data.noise_spread,
                       .blur = (float)c->data.blur,
                       .quantise = c->data.quantise,
                       .exposure = (float)c->data.exposure,
                       .meter = (float)c->data.meter,
                       .automatic = (float)c->data.automatic,
                       .vignette = (float)c->data.vignette,
                       .white_balance = (float)c->data.white_balance,
                       .jpeg = c->data.jpeg,
                       .tilt = (float)c->data.tilt,
                       .off_centre = (float)c->data.off_centre,
                       .fov_min = (float)c->data.fov_min,
                       .fov_max = (float)c->data.fov_max,
                       .flash = (float)c->data.flash,
                       .flash_size = (float)c->data.flash_size,
                       .glare = (float)c->data.glare,
                       .lobes = (float)c->data.lobes,
                       .soften = (float)c->data.soften,
                       .ambient = (float)c->data.ambient,
                       .tone = (float)c->data.tone,
                       .sharpen = (float)c->data.sharpen,
                       .told_view = (float)c->data.told_view,
                       .told_power = (float)c->data.told_power};
}

static io_under_sheet under_sheet_of(const tr_config *c)
{
    return (io_under_sheet){
        .pose = (float)c->data.pose, .shift = (float)c->data.shift, .bracket = (float)c->data.bracket};
}

/* The same camera with what a sheet gives, place and exposure, known exactly. */
static io_camera measured(io_camera c)
{
    c.exposure = c.meter = c.automatic = c.white_balance = c.tilt = c.off_centre = c.fov_min = c.fov_max = c.flash = 0;
    return c;
}

bool tr_under_sheet(double share, uint64_t seed, uint64_t index)
{
    ts_rng rng = ts_rng_make(seed, TS_STREAM_SHEET, index);
    return share > 0 && (double)ts_rng_uniform(&rng) < share;
}

/* The number of a material's photograph k, from 0, whose faults it decides: nobody else's, however many there are. */
static uint64_t number_of(uint64_t material, int k) { return material + ((uint64_t)k << 40); }

typedef struct taking {
    const io_camera *camera;
    const io_under_sheet *sheet;
    double share; /* of the materials that are under a sheet */
    uint64_t seed, first;
    int size, number;
    float *images;
} taking;

static void take(const void *job, int64_t i)
{
    const taking *t = job;
    const uint64_t material = t->first + (uint64_t)(i / t->number), which = number_of(material, (int)(i % t->number));
    const size_t values = (size_t)t->size * (size_t)t->size * 3;
    float *image = t->images + (size_t)i * values;
    if (!tr_under_sheet(t->share, t->seed, material)) {
        io_camera_apply(t->camera, t->seed, which, t->size, image);
        return;
    }
    const io_camera camera = measured(*t->camera);
    const float gain = io_under_sheet_exposure(t->sheet, t->seed, which), most = 1;
    io_under_sheet_shift(t->sheet, t->seed, which, t->size, image);
    for (size_t k = 0; k < values; k++) image[k] *= gain;
    io_camera_apply(&camera, t->seed, which, t->size, image);
    for (size_t k = 0; k < values; k++) image[k] = image[k] / gain < most ? image[k] / gain : most;
}

/* The radiance of a photograph of a printed sheet, whose camera and flash are planned to be where they are thought. */
static cl_shot shoot(const io_camera *camera, const io_under_sheet *sheet, uint64_t seed, uint64_t which,
                     const rd_view *planned, int size, const float *maps, float *image)
{
    const io_camera known = measured(*camera);
    rd_view view = *planned;
    io_rig rig = {.power = planned->power};
    memcpy(rig.camera, planned->camera, sizeof rig.camera);
    memcpy(rig.light, planned->light, sizeof rig.light);
    io_under_sheet_move(sheet, seed, which, &rig);
    memcpy(view.camera, rig.camera, sizeof rig.camera);
    memcpy(view.light, rig.light, sizeof rig.light);
    return cl_expose(&known, seed, which, &view, size, maps, image);
}

void tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                    const rd_view *views, int number, float *images, tr_shot *shots)
{
    const io_camera camera = tr_camera_of(c);
    const io_under_sheet sheet = under_sheet_of(c);
    const rd_view flash = rd_flash();
    const double share = views ? c->data.sheet : 0; /* the flash for all is no sheet's */
    const size_t pixels = (size_t)size * (size_t)size;
    for (int i = 0; i < count * number; i++) {
        const uint64_t which = number_of(index + (uint64_t)(i / number), i % number);
        const float *material = maps + (size_t)(i / number) * pixels * MAP_CHANNELS;
        float *image = images + (size_t)i * pixels * 3;
        const rd_view *view = views ? &views[i] : &flash;
        const bool of_sheet = tr_under_sheet(share, seed, index + (uint64_t)(i / number));
        tr_shot shot = {.is = of_sheet ? shoot(&camera, &sheet, seed, which, view, size, material, image)
                                       : cl_expose(&camera, seed, which, view, size, material, image)};
        shot.thought = shot.is.view;
        if (of_sheet) {
            memcpy(shot.thought.camera, view->camera, sizeof view->camera);
            memcpy(shot.thought.light, view->light, sizeof view->light);
        }
        if (!shots) continue;
        io_camera_told(&camera, seed, which, &shot.told_view, &shot.told_power);
        shots[i] = shot;
    }
    ts_tasks(0, (int64_t)count * number, take, &(taking){&camera, &sheet, share, seed, index, size, number, images});
}

void tr_capture_views(double sheet, uint64_t seed, uint64_t index, int count, int number, rd_view *views)
{
    for (int i = 0; i < count; i++) {
        ts_rng rng = ts_rng_make(seed, TS_STREAM_CAPTURE, index + (uint64_t)i);
        if (tr_under_sheet(sheet, seed, index + (uint64_t)i)) rd_sheet_draw(&rng, number, views + i * number);
        else rd_capture_draw(&rng, number, views + i * number);
    }
}

void tr_describe_several(const tr_shot *shots, int photographs, rd_view *views, unsigned char *known)
{
    for (int i = 0; i < photographs; i++) views[i] = shots[i].thought;
    memset(known, NN_KNOWN_ALL, (size_t)photographs);
}
