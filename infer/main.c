/* lgd-infer: maps from flash photographs. */
#include "cli/cli.h"
#include "data/material.h"
#include "infer/encode.h"
#include "infer/lgd.h"
#include "infer/model_path.h"
#include "infer/options.h"
#include "infer/output.h"
#include "infer/plan.h"
#include <stdio.h>
#include <stdlib.h>

typedef struct run {
    const lgd_command *command;
    lgd_model *model;
    cl_progress bar;
    int done, steps;     /* photographs finished; refinement steps of each */
    const char *photo;   /* the one in work */
    double first, last;  /* reconstruction RMSE of R_0 and of the last R_t */
} run;

static int after_step(int step, double rmse, void *user)
{
    run *r = user;
    if (step == 0) r->first = rmse;
    r->last = rmse;
    if (!r->command->quiet) cl_progress_show(&r->bar, (int64_t)r->done * (r->steps + 1) + step + 1, r->photo);
    return cl_interrupted();
}

static void note(run *r, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void note(run *r, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    cl_progress_end(&r->bar);
    cl_note("%s: %s", r->photo, text);
}

/* Says what makes a photograph a poor one: the maps will be guesses. */
static void look_at(run *r, const io_image *photo, const io_image *square)
{
    const int size = square->width, side = photo->width < photo->height ? photo->width : photo->height;
    const int64_t values = (int64_t)size * size * 3;
    int64_t dark = 0, full = 0, over = 0;
    for (int64_t i = 0; i < values; i++) {
        dark += square->data[i] < 1e-3f; /* three of 255 sRGB levels */
        full += square->data[i] > 0.999f;
        over += square->data[i] > 1.001f; /* more than resampling rounds to */
    }
    if (size > side) note(r, "note: upsampled: its square has %d pixels a side and --size is %d", side, size);
    if (dark == values) note(r, "warning: the photograph is black: its maps mean nothing");
    else if (full * 10 > values * 9) note(r, "warning: the photograph is overexposed (%.0f%% of the values): its maps mean little", 100.0 * (double)full / (double)values);
    else if (over > 0) note(r, "note: %.1f%% of the values are above 1 and count as 1", 100.0 * (double)over / (double)values);
}

static ts_code estimate(run *r, const io_image *square, io_material *m, ts_status *st)
{
    const lgd_options options = {.iterations = r->command->iterations, .threads = r->command->threads, .progress = after_step, .user = r};
    lgd_error error;
    float *maps = malloc((size_t)square->width * (size_t)square->width * MAP_CHANNELS * sizeof *maps);
    ts_code code = TS_OK;
    if (!maps) code = ts_fail(st, TS_NOMEM, "out of memory for maps of %d x %d pixels", square->width, square->width);
    else if (lgd_estimate(r->model, square->data, square->width, &options, maps, &error)) code = ts_fail(st, (ts_code)error.code, "%s", error.message);
    else if (cl_interrupted()) code = ts_fail(st, TS_INTERRUPTED, "interrupted");
    else lgd_encode(maps, square->width, m->maps);
    free(maps);
    return code;
}

static ts_code one(run *r, const lgd_job *job, ts_status *st)
{
    const lgd_command *c = r->command;
    io_image photo = {0}, square = {0};
    io_material m = {0};
    ts_code code = io_read_photo(job->photo, c->max_pixels, &photo, st);
    if (!code) {
        code = io_centre_square(&photo, c->size, &square, st);
        if (!code) look_at(r, &photo, &square);
        if (!code) code = io_material_create(&m, c->size, st);
        if (!code) code = estimate(r, &square, &m, st);
        io_metallic_error lost = {0};
        if (!code) code = lgd_output_write(c->out, job->stem, &m, &square, c->outputs, c->directx, &lost, st);
        if (!code && c->outputs & (LGD_OUT_BASECOLOR | LGD_OUT_METALLIC) && !c->quiet)
            note(r, "base colour and metalness miss diffuse by %.4f and F0 by %.4f (RMS, linear)", lost.diffuse, lost.specular);
        if (code) ts_context(st, "%s", job->photo);
    }
    io_image_free(&photo);
    io_image_free(&square);
    io_material_free(&m);
    return code;
}

static int all(run *r, const lgd_plan *plan)
{
    const lgd_command *c = r->command;
    int failed = 0;
    r->bar = cl_progress_start("step", (int64_t)plan->jobs * (r->steps + 1));
    for (; r->done < plan->jobs && !cl_interrupted(); r->done++) {
        const lgd_job *job = &plan->job[r->done];
        ts_status st = {0};
        r->photo = job->photo;
        const ts_code code = one(r, job, &st);
        if (code == TS_INTERRUPTED) break;
        if (code) {
            cl_progress_end(&r->bar);
            cl_failed("%s", st.message);
            failed++;
            continue;
        }
        cl_progress_end(&r->bar);
        printf("%s\n", job->folder);
        fflush(stdout); /* a reader at the other end of a pipe gets each folder when it is there */
        if (!c->quiet && r->steps > 0) note(r, "reconstruction RMSE %.4f (R_0) -> %.4f (R_%d)", r->first, r->last, r->steps);
        else if (!c->quiet) note(r, "reconstruction RMSE %.4f (R_0)", r->first);
    }
    cl_progress_end(&r->bar);
    if (cl_interrupted()) return cl_failed("interrupted: %d of %d photographs are done", r->done - failed, plan->jobs);
    if (failed > 0 && plan->jobs > 1) return cl_failed("%d of %d photographs failed", failed, plan->jobs);
    return failed > 0 ? CL_FAILED : CL_OK;
}

static void print_help(void)
{
    puts("Usage: lgd-infer [options] PHOTO... -o DIR\n"
         "Estimates the material of a flat surface from a photograph taken straight on with a flash beside the lens.\n"
         "The largest centred square is used.\n");
    lgd_argument_help(lgd_infer_arguments, stdout);
    puts("\n"
         "DIR/STEM/ gets diffuse.png, specular.png (sRGB), roughness.png, normal.png (linear), maps.exr (all channels, linear\n"
         "float), meta.txt (what these mean), render.png (the photograph beside the re-rendered one) and preview.png (four light\n"
         "positions). A photograph's files appear together when they are complete. Each finished folder is printed on standard\n"
         "output; the reconstruction RMSE before and after refinement goes to standard error. Two photographs with the same STEM\n"
         "are refused before any work.\n"
         "Exit status: 0 done, 1 a photograph failed (the others are done), 2 wrong usage.");
}

static int work(const lgd_command *c)
{
    ts_status st = {0};
    lgd_error error;
    lgd_plan plan;
    char weights[LGD_PATH_MAX];
    if (lgd_plan_make(c->photo, c->photos, c->out, &plan, &st) != TS_OK) return cl_usage("%s", st.message);
    run r = {.command = c};
    int code = CL_FAILED;
    if (lgd_model_path(c->model, weights, &st) != TS_OK) cl_failed("%s", st.message);
    else if (!(r.model = lgd_load(weights, &error))) cl_failed("%s", error.message);
    else if (cl_make_folder(c->out, &st) != TS_OK || lgd_output_check(c->out, &st) != TS_OK) cl_failed("%s", st.message);
    else {
        r.steps = c->iterations < 0 ? lgd_trained_iterations(r.model) : c->iterations;
        code = all(&r, &plan);
    }
    lgd_free(&r.model);
    lgd_plan_free(&plan);
    return code;
}

int main(int argc, char **argv)
{
    lgd_command c;
    ts_status st = {0};
    const int bad = cl_init("lgd-infer");
    if (bad) return bad;
    if (lgd_command_parse(argc, argv, &c, &st) != TS_OK) return cl_usage("%s", st.message);
    cl_catch_interrupt();
    int code = CL_OK;
    if (c.help) print_help();
    else if (c.version) cl_print_version();
    else code = work(&c);
    return cl_finish(code);
}
