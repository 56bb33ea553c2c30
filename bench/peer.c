/* The peer: bench/peer_torch.py at the other end of two pipes, started at its first job. */
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
static char name[128] = "PyTorch";

/* The one that make bench-deps made, and the system's. */
static const char *const interpreters[] = {"build/venv/bin/python3", "/usr/bin/python3"};

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
    const char *answer = ask("version");
    if (child < 0 || !*answer || *answer == '-') return stop(), false;
    snprintf(name, sizeof name, "%s", answer);
    char threads[32];
    snprintf(threads, sizeof threads, "threads %d", ts_threads());
    ask(threads);
    if (bench_cpu()) ask("clock cpu");
    return true;
}

static void start(void)
{
    asked = true;
    if (start_with(interpreters[0]) || start_with(interpreters[1])) atexit(stop);
    else printf("  (there is no PyTorch here: make bench-deps gets one; its column stays empty)\n");
}

double bench_peer(const char *job)
{
    if (!asked) start();
    if (!to) return NAN;
    const char *answer = ask(job);
    char *end;
    const double seconds = strtod(answer, &end);
    if (end != answer && *answer != '-') return seconds;
    printf("  (%s: %s)\n", name, *answer ? answer + 2 : "it ended");
    if (!*answer) stop();
    return NAN;
}

const char *bench_peer_name(void) { return name; }

void bench_row_peer_bf16(bench_time t, const char *job)
{
    char rounded[300];
    snprintf(rounded, sizeof rounded, "bf16 %s", job);
    const double peer = bench_peer(rounded);
    if (isfinite(peer)) printf("    %s in bf16 %.3f ms: %.2f x ours\n", name, 1e3 * peer, peer / t.seconds);
    fflush(stdout);
}

void bench_row_peer(bench_time t, double flop, double peer)
{
    printf("    floor %.3f ms", 1e3 * flop / t.peak);
    if (isfinite(peer)) printf(", %s %.3f ms: %.2f x ours", name, 1e3 * peer, peer / t.seconds);
    printf("\n");
    fflush(stdout);
}
