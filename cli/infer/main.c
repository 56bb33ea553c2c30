/* lgd-infer: maps from flash photographs. */
#include "cli/cli.h"
#include "cli/infer/index.h"
#include "cli/infer/manifest.h"
#include "cli/infer/options.h"
#include "cli/infer/pipeline.h"
#include "cli/infer/record.h"
#include "cli/infer/say.h"
#include "cli/operands.h"
#include "data/capture_ini.h"
#include "infer/api_model.h"
#include "infer/model_path.h"
#include "infer/output.h"
#include "infer/photograph.h"
#include "tensor/budget.h"
#include "tensor/hash.h"
#include "tensor/threads.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct run {
    const cl_command *command;
    lgd_model *model;
    pthread_mutex_t lock; /* of the bar and of what is printed */
    cl_progress bar;
    double shown;                  /* photographs that the bar has, and parts of such */
    int jobs, done, failed, there; /* photographs: all, with complete files, without, done by an earlier call */
    int steps;                     /* refinement steps of each */
    FILE *poor;                    /* a line for each photograph whose maps should be looked at, into text */
    char *text;
    size_t size;
    cl_index index;
    ts_status index_st;
    bool left_out;         /* photographs of a sheet that could not be used */
    cl_manifest *manifest; /* or NULL */
    ts_status manifest_st;
} run;

static int show(cl_item *item, double done, void *user)
{
    run *r = user;
    pthread_mutex_lock(&r->lock);
    r->shown += done - item->shown;
    item->shown = done;
    if (!r->command->quiet) cl_progress_show(&r->bar, (int64_t)(r->shown * (r->steps + 1) + 0.5), item->job->photo);
    pthread_mutex_unlock(&r->lock);
    return cl_interrupted();
}

static void report(run *r, const cl_item *item)
{
    cl_progress_end(&r->bar);
    if (item->was_done) {
        r->there++;
        return;
    }
    r->left_out = !cl_say_sheet(item, r->command->quiet) || r->left_out;
    const char *why = r->command->quiet ? NULL : cl_say_photo(r->command, item);
    if (why && r->poor) fprintf(r->poor, "%s: %s\n", item->job->photo, why);
    if (item->st.code) {
        cl_failed("%s", item->st.message);
        r->failed++;
        return;
    }
    r->done++;
    if (r->command->quiet) return;
    cl_say_replaced(item);
    printf("%s\n", item->job->folder);
    cl_flush(); /* a reader at the other end of a pipe gets each folder when it is there */
}

/* How many, how long, which to look at. */
static void sum_up(run *r, double seconds)
{
    if (r->there) cl_note("%d of %d photographs were complete already", r->there, r->jobs);
    cl_note("%d of %d photographs done in %.1f s%s", r->done, r->jobs, seconds,
            r->poor && fflush(r->poor) == 0 && r->size > 0 ? "; look at:" : "");
    for (char *line = r->text, *next; line && *line; line = next) {
        next = strchr(line, '\n');
        if (next) *next++ = 0;
        cl_note("  %s", line);
    }
}

static void finished(const cl_item *item, void *user)
{
    run *r = user;
    if (item->st.code == TS_INTERRUPTED) return;
    pthread_mutex_lock(&r->lock);
    r->shown += 1 - item->shown; /* of one that failed or ended early too */
    report(r, item);
    if (r->manifest && !r->manifest_st.code) cl_manifest_add(r->manifest, item, &r->manifest_st);
    if (!r->index_st.code) cl_index_add(&r->index, item, &r->index_st);
    pthread_mutex_unlock(&r->lock);
}

static int all(run *r, cl_pipeline *pipeline, const char *recipe)
{
    const double start = cl_seconds();
    r->poor = open_memstream(&r->text, &r->size); /* without it no names are printed */
    r->bar = cl_progress_start("step", (int64_t)r->jobs * (r->steps + 1));
    cl_pipeline_run(pipeline, r->model, recipe, &(cl_listener){show, finished, cl_interrupted, r});
    cl_progress_end(&r->bar);
    if (!r->command->quiet && (r->jobs > 1 || r->there)) sum_up(r, cl_seconds() - start);
    if (r->poor) fclose(r->poor);
    free(r->text);
    if (cl_interrupted() && r->done + r->failed + r->there < r->jobs)
        return cl_stopped("interrupted: %d of %d photographs are done", r->done + r->there, r->jobs);
    if (r->failed > 0 && r->jobs > 1) return cl_failed("%d of %d photographs failed", r->failed, r->jobs);
    return r->failed > 0 || r->left_out ? CL_FAILED : CL_OK;
}

static void print_help(void)
{
    puts("Usage: lgd-infer [options] PHOTO|FOLDER|@LIST... -o DIR\n"
         "  or:  lgd-infer [options] --corners X,Y X,Y X,Y X,Y PHOTO -o DIR\n"
         "  or:  lgd-infer [options] --sheet PHOTO|FOLDER|@LIST... -o DIR\n"
         "  or:  lgd-infer [options] --capture WHERE -o DIR\n"
         "Estimates the material of a flat surface from a photograph taken straight on with a flash beside the lens.\n"
         "The largest centred square is used. FOLDER stands for the photographs in it, LIST is a file or a pipe that "
         "names one a\n"
         "line, @- is standard input; a photograph whose name begins with @ is written ./@NAME.\n");
    cl_argument_help(cl_infer_arguments, stdout);
    puts("\n"
         "DIR/STEM/ gets diffuse.png, specular.png (sRGB), roughness.png, normal.png (linear), maps.exr (all channels, "
         "linear),\n"
         "meta.txt (what these mean), render.png (the photograph beside the re-rendered one) and preview.png "
         "(four light\n"
         "positions). A photograph's files appear together when they are complete. Each finished folder is printed on "
         "standard\n"
         "output; what was assumed and the difference of the maps' rendering from the photograph (RMSE of linear "
         "values),\n"
         "at first and after the steps, go to standard error. Two photographs with the same STEM\n"
         "are refused before any work; one that is given twice counts once. Of several, DIR/results.jsonl gets a line "
         "for each.\n"
         "Exit status: 0 done, 1 a photograph failed (the others are done), 2 wrong usage, 130 interrupted (what is "
         "complete stays).");
}

static void say_failed(const char *message) { cl_failed("%s", message); }

/* Once everything is done, or nothing could be. */
static int end_index(run *r, int code)
{
    const bool any = r->index.materials + r->index.failed > 0;
    if (cl_index_end(&r->index, r->command->out, &r->index_st) != TS_OK) return cl_failed("%s", r->index_st.message);
    if (any && !r->command->quiet)
        cl_note("%s/%s shows %s", r->command->out, CL_INDEX_NAME,
                r->done + r->failed + r->there < r->jobs ? "those" : "all of them");
    return code;
}

static int end_manifest(run *r, int code)
{
    ts_status own = {0}, *st = r->manifest_st.code ? &r->manifest_st : &own;
    cl_manifest_close(&r->manifest, &own);
    return st->code ? cl_failed("%s", st->message) : code;
}

/* What is read beside the plan's photographs is not replaced either. */
static ts_code spare(const cl_command *c, const cl_plan *plan, ts_status *st)
{
    char *file[IO_CAPTURE_IMAGES];
    int files = 0;
    ts_code code = c->mask ? cl_plan_check(plan, "mask", &c->mask, 1, st) : TS_OK;
    if (!code && c->sheet) code = cl_plan_check(plan, "photograph", (const char *const *)c->photo, c->photos, st);
    struct stat about;
    if (code || !*c->capture || stat(c->capture, &about) || !S_ISREG(about.st_mode))
        return code; /* a pipe is read once */
    io_capture_ini_files(c->capture, file, &files,
                         &(ts_status){0}); /* of one that cannot be read, the reader says it */
    code = cl_plan_check(plan, "photograph", (const char *const *)file, files, st);
    for (int i = 0; i < files; i++) free(file[i]);
    return code;
}

/* The part of the work; its pages and its list. several: not a lone photograph, whose own page and meta.txt are
 * enough. */
static ts_code settle(run *r, cl_plan *plan, bool several, ts_status *st)
{
    const cl_command *c = r->command;
    if (spare(c, plan, st) != TS_OK) return st->code;
    if (several && cl_manifest_check(plan, c->out, st) != TS_OK) return st->code;
    if (c->shards) cl_plan_keep(plan, c->shard, c->shards);
    r->jobs = plan->jobs;
    /* No part knows the others' materials. */
    return c->outputs & LGD_OUT_PAGE && several && !c->shards ? cl_index_start(&r->index, plan, c->out, st) : TS_OK;
}

/* Of two threads the decoder is one meanwhile: a worker would only take turns with it. */
static lgd_model *load_beside_decoder(const cl_command *c, const char *weights, lgd_error *error)
{
    if (ts_threads() == 2) ts_threads_set(1);
    lgd_model *model = lgd_load(weights, error);
    ts_threads_set(c->threads);
    return model;
}

static int work(const cl_command *given)
{
    cl_command own = *given;
    const cl_command *const c = &own;
    ts_status st = {0};
    cl_operands operands = {0};
    lgd_error error;
    cl_plan plan;
    char weights[LGD_PATH_MAX], *recipe = NULL;
    if (!*c->capture && cl_operands_expand(c->photo, c->photos, say_failed, &operands, &st) != TS_OK)
        return st.code == TS_INTERRUPTED ? cl_stopped("%s", st.message) : cl_failed("%s", st.message);
    if (!*c->capture) own.photo = operands.photo, own.photos = operands.photos;
    char *const *photo = c->photo;
    const int photos = c->photos, missing = operands.failed;
    if (photos == 0) return CL_FAILED;
    if ((c->corners && photos > 1) || (c->sheet && photos > IO_SOLVE_MOST)) {
        const int most = c->corners ? 1 : IO_SOLVE_MOST;
        const int code = cl_usage("--%s takes %d photograph%s at most: '%s' is one too many",
                                  c->corners ? "corners" : "sheet", most, most > 1 ? "s" : "", photo[most]);
        cl_operands_free(&operands);
        return code;
    }
    if (c->sheet) own.photos = cl_plan_distinct(operands.photo, photos);
    const ts_code bad = cl_plan_make(photo, c->sheet ? 1 : photos, c->out, &plan, &st);
    if (bad) {
        cl_operands_free(&operands);
        return bad == TS_INVALID ? cl_usage("%s", st.message) : cl_failed("%s", st.message);
    }
    ts_threads_set(c->threads);
    ts_budget_set(c->max_memory);
    /* A sheet is one material. */
    const bool several = !c->sheet && (plan.jobs > 1 || strcmp(photo[0], given->photo[0]) != 0);
    run r = {.command = c, .lock = PTHREAD_MUTEX_INITIALIZER};
    if (settle(&r, &plan, several, &st) != TS_OK) {
        cl_plan_free(&plan);
        cl_operands_free(&operands);
        return st.code == TS_INVALID ? cl_usage("%s", st.message) : cl_failed("%s", st.message);
    }
    int code = CL_FAILED;
    uint64_t hash;
    bool published = false;
    size_t made = 0;
    cl_pipeline *pipeline = NULL;
    if (lgd_model_path(c->model, LGD_DEFAULT_MODEL, weights, &st) != TS_OK) cl_failed("%s", st.message);
    else if (lgd_weights_published(weights, &published, &st) != TS_OK ||
             (c->skip_existing &&
              (ts_hash_file(weights, &hash, &st) != TS_OK || !(recipe = cl_recipe(c, weights, hash, &st)))))
        cl_failed("%s", st.message);
    else if (!(pipeline = cl_pipeline_start(&plan, c, recipe, published, &st)))
        cl_failed("%s", st.message); /* decodes while the weights are read */
    else if (!(r.model = load_beside_decoder(c, weights, &error))) cl_failed("%s", error.message);
    else if (!recipe && !(recipe = cl_recipe(c, weights, lgd_model_hash(r.model), &st))) cl_failed("%s", st.message);
    else if (cl_command_suits(c, r.model, &st) != TS_OK) code = cl_usage("%s", st.message);
    else if (cl_make_folder(c->out, &made, &st) != TS_OK || lgd_output_check(c->out, &st) != TS_OK ||
             (several && !(r.manifest = cl_manifest_open(&plan, c->out, &st))))
        cl_failed("%s", st.message);
    else {
        if (plan.jobs == 1) lgd_model_single(r.model);
        r.steps = cl_command_steps(c, r.model, *c->capture ? 2 : c->sheet ? c->photos : 1);
        code = all(&r, pipeline, recipe);
        if (code == CL_OK && missing) code = CL_FAILED;
        code = end_manifest(&r, code);
    }
    code = end_index(&r, code);
    cl_pipeline_end(&pipeline);
    cl_remove_made(c->out, made); /* nothing came into it, or it stays */
    lgd_free(&r.model);
    cl_plan_free(&plan);
    cl_operands_free(&operands);
    free(recipe);
    return code;
}

int main(int argc, char **argv)
{
    cl_open_streams();
    cl_command c;
    ts_status st = {0};
    const int bad = cl_init("lgd-infer");
    if (bad) return bad;
    if (cl_command_parse(argc, argv, &c, &st) != TS_OK) return cl_usage("%s", st.message);
    cl_catch_interrupt();
    cl_trace();
    int code = CL_OK;
    if (c.help) print_help();
    else if (c.version) cl_print_version();
    else code = work(&c);
    return cl_finish(code);
}
