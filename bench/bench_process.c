/* lgd-infer as a process, from the command to maps on disk: one photograph and a folder of them. Wall time of processes
 * in turn; the computing alone is the library's call in this process, when everything is warm. */
#include "bench/bench.h"
#include "data/image/image.h"
#include "infer/lgd.h"
#include "infer/model_path.h"
#include "tensor/rng.h"
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { SIDE = 256, ROUNDS = 7, FOLDER = 26, MOST_ARGUMENTS = FOLDER + 16, NAME = 300 };
static const char photograph[] = "demo/flash.jpg";
extern char **environ;

/* A program with its words, without what it prints. Its exit status, or -1. */
static int run(const char *const *argv)
{
    posix_spawn_file_actions_t actions;
    pid_t child;
    int status = -1;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    if (posix_spawnp(&child, argv[0], &actions, NULL, (char *const *)(uintptr_t)argv, environ) ||
        waitpid(child, &status, 0) != child)
        status = -1;
    posix_spawn_file_actions_destroy(&actions);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

typedef struct command {
    const char *label;
    const char *word[8]; /* after the program's name */
    int photographs, status;
    bool large; /* the photograph is one as a telephone takes it */
    double time[ROUNDS];
} command;

enum { WIDE = 4032, TALL = 3024 };

/* A photograph with the pixels, the noise and the bytes of a telephone's. */
static bool make_large(const char *path)
{
    io_image square = {0}, large = {0};
    ts_status st = {0};
    ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, 0);
    bool fine = !io_read_photo_square(photograph, 1 << 24, TALL, 0, &square, NULL, &st) &&
        !io_image_create(&large, WIDE, TALL, 3, &st);
    for (int y = 0; y < TALL && fine; y++)
        for (int x = 0; x < WIDE; x++)
            for (int c = 0; c < 3; c++)
                large.data[((size_t)y * WIDE + (size_t)x) * 3 + (size_t)c] =
                    square.data[((size_t)y * TALL + (size_t)(x % TALL)) * 3 + (size_t)c] *
                    ts_rng_range(&rng, 0.97f, 1.03f);
    fine = fine && !io_write_jpeg(path, &large, 85, &st);
    if (!fine) printf("  no large photograph: %s\n", st.message);
    io_image_free(&square), io_image_free(&large);
    return fine;
}

static bool round_of(command *c, int round, const char *program, const char *out, char (*link)[NAME], const char *large)
{
    const char *argv[MOST_ARGUMENTS] = {program, "-q", "-o", out};
    int n = 4;
    for (const char *const *w = c->word; *w; w++) argv[n++] = *w;
    for (int i = 0; i < c->photographs; i++) argv[n++] = c->large ? large : link[i];
    const double begin = bench_wall();
    const int status = run(argv);
    c->time[round] = bench_wall() - begin;
    if (status != c->status) printf("  %s: exit status %d\n", c->label, status);
    return status == c->status;
}

typedef struct call {
    lgd_model *model;
    io_image image;
    float *maps;
    double power;
} call;

static void estimate(void *user)
{
    call *c = user;
    lgd_error e;
    lgd_options o = lgd_options_default();
    o.power = &c->power;
    if (lgd_estimate(c->model, c->image.data, SIDE, &o, c->maps, &e)) abort();
}

/* The median time of the library's call; 0 when it fails. */
static double computing(void)
{
    char path[PATH_MAX];
    ts_status st = {0};
    lgd_error e = {0};
    call c = {.maps = malloc(SIDE * SIDE * 9 * sizeof(float))};
    double t = 0;
    if (!c.maps || lgd_model_path(NULL, LGD_DEFAULT_MODEL, path, &st) || !(c.model = lgd_load(path, &e)) ||
        io_read_photo_square(photograph, 1 << 24, SIDE, 0, &c.image, NULL, &st))
        printf("  the computing was not measured: %s\n", st.code ? st.message : e.message);
    else {
        const bench_time time = bench_measure(estimate, &c);
        t = time.seconds;
        bench_row_unit("the computing alone, in a library", time, 1 / t, "photographs/s");
    }
    io_image_free(&c.image);
    lgd_free(&c.model);
    free(c.maps);
    return t;
}

BENCH(process)
{
    static command all[] = {
        {.label = "--help", .word = {"--help"}},
        {.label = "a wrong option", .word = {"--nonsense"}, .status = 2},
        {.label = "one photograph, -i 0 --maps diffuse", .word = {"-i", "0", "--maps", "diffuse"}, .photographs = 1},
        {.label = "one photograph, four maps",
         .word = {"--maps", "diffuse,specular,roughness,normal"},
         .photographs = 1},
        {.label = "one photograph, every file", .photographs = 1},
        {.label = "one photograph, every file, --precision bf16", .word = {"--precision", "bf16"}, .photographs = 1},
        {.label = "one photograph of 4032 x 3024 pixels, four maps",
         .word = {"--maps", "diffuse,specular,roughness,normal"},
         .photographs = 1,
         .large = true},
        {.label = "26 photographs, four maps",
         .word = {"--maps", "diffuse,specular,roughness,normal"},
         .photographs = FOLDER},
        {.label = "26 photographs, every file", .photographs = FOLDER},
        {.label = "26 photographs, every file, --threads 1", .word = {"--threads", "1"}, .photographs = FOLDER}};
    enum { COMMANDS = sizeof all / sizeof *all, ONE_FOUR_MAPS = 3 };
    static char link[FOLDER][NAME];
    char folder[NAME / 2], own[PATH_MAX] = "", program[PATH_MAX + 16], out[NAME], large[NAME], source[PATH_MAX];
    bool fine = true;
    bench_heading("lgd-infer as a process, 256 x 256 (medians of seven, in turn)");
    const char *temporary = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/lgd-bench-XXXXXX", temporary && *temporary ? temporary : P_tmpdir);
    if (readlink("/proc/self/exe", own, sizeof own - 1) <= 0 || !realpath(photograph, source) || !mkdtemp(folder)) {
        printf("  no %s here, or no room for files: nothing is measured\n", photograph);
        return;
    }
    snprintf(program, sizeof program, "%s/lgd-infer", dirname(own));
    snprintf(out, sizeof out, "%s/out", folder);
    for (int i = 0; i < FOLDER; i++) {
        snprintf(link[i], NAME, "%s/%d.jpg", folder, i);
        fine = fine && symlink(source, link[i]) == 0;
    }
    snprintf(large, sizeof large, "%s/large.jpg", folder);
    fine = fine && make_large(large);
    const double warm = computing();
    for (int round = -1; round < ROUNDS && fine; round++) /* the first warms up */
        for (int i = 0; i < COMMANDS && fine; i++)
            fine = round_of(&all[i], round < 0 ? 0 : round, program, out, link, large);
    for (int i = 0; i < COMMANDS && fine; i++) {
        bench_sort(all[i].time, ROUNDS);
        const bench_time t = {.seconds = all[i].time[ROUNDS / 2]};
        if (all[i].photographs > 1) bench_row_unit(all[i].label, t, all[i].photographs / t.seconds, "photographs/s");
        else bench_row(all[i].label, t, 0);
        if (i == ONE_FOUR_MAPS && warm > 0) printf("    beyond the computing: %.1f ms\n", 1e3 * (t.seconds - warm));
    }
    run((const char *const[]){"rm", "-r", folder, NULL});
}
