#include "eval/run.h"
#include "cli/camera.h"
#include "eval/contact.h"
#include "eval/multiview.h"
#include "eval/sheet.h"
#include "infer/capture.h"
#include "render/error.h"
#include "tensor/cpu.h"
#include "tensor/peak.h"
#include "tensor/threads.h"
#include <stdlib.h>
#include <string.h>

enum { PATH_LENGTH = 4096 };

/* What one material needs. */
typedef struct bench {
    io_material truth, peer;
    io_capture capture;
    rd_view views[RD_EVAL_VIEWS];
    float *image, *photo, *first, *last;
    ev_row *row;
    double *seconds;
    ev_contact contact; /* of the method that runs */
    const char *name;
    int pictures;
    int *at;   /* of each material: its result, or -1: none yet */
    bool *bad; /* it cannot be read */
} bench;

/* What is known of a picture that was not rendered here. */
static ts_code load_photo(ev_run *r, bench *b, const ev_set *set, int i, ev_case *c, ts_status *st)
{
    free(b->photo);
    double fov;
    if (ev_set_load_photo(set, i, r->size, &b->photo, &fov, &b->truth, &b->peer, st) != TS_OK) return st->code;
    b->name = b->truth.name;
    *c = ev_case_of_photo(b->photo, r->size);
    c->fov = fov;
    if (b->peer.size) c->peer = &b->peer;
    if (!b->truth.size) return TS_OK;
    ts_rng rng = ts_rng_make(r->seed, TS_STREAM_EVAL, ev_set_identity(set, i));
    rd_eval_views(&rng, RD_EVAL_VIEWS, b->views);
    c->truth = &b->truth;
    c->views = b->views;
    c->fit = true;
    c->perceptual = r->perceptual;
    c->lpips = r->lpips;
    return TS_OK;
}

/* A known material from photographs under a printed sheet, with the lights and cameras found there. */
static ts_code load_under_sheet(ev_run *r, bench *b, const ev_set *set, int i, ev_case *c, ts_status *st)
{
    lgd_photo photo[NN_MAX_IMAGES];
    if (ev_set_load_under_sheet(set, i, r->inputs, r->size, &b->truth, &b->capture, st) != TS_OK) return st->code;
    b->name = b->truth.name;
    ts_rng rng = ts_rng_make(r->seed, TS_STREAM_EVAL, ev_set_identity(set, i));
    rd_eval_views(&rng, RD_EVAL_VIEWS, b->views);
    *c = ev_case_of_maps(&b->truth, b->capture.image, b->views, r->perceptual);
    c->inputs = lgd_capture_photos(&b->capture, r->inputs, photo);
    for (int k = 0; k < c->inputs; k++) {
        c->input[k] = (rd_view){.kind = RD_POINT, .power = photo[k].power};
        memcpy(c->input[k].camera, photo[k].camera, sizeof photo[k].camera);
        memcpy(c->input[k].light, photo[k].light, sizeof photo[k].light);
    }
    c->view = c->input[0];
    c->fov = rd_fov_from(c->view.camera);
    c->fit = r->fit;
    c->lpips = r->lpips;
    return TS_OK;
}

static ts_code load(ev_run *r, bench *b, const ev_set *set, int i, ev_case *c, ts_status *st)
{
    const uint64_t identity = ev_set_identity(set, i);
    const bool capture = set->kind == EV_MULTIVIEW;
    b->name = "";
    if (set->kind == EV_PHOTOS || set->kind == EV_PEERS) return load_photo(r, b, set, i, c, st);
    if (set->kind == EV_UNDER_SHEET || set->kind == EV_UNDER_SHEET_EXACT) return load_under_sheet(r, b, set, i, c, st);
    if ((capture ? ev_set_load_capture(set, i, r->size, &b->capture, st)
                 : ev_set_load(set, i, r->size, &b->truth, st)) != TS_OK)
        return st->code;
    if (capture) {
        b->name = b->capture.name;
        if (b->capture.images <= r->inputs)
            return ts_fail(st, TS_FORMAT, "%s: has %d pictures: %d are the input, and one more at least is compared",
                           b->name, b->capture.images, r->inputs);
        ev_capture_nearest_first(&b->capture);
        float *const taken = b->image + (size_t)r->inputs * (size_t)r->size * (size_t)r->size * 3;
        if (r->light_known) {
            ev_capture_input(&b->capture, r->inputs, false, b->image);
            ev_capture_input(&b->capture, r->inputs, true, taken);
        }
        *c = ev_case_of_capture(&b->capture, r->light_known ? b->image : b->capture.image, r->inputs, r->light_known,
                                r->perceptual);
        if (r->light_known) c->taken = taken;
        c->lpips = r->lpips;
        return TS_OK;
    }
    b->name = b->truth.name;
    ts_rng rng = ts_rng_make(r->seed, TS_STREAM_EVAL, identity);
    rd_eval_views(&rng, RD_EVAL_VIEWS, b->views);
    *c = ev_case_of_maps(&b->truth, b->image, b->views, r->perceptual);
    c->view = r->flash;
    c->fov = rd_fov_from(r->flash.camera);
    c->inputs = r->inputs;
    c->exposure = r->exposure;
    c->fit = r->fit;
    ev_input_views(&c->view, c->inputs, r->seed, identity, c->input);
    for (int k = 0; k < c->inputs; k++) {
        const uint64_t which = identity * NN_MAX_IMAGES + (uint64_t)k;
        float *image = b->image + (size_t)k * (size_t)r->size * (size_t)r->size * 3;
        if (r->camera) {
            const cl_shot shot = cl_photograph(r->camera, r->seed, which, &c->input[k], r->size, b->truth.maps, image);
            if (k == 0) c->fov = rd_fov_from(shot.view.camera);
            if (r->light_known) c->input[k] = shot.view;
        } else {
            const ev_photo photo = {c->input[k], c->exposure, (float)r->noise, r->seed, which};
            ev_photograph(&b->truth, &photo, image);
        }
    }
    c->view = c->input[0];
    c->lpips = r->lpips;
    return TS_OK;
}

static bool begin(int step, const float *maps, int channels, void *user)
{
    (void)maps, (void)channels, (void)user;
    return step < 2;
}

static ts_code sheet(const ev_run *r, const bench *b, const ev_case *c, int set, int method, ts_status *st)
{
    char path[PATH_LENGTH];
    const char *label = r->methods > 1 ? r->method[method].label : "";
    if (snprintf(path, sizeof path, "%s/%d-%s%s%s.png", r->images, set + 1, b->name, *label ? "-" : "", label) >=
        (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", r->images);
    return ev_sheet_write(path, c, b->first, b->last, st);
}

/* The method's photographs in one picture. */
static ts_code contact_sheet(const ev_run *r, bench *b, int method, ts_status *st)
{
    char path[PATH_LENGTH], part[32] = "";
    const char *label = r->methods > 1 ? r->method[method].label : "";
    ts_code code = TS_OK;
    if (r->shards) snprintf(part, sizeof part, "-%d-of-%d", r->shard, r->shards);
    if (r->images &&
        snprintf(path, sizeof path, "%s/contact%s%s%s.png", r->images, *label ? "-" : "", label, part) >=
            (int)sizeof path)
        code = ts_fail(st, TS_INVALID, "%s: the name is too long", r->images);
    if (r->images && !code) code = ev_contact_write(&b->contact, path, st);
    ev_contact_free(&b->contact);
    return code;
}

/* A material by an open method; into the report only when all went well. */
static ts_code one(ev_run *r, bench *b, int set, int m, int64_t number, const ev_case *c, ts_status *st)
{
    ev_estimator *e = &r->method[m];
    const ev_subject *s = &r->subject[m];
    unsigned char *png = NULL;
    size_t png_size = 0;
    ev_case shown = *c;
    e->found = c->view;
    ts_code code = ev_estimate(e, c, r->step + s->first, s->points, r->repeat, b->row, b->seconds, b->first, b->last,
                               st);
    if (!c->capture && !c->truth) shown.view = e->found; /* a photograph of which nothing else is known */
    if (!code && r->images) code = sheet(r, b, &shown, set, m, st);
    if (!code && r->images) code = ev_contact_add(&b->contact, &shown, b->last, st);
    if (!code && r->pictures && b->pictures < EV_PICTURES) {
        code = ev_sheet_png(&shown, b->last, &png, &png_size, st);
        b->pictures++;
    }
    if (!code && b->at[number] < 0) {
        b->at[number] = ev_report_add(&r->report, set, b->name, st);
        if (b->at[number] < 0) code = st->code;
        else r->report.result[b->at[number]].number = number, r->report.result[b->at[number]].method = m;
    }
    if (code) {
        free(png);
        return code;
    }
    ev_result *to = &r->report.result[b->at[number]];
    memcpy(to->row + s->first, b->row, (size_t)s->points * sizeof *to->row);
    memcpy(to->seconds + s->first, b->seconds, (size_t)s->points * sizeof *to->seconds);
    to->peak[m] = ts_fma_peak();
    to->sheet = ev_sheet_shape_of(c);
    to->png[m] = png;
    to->png_size[m] = png_size;
    return TS_OK;
}

static ts_code all_materials(ev_run *r, bench *b, int m, int64_t total, ts_status *st)
{
    int64_t number = 0;
    bool warm = false;
    for (int s = 0; s < r->sets; s++)
        for (int i = 0; i < r->set[s].count; i++, number++) {
            ev_case c;
            if (b->bad[number] || (r->shards && number % r->shards != r->shard - 1)) continue;
            *st = (ts_status){0};
            b->bad[number] = load(r, b, &r->set[s], i, &c, st) != TS_OK;
            if (!st->code && r->method[m].method->peer && !c.peer) continue;
            if (!st->code && !warm) {
                r->method[m].method->run(&r->method[m], &c, begin, NULL, st);
                warm = true;
            }
            if (!st->code && one(r, b, s, m, number, &c, st) == TS_INTERRUPTED) return st->code;
            if (st->code) {
                if (!b->bad[number])
                    ts_context(st, "%s: %s%s%s", r->set[s].spec, b->name, r->methods > 1 ? ", " : "",
                               r->methods > 1 ? r->method[m].label : "");
                if (r->failed) r->failed(st->message, r->user);
                r->failures++;
            }
            if (r->done) r->done(total * m + number + 1, total * r->methods, b->name, r->user);
        }
    *st = (ts_status){0};
    return TS_OK;
}

/* The columns, and that every method can be opened. */
static ts_code plan(ev_run *r, ts_status *st)
{
    int *step = malloc(EV_POINTS * sizeof *step);
    ts_code code = step ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    r->inputs = 1;
    r->subject = calloc((size_t)r->methods, sizeof *r->subject);
    if (!r->subject) code = ts_fail(st, TS_NOMEM, "out of memory");
    for (int m = 0, columns = 0; m < r->methods && !code; m++) {
        r->method[m].exact = r->exact;
        code = ev_open(&r->method[m], st);
        if (code) break;
        const int points = ev_points(&r->method[m], step),
                  photos = r->method[m].method->photos ? r->method[m].method->photos(&r->method[m]) : 1;
        if (photos > r->inputs) r->inputs = photos;
        int *more = realloc(r->step, (size_t)(columns + points) * sizeof *more);
        if (!more) code = ts_fail(st, TS_NOMEM, "out of memory");
        else memcpy((r->step = more) + columns, step, (size_t)points * sizeof *step);
        r->subject[m] = (ev_subject){.label = r->method[m].label, .first = columns, .points = points};
        columns += points;
        r->report.columns = columns;
        ev_close(&r->method[m]);
    }
    free(step);
    return code;
}

static bool make(ev_run *r, bench *b, int64_t total)
{
    const size_t pixels = (size_t)r->size * (size_t)r->size;
    b->image = malloc(2 * (size_t)r->inputs * pixels * 3 * sizeof *b->image); /* and as they were taken */
    b->first = malloc(pixels * MAP_CHANNELS * sizeof *b->first);
    b->last = malloc(pixels * MAP_CHANNELS * sizeof *b->last);
    b->row = malloc((size_t)r->report.columns * sizeof *b->row);
    b->seconds = malloc((size_t)r->report.columns * sizeof *b->seconds);
    b->at = malloc((size_t)total * sizeof *b->at);
    b->bad = calloc((size_t)total, sizeof *b->bad);
    for (int64_t i = 0; i < total && b->at; i++) b->at[i] = -1;
    return b->image && b->first && b->last && b->row && b->seconds && b->at && b->bad;
}

static void clear(bench *b)
{
    io_material_free(&b->truth);
    io_material_free(&b->peer);
    ev_contact_free(&b->contact);
    free(b->photo);
    io_capture_free(&b->capture);
    free(b->image);
    free(b->first);
    free(b->last);
    free(b->row);
    free(b->seconds);
    free(b->at);
    free(b->bad);
}

ts_code ev_run_all(ev_run *r, ts_status *st)
{
    bench b = {0};
    int64_t total = 0;
    for (int s = 0; s < r->sets; s++) total += r->set[s].count;
    r->report = (ev_report){.sets = r->sets,
                            .size = r->size,
                            .threads = ts_threads(),
                            .repeat = r->repeat,
                            .pinned = r->pinned,
                            .exact = r->exact,
                            .set_name = r->set_name,
                            .model = r->model,
                            .isa = ts_isa_name(ts_isa_now()),
                            .methods = r->methods};
    ts_code code = plan(r, st);
    r->report.method = r->subject;
    r->report.step = r->step;
    if (!code && !make(r, &b, total))
        code = ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", r->size, r->size);
    for (int m = 0; m < r->methods && !code; m++) {
        r->method[m].exact = r->exact;
        code = ev_open(&r->method[m], st);
        if (!code) code = all_materials(r, &b, m, total, st);
        if (!code) code = contact_sheet(r, &b, m, st);
        r->subject[m].bytes = ev_bytes(&r->method[m]);
        ev_close(&r->method[m]);
    }
    clear(&b);
    return code;
}

void ev_run_free(ev_run *r)
{
    ev_report_free(&r->report);
    free(r->subject);
    free(r->step);
    r->subject = NULL;
    r->step = NULL;
}
