/* lgd-train as two processes of one thread against one process of two threads: the same batches, in turn, patches a
 * second of the steps after the first ones. Both have the machine's loader thread beside them. */
#include "bench/bench.h"
#include "tensor/threads.h"
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <math.h>
#include <spawn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { ROUNDS = 5, WARM = 3, MOST_STEPS = 40, PATH = PATH_MAX + 100, MOST_WORDS = 32 };
extern char **environ;

/* Runs the words with both streams into the file at messages. */
static bool run(const char *const *word, const char *messages)
{
    posix_spawn_file_actions_t actions;
    pid_t child;
    int status = -1;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, messages, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    if (posix_spawnp(&child, word[0], &actions, NULL, (char *const *)(uintptr_t)word, environ) ||
        waitpid(child, &status, 0) != child)
        status = -1;
    posix_spawn_file_actions_destroy(&actions);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/* The median of log.csv's samples_per_s, the last column but one, after the first rows; NaN where there is none. */
static double speed_in(const char *log)
{
    double speed[MOST_STEPS];
    char line[1024];
    int rows = -1, n = 0;
    FILE *f = fopen(log, "re");
    for (; f && n < MOST_STEPS && fgets(line, sizeof line, f); rows++) {
        char *skipped = strrchr(line, ',');
        if (rows < WARM || !skipped) continue;
        *skipped = 0;
        const char *value = strrchr(line, ',');
        if (value) speed[n++] = atof(value + 1);
    }
    if (f) fclose(f);
    return n > 0 ? bench_median(speed, n) : (double)NAN;
}

/* What the ranks say of their waiting at the end. */
static void show_waiting(const char *messages)
{
    char line[1024];
    FILE *f = fopen(messages, "re");
    while (f && fgets(line, sizeof line, f)) {
        const char *from = strstr(line, "a step took");
        if (from) printf("    %s", from);
    }
    if (f) fclose(f);
}

static void compare(const char *config, const char *phase, int steps, const char *folder, const char *program)
{
    char out[PATH], log[PATH], messages[PATH], set_out[PATH + 32], set_steps[64];
    const char
        *alone[] = {program, config, "--threads", "2", NULL, NULL},
        *ranks[] = {
            "mpirun", "--allow-run-as-root", "--oversubscribe", "-np", "2", program, config, "--threads", "1", NULL,
            NULL};
    double time[2][ROUNDS], ratio[ROUNDS];
    snprintf(out, sizeof out, "%s/run", folder);
    snprintf(log, sizeof log, "%s/run/log.csv", folder);
    snprintf(messages, sizeof messages, "%s/messages", folder);
    snprintf(set_out, sizeof set_out, "output.folder=%s", out);
    snprintf(set_steps, sizeof set_steps, "train.%s=%d", phase, WARM + steps);
    const bool pretrains = !strcmp(phase, "pretrain_steps");
    const char *const more[] = {"--set", set_out,
                                "--set", set_steps,
                                "--set", pretrains ? "train.steps=0" : "train.pretrain_steps=0",
                                "--set", "validate.every=0",
                                "--set", "train.checkpoint_every=1000",
                                NULL};
    for (int round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < 2; k++) {
            const char *word[MOST_WORDS];
            int n = 0;
            for (const char *const *w = k ? ranks : alone; *w; w++) word[n++] = *w;
            for (const char *const *w = more; *w; w++) word[n++] = *w;
            word[n] = NULL;
            run((const char *const[]){"rm", "-rf", out, NULL}, messages);
            if (!run(word, messages) || !(time[k][round] = speed_in(log), time[k][round] > 0)) {
                printf("  %s does not train %s here: nothing is measured\n", word[0], config);
                return;
            }
        }
        ratio[round] = time[1][round] / time[0][round];
    }
    const double one = bench_median(time[0], ROUNDS), two = bench_median(time[1], ROUNDS);
    char label[160];
    snprintf(label, sizeof label, "%s, one process, two threads", config);
    bench_row_unit(label, (bench_time){.seconds = 1 / one}, one, "patches/s");
    snprintf(label, sizeof label, "%s, two ranks, one thread each", config);
    bench_row_unit(label, (bench_time){.seconds = 1 / two}, two, "patches/s");
    printf("    two ranks are %.3f times as fast (median of %d, in turn)\n", bench_median(ratio, ROUNDS), ROUNDS);
    show_waiting(messages);
}

BENCH(mpi)
{
    char folder[PATH_MAX / 2], own[PATH_MAX] = "", program[PATH];
    const char *temporary = getenv("TMPDIR");
    bench_heading("lgd-train under mpirun: a patch, as a step's time over its batch");
    snprintf(folder, sizeof folder, "%s/lgd-bench-XXXXXX", temporary && *temporary ? temporary : P_tmpdir);
    if (readlink("/proc/self/exe", own, sizeof own - 1) <= 0 || !mkdtemp(folder)) {
        printf("  no room for files: nothing is measured\n");
        return;
    }
    snprintf(program, sizeof program, "%s/lgd-train", dirname(own));
    compare("configs/single-phone.ini", "pretrain_steps", 12, folder, program); /* half a second each */
    compare("configs/single-g.ini", "pretrain_steps", MOST_STEPS, folder, program);
    compare("configs/tiny.ini", "pretrain_steps", MOST_STEPS, folder, program);
    run((const char *const[]){"rm", "-r", folder, NULL}, "/dev/null");
}
