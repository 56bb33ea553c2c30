/* The peers: bench/peer_torch.py at the other end of two pipes, started at its first job. */
#include "bench/bench.h"
#include "tensor/threads.h"
#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static FILE *to, *from;
static pid_t child;
static bool asked;

static struct engine {
    const char *word, *absent; /* of the jobs; what a line about one that is not there calls it */
    char name[128];            /* "" where it is not there */
} engines[] = {{"eager", "eager PyTorch", ""}, {"compile", "torch.compile", ""}, {"openvino", "OpenVINO", ""}};
enum { ENGINES = sizeof engines / sizeof *engines };

static void stop(void)
{
    if (to) fclose(to);
    if (from) fclose(from);
    to = from = NULL;
    if (child > 0) waitpid(child, NULL, 0);
    child = 0;
}

/* The answer's line, "" at the end. */
static const char *ask(const char *job)
{
    static char line[512];
    line[0] = 0;
    if (to) fprintf(to, "%s\n", job), fflush(to);
    if (from && !fgets(line, sizeof line, from)) line[0] = 0;
    line[strcspn(line, "\n")] = 0;
    return line;
}

static bool start_with(const char *interpreter)
{
    int there[2], back[2];
    if (access(interpreter, X_OK) || pipe(there)) return false;
    if (pipe(back)) return close(there[0]), close(there[1]), false;
    signal(SIGPIPE, SIG_IGN);
    child = fork();
    if (child == 0) {
        dup2(there[0], 0), dup2(back[1], 1);
        close(there[0]), close(there[1]), close(back[0]), close(back[1]);
        execl(interpreter, interpreter /* by which Python finds its environment */, "bench/peer_torch.py",
              (char *)NULL);
        _exit(127);
    }
    close(there[0]), close(back[1]);
    to = fdopen(there[1], "w");
    from = fdopen(back[0], "r");
    char text[64];
    snprintf(text, sizeof text, "threads %d", ts_threads());
    const char *answer = ask(text);
    if (child < 0 || !*answer || *answer == '-') return stop(), false;
    if (bench_cpu()) ask("clock cpu");
    for (int i = 0; i < ENGINES; i++) {
        struct engine *e = &engines[i];
        snprintf(text, sizeof text, "%s version", e->word);
        answer = ask(text);
        if (*answer && *answer != '-') snprintf(e->name, sizeof e->name, "%s", answer);
        else printf("  (%s: skipped, %s; make bench-deps gets it)\n", e->absent, *answer ? answer + 2 : "it ended");
    }
    return true;
}

static void start(void)
{
    asked = true;
    char made[4096]; /* by make bench-deps; then the system's */
    const char *build = getenv("BUILD");
    snprintf(made, sizeof made, "%s/venv/bin/python3", build && *build ? build : "build");
    if (start_with(made) || start_with("/usr/bin/python3")) atexit(stop);
    else printf("  (peers skipped: there is no PyTorch here; make bench-deps gets it, torch.compile and OpenVINO)\n");
}

/* Median seconds that an engine takes for a job; NaN when it has none for it, which is said. */
static double seconds_of(const struct engine *e, const char *job)
{
    char text[320];
    snprintf(text, sizeof text, "%s %s", e->word, job);
    const char *answer = ask(text);
    char *end;
    const double seconds = strtod(answer, &end);
    if (end != answer && *answer != '-') return seconds;
    printf("    (%s: %s)\n", e->name, *answer ? answer + 2 : "it ended");
    if (!*answer) stop();
    return NAN;
}

void bench_row_peers(bench_time t, double flop, const char *job)
{
    double seconds[ENGINES], least = INFINITY;
    if (!asked) start();
    printf("    floor %.3f ms\n", 1e3 * flop / t.peak);
    for (int i = 0; i < ENGINES; i++) {
        seconds[i] = to && *engines[i].name ? seconds_of(&engines[i], job) : NAN;
        if (seconds[i] < least) least = seconds[i];
    }
    for (int i = 0; i < ENGINES; i++)
        if (isfinite(seconds[i]))
            printf("    %s%s %.3f ms: %.2f x ours%s\n", engines[i].name, strncmp(job, "bf16 ", 5) == 0 ? ", bf16" : "",
                   1e3 * seconds[i], seconds[i] / t.seconds, seconds[i] <= least ? ", the strongest" : "");
    fflush(stdout);
}
