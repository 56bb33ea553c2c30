/* lgd-data: procedural materials as map folders, strips, photographs or a contact sheet, and how they compare with
 * others' materials. */
#include "cli/cli.h"
#include "cli/data/histograms.h"
#include "cli/data/new_set.h"
#include "cli/data/options.h"
#include "cli/data/pictures.h"
#include "cli/data/sheet_captures.h"
#include "data/materials/compare.h"
#include "data/sheet.h"
#include "render/render.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static ts_code make_path(char path[4096], const cl_data_options *o, const char *name, const char *suffix, ts_status *st)
{
    if (snprintf(path, 4096, "%s/%s%s", o->output, name, suffix) >= 4096)
        return ts_fail(st, TS_INVALID, "%s: the path is too long", o->output);
    return TS_OK;
}

/* The maps or the capture of a material, a folder that is there when it is complete. */
static ts_code write_folder(const char *path, cl_format format, const io_material *m, ts_status *st)
{
    const bool maps = format == CL_FORMAT_FOLDERS;
    cl_new_set set;
    ts_code code = cl_new_set_begin(&set, path, maps ? "meta.txt" : "camera_pos.txt", st);
    if (code) return code;
    code = maps ? io_write_maps(set.hidden, m, IO_MAPS_ALL, false, st) : cl_write_capture(set.hidden, m, st);
    return cl_new_sets_end(&set, 1, code, st);
}

/* One material and its photograph, to the files that were asked for. */
static ts_code write_material(const cl_data_options *o, uint64_t index, io_material *m, io_image *photo, ts_status *st)
{
    char path[4096];
    rd_view flash = rd_flash();
    io_procedural_make(&o->procedural, index, m);
    ts_code code = o->format ? make_path(path, o, m->name, o->format == CL_FORMAT_STRIPS ? ".png" : "", st) : TS_OK;
    if (code) return code;
    switch (o->format) {
    case CL_FORMAT_NONE: break;
    case CL_FORMAT_FOLDERS:
    case CL_FORMAT_CAPTURES: code = write_folder(path, o->format, m, st); break;
    case CL_FORMAT_STRIPS:
        rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, &flash, true, photo->data);
        code = io_write_strip(path, m, photo, st);
        break;
    case CL_FORMAT_SHEETS:
        code = cl_write_sheet_captures(path, m, o->procedural.seed, index, (int)o->width, (int)o->quality, st);
    }
    if (!code && o->photographs) {
        cl_photograph(&o->camera, o->procedural.seed, index, &flash, m->size, m->maps, photo->data);
        code = make_path(path, o, m->name, ".jpg", st);
        if (!code) code = io_write_jpeg(path, photo, (int)o->quality, st);
    }
    return code;
}

typedef ts_code task(const cl_data_options *o, int64_t number, io_material *m, io_image *photo, io_sheet *sheet,
                     ts_status *st);

static ts_code write_task(const cl_data_options *o, int64_t number, io_material *m, io_image *photo, io_sheet *sheet,
                          ts_status *st)
{
    (void)sheet;
    return write_material(o, (uint64_t)(o->first + number), m, photo, st);
}

static int row_family(const cl_data_options *o, int row)
{
    for (int i = 0; i < io_family_count(); i++)
        if ((!o->procedural.families || o->procedural.families >> i & 1) && row-- == 0) return i;
    return 0;
}

static ts_code sheet_task(const cl_data_options *o, int64_t number, io_material *m, io_image *photo, io_sheet *sheet,
                          ts_status *st)
{
    (void)st;
    int column = (int)(number % sheet->columns), row = (int)(number / sheet->columns);
    io_procedural p = o->procedural;
    p.families = UINT64_C(1) << row_family(o, row);
    rd_view flash = rd_flash();
    io_procedural_make(&p, (uint64_t)(o->first + number), m);
    rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, &flash, true, photo->data);
    io_sheet_put(sheet, column, row, m->maps, photo->data);
    return TS_OK;
}

typedef struct running {
    const cl_data_options *o;
    task *f;
    int size;
    io_sheet *sheet;
    pthread_mutex_t *lock; /* of what follows */
    int64_t *done, *failed;
    cl_progress *progress;
    ts_status *st;
} running;

static void run_tasks(const void *job, ts_queue *queue)
{
    const running *r = job;
    ts_status mine = {0};
    io_material m = {0};
    io_image photo = {0};
    int64_t i, end;
    if (!ts_next(queue, &i, &end)) return;
    ts_code ready = io_material_create(&m, r->size, &mine);
    if (!ready) ready = io_image_create(&photo, r->size, r->size, 3, &mine);
    do {
        pthread_mutex_lock(r->lock);
        const bool skip = *r->failed < i || cl_interrupted();
        pthread_mutex_unlock(r->lock);
        if (skip) continue;
        const ts_code code = ready ? ready : r->f(r->o, i, &m, &photo, r->sheet, &mine);
        pthread_mutex_lock(r->lock);
        if (code && i < *r->failed) {
            *r->failed = i;
            *r->st = mine;
        }
        cl_progress_show(r->progress, ++*r->done, NULL);
        pthread_mutex_unlock(r->lock);
    } while (ts_next(queue, &i, &end));
    io_material_free(&m);
    io_image_free(&photo);
}

/* Runs count tasks on all threads; the first failure (in the order of their numbers) is reported. */
static ts_code run(const cl_data_options *o, const char *what, task *f, int64_t count, int size, io_sheet *sheet,
                   ts_status *st)
{
    int64_t done = 0, failed = count;
    pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    cl_progress progress = cl_progress_start(what, count);
    ts_share_tasks(0, TS_IN_ORDER, count, 1, run_tasks,
                   &(running){o, f, size, sheet, &lock, &done, &failed, &progress, st});
    cl_progress_end(&progress);
    if (st->code == TS_OK && cl_interrupted())
        ts_fail(st, TS_INTERRUPTED, "interrupted after %lld of %lld materials", (long long)done, (long long)count);
    return st->code;
}

static ts_code make_sheet(const cl_data_options *o, ts_status *st)
{
    int rows = 0;
    for (int i = 0; i < io_family_count(); i++) rows += !o->procedural.families || o->procedural.families >> i & 1;
    int64_t columns = o->count ? (o->count + rows - 1) / rows : 3;
    io_sheet sheet = {0};
    char path[4096];
    ts_code code = columns > 1000
        ? ts_fail(st, TS_INVALID, "a contact sheet of %lld materials is too large: ask for fewer", (long long)o->count)
        : TS_OK;
    if (!code) code = io_sheet_create(&sheet, (int)columns, rows, o->size ? (int)o->size : 128, st);
    for (int i = 0, row = 0; !code && i < io_family_count(); i++)
        if (!o->procedural.families || o->procedural.families >> i & 1) io_sheet_name(&sheet, row++, io_family_name(i));
    if (!code) code = run(o, "contact sheet", sheet_task, columns * rows, sheet.size, &sheet, st);
    if (!code) code = make_path(path, o, "contact-sheet", ".png", st);
    if (!code) code = io_write_png(path, &sheet.image, 8, true, st);
    io_image_free(&sheet.image);
    return code;
}

static ts_code check_folder(const char *path, ts_status *st)
{
    struct stat info;
    if (stat(path, &info) != 0) return ts_fail(st, TS_IO, "--testdata: %s: %s", path, strerror(errno));
    return S_ISDIR(info.st_mode) ? TS_OK : ts_fail(st, TS_IO, "--testdata: %s: is not a folder", path);
}

static ts_code compare(const cl_data_options *o, ts_status *st)
{
    const int count = o->count ? (int)o->count : 512, size = o->size ? (int)o->size : 128;
    return io_compare(&o->procedural, (uint64_t)o->first, count, o->testdata, size, stdout, st);
}

static ts_code make_histograms(const cl_data_options *o, ts_status *st)
{
    const int count = o->count ? (int)o->count : 512, size = o->size ? (int)o->size : 128;
    return cl_write_histograms(o->output, &o->procedural, (uint64_t)o->first, count, o->testdata, size, st);
}

int main(int argc, char **argv)
{
    cl_open_streams();
    cl_data_options o = {.quality = 90, .width = 4000, .camera = cl_camera_default};
    ts_status st = {0};
    int code = cl_init("lgd-data");
    if (!code) code = cl_data_options_read(argc, argv, &o);
    if (code) return code;
    ts_threads_set((int)o.threads);
    if (o.testdata && check_folder(o.testdata, &st) != TS_OK) return cl_finish(cl_failed("%s", st.message));
    io_collection *collection = o.collection ? io_collection_read(o.collection, 0, NULL, NULL, &st) : NULL;
    if (st.code) return cl_finish(cl_failed("%s", st.message));
    o.procedural.collection = collection;
    if (!o.statistics || o.output)
        cl_catch_interrupt(); /* statistics alone leave nothing half-done: a signal ends them */
    const bool there = o.output && access(o.output, F_OK) == 0;
    if (o.output) cl_make_folder(o.output, NULL, &st);
    if (!st.code && (o.format || o.photographs))
        run(&o, "materials", write_task, o.count ? o.count : 16, o.size ? (int)o.size : 256, NULL, &st);
    if (!st.code && o.sheet) make_sheet(&o, &st);
    if (!st.code && o.statistics) compare(&o, &st);
    if (!st.code && o.histograms) make_histograms(&o, &st);
    io_collection_free(&collection);
    if (o.output && !there) rmdir(o.output); /* nothing came into it, or it stays */
    if (st.code == TS_INTERRUPTED) return cl_finish(cl_stopped("%s", st.message));
    return cl_finish(st.code ? cl_failed("%s", st.message) : CL_OK);
}
