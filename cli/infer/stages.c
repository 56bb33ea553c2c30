#include "cli/infer/stages.h"
#include "cli/cli.h"
#include "cli/infer/record.h"
#include "infer/api_model.h"
#include "infer/meta.h"
#include "infer/output.h"
#include "nn/model.h"
#include "tensor/hash.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The last of an item's steps failed in a public function. */
static void failed(cl_item *item, const lgd_error *error) { ts_fail(&item->st, error->code, "%s", error->message); }

static void *take(cl_item *item, const cl_command *c, size_t pixel)
{
    void *buffer = malloc((size_t)c->size * (size_t)c->size * pixel);
    if (!buffer) ts_fail(&item->st, TS_NOMEM, "%s: out of memory", item->job->photo);
    return buffer;
}

/* Of a photograph that is no capture: item->image, from a square of so many pixels a side. */
static void note_source(const cl_command *c, int side, cl_item *item)
{
    item->source = (io_capture_source){NULL, side, io_levels_of(item->image, (int64_t)c->size * c->size * 3)};
}

static void read_photo(const cl_command *c, bool published, cl_item *item)
{
    const lgd_read_options o = {sizeof o, published, c->max_pixels, item->threads};
    const char *photo = item->job->photo;
    lgd_facts facts = {.size = sizeof facts};
    lgd_error error;
    if (!(item->square = take(item, c, 3 * sizeof *item->square))) return;
    if (lgd_read_photo(photo, c->size, &o, item->square, &facts, &error)) {
        failed(item, &error);
        return;
    }
    item->image = item->square;
    note_source(c, facts.width < facts.height ? facts.width : facts.height, item);
    item->fov = c->fov > 0 ? c->fov : facts.fov;
    snprintf(item->fov_from, sizeof item->fov_from, "%s", c->fov > 0 ? "--fov" : facts.fov_from);
    snprintf(item->profile, sizeof item->profile, "%s", facts.profile);
    item->transparent = facts.transparent;
    if (!c->mask || !(item->mask = take(item, c, 1))) return;
    if (lgd_read_mask(c->mask, c->size, facts.width, facts.height, &o, item->mask, &error)) {
        failed(item, &error);
        ts_context(&item->st, "%s", photo);
    }
}

static void read_angle(const cl_command *c, bool published, cl_item *item)
{
    lgd_rectified *r = &item->angle;
    if (published) {
        ts_fail(&item->st, TS_UNSUPPORTED, "%s: the published weights know no angle: leave out --corners",
                item->job->photo);
        return;
    }
    if (lgd_rectify(item->job->photo, &c->angle, c->max_pixels, c->size, c->fov, item->threads, r, &item->st)) return;
    snprintf(item->profile, sizeof item->profile, "%s", r->profile);
    item->transparent = r->transparent;
    item->image = item->square = r->square.data;
    note_source(c, (int)ceil(r->side), item);
    item->fov = LGD_FOV_OF_PHOTO;
    snprintf(item->fov_from, sizeof item->fov_from, "by the corners; %.1f degrees across the photograph: %s", r->fov,
             r->fov_from);
}

static void read_sheet(const cl_command *c, bool published, cl_item *item)
{
    io_sheet_set *set = &item->sheet;
    if (published) {
        ts_fail(&item->st, TS_UNSUPPORTED, "%s: the published weights know light and camera at one place: no --sheet",
                item->job->photo);
        return;
    }
    if (io_sheet_set_read(c->photo, c->photos, c->fov, c->max_pixels, item->threads, cl_interrupted, set, &item->st))
        return;
    if (set->good == 0) item->st = set->photo[0].st;
    else if (lgd_sheet_capture(set, NN_MAX_IMAGES, c->size, c->max_pixels, item->threads, &item->capture, &item->st))
        return;
    item->image = item->capture.image;
    item->fov = LGD_FOV_OF_PHOTO;
    snprintf(item->fov_from, sizeof item->fov_from, "the sheet, %d photographs", set->good);
}

static void read_input(const cl_command *c, bool published, cl_item *item)
{
    if (c->sheet) read_sheet(c, published, item);
    else if (c->corners) read_angle(c, published, item);
    else if (!*c->capture) read_photo(c, published, item);
    else if (!lgd_read_capture(c->capture, c->size, c->max_pixels, !(c->power > 0), &item->capture, &item->st)) {
        item->image = item->capture.image;
        item->fov = LGD_FOV_OF_PHOTO;
        snprintf(item->fov_from, sizeof item->fov_from, "the capture");
        snprintf(item->profile, sizeof item->profile, "%s", item->capture.profile);
    }
}

void cl_item_read(const cl_command *c, const char *recipe, bool published, cl_item *item)
{
    ts_status st = {0};
    const bool one = cl_command_one_file(c);
    const ts_code hash = one ? ts_hash_file(item->job->photo, &item->hash, &st) : TS_OK;
    item->was_done = one && !hash && c->skip_existing && cl_record_is_done(c, item, recipe, &item->result);
    if (item->was_done) return;
    read_input(c, published, item);
    if (hash && !item->st.code) item->st = st; /* of a file that cannot be read the reader has the better words */
}

/* What the library's calls get as their user. */
typedef struct task {
    cl_item *item;
    int steps; /* that will be made, at most */
    cl_item_progress progress;
    void *user;
} task;

static int after_step(int step, double rmse, void *user)
{
    const task *t = user;
    if (step == 0) t->item->first = rmse;
    t->item->last = rmse;
    t->item->steps = step;
    return t->progress(t->item, (step + 1.0) / (t->steps + 1), t->user);
}

static int before_tile(double done, void *user)
{
    const task *t = user;
    return t->progress(t->item, done, t->user);
}

/* What makes a photograph a poor one: the maps will be guesses. */
static void look_at(const cl_command *c, cl_item *item)
{
    const int64_t pixels = (int64_t)c->size * c->size;
    int64_t wanted = 0;
    unsigned light = 0;
    for (int k = 0; k < cl_item_sources(item); k++) light |= cl_item_light(&cl_item_source(item, k)->levels);
    while (item->mask && wanted < pixels && !item->mask[wanted]) wanted++;
    item->warnings = light | (*cl_item_fov_is(item) == 'a' ? CL_WARN_FOV : 0) | (*item->profile ? CL_WARN_PROFILE : 0) |
        (item->mask && wanted == pixels ? CL_WARN_MASK : 0) | (item->last > CL_FAR ? CL_WARN_DIFFERENT : 0) |
        (item->transparent ? CL_WARN_TRANSPARENT : 0);
}

/* Whether g sees the photographs in several orientations where they are asked for. */
static bool can_turn(const cl_item *item)
{
    const lgd_photo *p = &item->photo[0];
    return item->photos == 1 && p->light[0] == 0 && p->light[1] == 0 && p->camera[0] == 0 && p->camera[1] == 0;
}

void cl_item_estimate(const cl_command *c, lgd_model *model, cl_item *item, cl_item_progress progress, void *user)
{
    const bool fixed = c->power > 0;
    task t = {.item = item, .progress = progress, .user = user};
    const lgd_options options = {.size = sizeof options,
                                 .iterations = c->iterations,
                                 .threads = item->threads,
                                 .progress = after_step,
                                 .user = &t,
                                 .power = fixed ? NULL : &item->power,
                                 .exact = c->exact,
                                 .precision = c->bf16 ? LGD_BF16 : LGD_F32,
                                 .orientations = c->orientations,
                                 .mask = item->mask,
                                 .tolerance = c->tolerance,
                                 .tile = before_tile,
                                 .fov = item->fov,
                                 .taken = item->photo,
                                 .sample = c->sample,
                                 .ambient = &item->ambient};
    item->photo[0] = c->corners ? item->angle.photo : lgd_flash_photo(item->image);
    item->photos = item->capture.images ? lgd_capture_photos(&item->capture, lgd_most_photos(model), item->photo) : 1;
    if (*c->capture && c->orientations > 1 && !can_turn(item)) {
        ts_fail(&item->st, TS_INVALID,
                "%s: --orientations is for one photograph with light and camera above its centre: leave it out",
                c->capture);
        return;
    }
    t.steps = cl_command_steps(c, model, item->photos);
    item->power = fixed ? c->power : 1;
    for (int k = 0; k < item->photos; k++) item->photo[k].power *= (float)item->power;
    if ((!item->m.maps && io_material_create(&item->m, c->size, &item->st) != TS_OK) ||
        lgd_model_estimate(model, item->photo, item->photos, c->size, &options, true, item->m.maps, &item->st))
        ts_context(&item->st, "%s", item->job->photo);
    look_at(c, item);
}

ts_code cl_command_suits(const cl_command *c, const lgd_model *model, ts_status *st)
{
    const unsigned char some = 1;
    const struct {
        const char *name;
        lgd_options option;
    } each[] = {{"--sample", {.sample = c->sample}},
                {"--mask", {.mask = c->mask ? &some : NULL}},
                {"--tolerance", {.tolerance = c->tolerance}},
                {"--iterations", {.iterations = c->iterations}}};
    for (size_t i = 0; i < sizeof each / sizeof *each; i++)
        if (lgd_model_takes(model, &each[i].option, st) != TS_OK) return ts_context(st, "%s", each[i].name);
    return TS_OK;
}

double cl_item_bytes(const cl_command *c, const lgd_model *model)
{
    double found, most = 0;
    for (int view_known = 0; view_known < 2; view_known++) { /* the photographs' EXIF says it, or does not */
        const lgd_options options = {.size = sizeof options,
                                     .orientations = c->orientations,
                                     .tolerance = fmax(c->tolerance, 0),
                                     .fov = view_known ? LGD_FOV_OF_PHOTO : LGD_FOV_UNKNOWN,
                                     .power = c->power > 0 ? NULL : &found};
        most = fmax(most, lgd_model_bytes(model, c->size, &options));
    }
    return most;
}

/* Whether the maps in the item's folder were made from another photograph's file. */
static bool is_of_another(const cl_item *item)
{
    static const char key[] = "\nphotograph: ";
    char *meta = lgd_meta_read(item->job->folder);
    const char *at = meta ? strstr(meta, key) : NULL;
    const bool another = at && strtoull(at + sizeof key - 1, NULL, 16) != item->hash;
    free(meta);
    return another;
}

void cl_item_write(const cl_command *c, const char *recipe, cl_item *item)
{
    char *record = cl_record(c, item, recipe);
    item->result = cl_record_result(record);
    if (!record || !item->result) {
        ts_fail(&item->st, TS_NOMEM, "%s: out of memory", item->job->photo);
        free(record);
        return;
    }
    char from[sizeof item->fov_from + 32];
    snprintf(from, sizeof from, "%s%s", cl_item_assumption(item), item->fov_from);
    item->replaced = is_of_another(item);
    const lgd_order order = {.which = c->outputs,
                             .directx = c->directx,
                             .metallic = c->metallic,
                             .half = c->half,
                             .repeats = c->seamless,
                             .threads = item->threads,
                             .fov_from = from,
                             .ambient = item->ambient,
                             .record = record};
    if (lgd_output_write(c->out, item->job->stem, &item->m, &item->photo[0], &order, &item->written, &item->st))
        ts_context(&item->st, "%s", item->job->photo);
    free(record);
}
