/* lgd-eval: how far estimated maps are from known ones. */
#include "cli/cli.h"
#include "eval/command.h"
#include "eval/figure.h"
#include "eval/methods/tune.h"
#include "eval/shards.h"
#include "eval/usable.h"
#include "infer/model_path.h"
#include "infer/output.h"
#include "tensor/pin.h"
#include "tensor/threads.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH_LENGTH = 4096 };

/* Everything that one run holds. */
typedef struct work {
    const ev_command *c;
    ev_set set[EV_SETS_MAX];
    ev_estimator *method;
    ev_tuning tuning;
    ev_lpips *lpips;
    char model[PATH_LENGTH], images[PATH_LENGTH];
    ev_run run;
    cl_progress bar;
    int64_t done, total;
} work;

static void show_failure(const char *message, void *user)
{
    work *w = user;
    cl_progress_end(&w->bar);
    cl_failed("%s", message);
}

static void show_progress(int64_t done, int64_t total, const char *name, void *user)
{
    work *w = user;
    w->done = done;
    w->total = total;
    w->bar.total = total;
    if (!w->c->quiet) cl_progress_show(&w->bar, done, name);
}

/* Whether the methods know the light of a set's photographs. */
static bool is_light_known(const ev_command *c, const ev_set *set)
{
    if (set->kind == EV_PHOTOS || set->kind == EV_PEERS) return false;
    return set->kind == EV_MULTIVIEW || c->photographed ? c->light_known : !c->light_unknown;
}

/* The method where none is named: as lgd-infer estimates where the light is unknown. */
static ts_code parse_default(const work *w, const char **spec, ts_status *st)
{
    const bool known = is_light_known(w->c, &w->set[0]);
    for (int s = 1; s < w->c->sets; s++)
        if (is_light_known(w->c, &w->set[s]) != known)
            return ts_fail(st, TS_INVALID, "--set %s: its light is %s, unlike that of %s: give --method%s",
                           w->set[s].spec, known ? "not given" : "given", w->set[0].spec,
                           w->c->light_known && w->c->light_unknown ? "" : ", --told or --untold");
    *spec = known ? "lgd" : "lgd:power=auto,orientations=auto,label=lgd";
    return TS_OK;
}

/* The methods; a name or key that does not exist is wrong usage. */
static ts_code parse_methods(work *w, ts_status *st)
{
    const ev_command *c = w->c;
    w->run.methods = c->methods ? c->methods : 1;
    const char *spec = "lgd";
    const int iterations = c->iterations < 0 && c->iterations_figure ? 24 : c->iterations;
    if (!c->methods && parse_default(w, &spec, st) != TS_OK) return st->code;
    w->method = calloc((size_t)w->run.methods, sizeof *w->method);
    if (!w->method) return ts_fail(st, TS_NOMEM, "out of memory");
    for (int i = 0; i < w->run.methods; i++) {
        if (ev_method_parse(c->methods ? c->method[i] : spec, w->model, iterations, &w->method[i], st) != TS_OK)
            return st->code;
        for (int j = 0; j < i; j++)
            if (!strcmp(w->method[i].label, w->method[j].label))
                return ts_fail(st, TS_INVALID,
                               "--method %s: there is another method '%s': give one of them a label=", c->method[i],
                               w->method[i].label);
    }
    w->run.method = w->method;
    return TS_OK;
}

/* All combinations of the grids. */
static ts_code parse_tuning(work *w, ts_status *st)
{
    const ev_command *c = w->c;
    for (int i = 0; i < c->methods; i++)
        if (ev_tune_add(&w->tuning, c->method[i], i, w->model, st) != TS_OK) return st->code;
    for (int i = 0, of = 0; ev_methods[i] && !c->methods; i++)
        if (ev_tune_by_default(ev_methods[i]) &&
            ev_tune_add(&w->tuning, ev_methods[i]->name, of++, w->model, st) != TS_OK)
            return st->code;
    w->run.method = w->tuning.method;
    w->run.methods = w->tuning.methods;
    return TS_OK;
}

/* The table is printed also where a file cannot be written: hours may be in it. */
static int finish(work *w, ts_status *st)
{
    ev_run *r = &w->run;
    if (r->report.results == 0) return cl_failed("no material could be evaluated");
    const char *out = w->c->out;
    ts_code code = w->c->tune ? ev_tune_write(&r->report, out, st) : ev_report_write(&r->report, out, st);
    if (!code && w->c->iterations_figure) code = ev_figure_iterations(&r->report, out, st);
    if (!code && w->c->methods_figure) code = ev_figure_methods(&r->report, out, st);
    if (w->c->tune) ev_tune_print(&w->tuning, &r->report, stdout);
    else ev_report_print(&r->report, stdout);
    if (code) cl_failed("%s", st->message);
    if (r->failures > 0)
        return cl_failed("%d of %" PRId64 " %s failed: they are not in the means", r->failures, w->total,
                         r->methods > 1 ? "estimates" : "materials");
    return code ? CL_FAILED : CL_OK;
}

/* A part of the evaluation. The process that finds all parts writes the results of all. */
static int finish_part(work *w, ts_status *st)
{
    const ev_command *c = w->c;
    const uint64_t print = ev_shards_print(c, &w->run, w->model);
    const int own = w->run.failures;
    ev_parts parts;
    if (!print) return cl_failed("out of memory");
    if (ev_shard_write(&w->run, print, c->out, st) != TS_OK) return cl_failed("%s", st->message);
    const int lock = ev_shards_lock(c->out);
    int code = CL_OK;
    if (ev_shards_merge(&w->run, print, c->out, &parts, st) != TS_OK) code = cl_failed("%s", st->message);
    else if (parts.missing) {
        if (parts.mine && !c->quiet)
            cl_note("part %d of %d is done; %d of the same options, weights and materials are missing, the first is "
                    "part %d: who ends last writes the results",
                    c->shard, c->shards, parts.missing, parts.first);
        if (parts.mine && parts.strange)
            cl_note("%s: %d of the missing parts have files of other options, weights, materials or instruction sets: "
                    "unless another process replaces them now, do those parts again",
                    c->out, parts.strange);
        if (own > 0) code = cl_failed("%d estimates of part %d failed", own, c->shard);
    } else {
        code = finish(w, st);
        if (!st->code) ev_shards_remove(&w->run, c->out); /* else the disk is full: no part has to be done again */
    }
    if (lock >= 0) close(lock);
    return code;
}

/* A folder in which something can be written. */
static ts_code prepare(const char *folder, ts_status *st)
{
    return cl_make_folder(folder, NULL, st) != TS_OK ? st->code : lgd_output_check(folder, st);
}

/* Folders, memory and numbers. */
static int evaluate(work *w, ts_status *st)
{
    const ev_command *c = w->c;
    const char *name[EV_SETS_MAX],
        *slash = strrchr(w->model, '/'); /* where it lay says nothing to whom the report is sent */
    for (int s = 0; s < c->sets; s++) name[s] = c->spec[s];
    if (prepare(c->out, st) != TS_OK) return cl_failed("%s", st->message);
    if (snprintf(w->images, sizeof w->images, "%s/images", c->out) >= (int)sizeof w->images)
        return cl_failed("%s: the name is too long", c->out);
    if (c->images && prepare(w->images, st) != TS_OK) return cl_failed("%s", st->message);
    if (c->pin && !ts_threads_pin()) return cl_failed("--pin: there are fewer CPUs than the %d threads", ts_threads());
    if (c->lpips[0] && !(w->lpips = ev_lpips_load(c->lpips[0], c->lpips[1], st))) return cl_failed("%s", st->message);
    ev_run *r = &w->run;
    r->lpips = w->lpips;
    r->set = w->set;
    r->set_name = name;
    r->sets = c->sets;
    r->size = c->size;
    r->repeat = c->repeat;
    r->seed = (uint64_t)c->seed;
    r->noise = c->noise;
    r->exposure = c->exposure > 0 ? c->exposure : 1;
    r->fit = c->exposure > 0 || c->light_unknown || (c->photographed && !c->light_known);
    r->camera = c->photographed ? &c->camera : NULL;
    r->light_known = c->light_known;
    r->flash = rd_view_from(rd_flash(), c->fov > 0 ? rd_fov_distance(c->fov) : (double)RD_FLASH_DISTANCE);
    for (int k = 0; k < 2; k++) r->flash.light[k] = (float)c->light[k];
    r->flash = rd_view_tilted(r->flash, c->tilt);
    r->perceptual = !c->fast && !c->tune;
    r->exact = c->exact;
    r->pictures = !c->tune;
    r->pinned = c->pin;
    r->model = slash ? slash + 1 : w->model;
    r->images = c->images ? w->images : NULL;
    r->shard = c->shard;
    r->shards = c->shards;
    r->failed = show_failure;
    r->done = show_progress;
    r->user = w;
    for (int s = 0; s < c->sets; s++) w->total += (int64_t)w->set[s].count * r->methods; /* of a part with no work */
    w->bar = cl_progress_start(r->methods != 1 ? "estimate" : "material", 0);
    static const int sizes[] = {128, 256, 512};
    const ts_code code = c->pareto ? ev_pareto(r, sizes, 3, w->model, c->out, st) : ev_run_all(r, st);
    cl_progress_end(&w->bar);
    if (code == TS_INTERRUPTED)
        return cl_stopped("interrupted after %" PRId64 " of %" PRId64 " %s: no results are written", w->done, w->total,
                          r->methods != 1 ? "estimates" : "materials");
    if (code) return cl_failed("%s", st->message);
    if (!c->pareto) return c->shards ? finish_part(w, st) : finish(w, st);
    return r->failures ? cl_failed("%d estimates failed: they are not in the figure", r->failures) : CL_OK;
}

static int refuse(const ts_status *st)
{
    return st->code == TS_INVALID ? cl_usage("%s", st->message) : cl_failed("%s", st->message);
}

static int start(const ev_command *c)
{
    work *w = calloc(1, sizeof *w);
    if (!w) return cl_failed("out of memory");
    ts_status st = {0};
    int code = CL_OK;
    w->c = c;
    for (int s = 0; s < c->sets && code == CL_OK; s++)
        if (ev_set_open(c->spec[s], &c->convention, &w->set[s], &st) != TS_OK) code = refuse(&st);
        else w->set[s].peers = c->peer_maps;
    if (code == CL_OK && ev_usable_options(c, w->set, &st) != TS_OK) code = refuse(&st);
    ts_threads_set(c->threads);
    if (code == CL_OK && lgd_model_path(c->model, LGD_DEFAULT_MODEL, w->model, &st) != TS_OK) code = refuse(&st);
    if (code == CL_OK &&
        ((c->tune         ? parse_tuning(w, &st)
              : c->pareto ? TS_OK
                          : parse_methods(w, &st)) != TS_OK ||
         ev_usable_methods(c, w->run.method, w->run.methods, w->set, &st) != TS_OK))
        code = refuse(&st);
    const bool there = access(c->out, F_OK) == 0;
    if (code == CL_OK) code = evaluate(w, &st);
    if (!there) { /* nothing came into them, or they stay */
        rmdir(w->images);
        rmdir(c->out);
    }
    for (int s = 0; s < c->sets; s++) ev_set_close(&w->set[s]);
    ev_run_free(&w->run);
    ev_lpips_free(&w->lpips);
    ev_tune_free(&w->tuning);
    free(w->method);
    free(w);
    return code;
}

int main(int argc, char **argv)
{
    cl_open_streams();
    ev_command c;
    ts_status st = {0};
    const int bad = cl_init("lgd-eval");
    if (bad) return bad;
    if (ev_command_parse(argc, argv, &c, &st) != TS_OK) return cl_usage("%s", st.message);
    cl_catch_interrupt();
    cl_trace();
    int code = CL_OK;
    if (c.help) ev_command_help();
    else if (c.version) cl_print_version();
    else code = start(&c);
    return cl_finish(code);
}
