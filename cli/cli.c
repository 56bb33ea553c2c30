#include "cli/cli.h"
#include "tensor/cpu.h"
#include "tensor/new_file.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static const char *program_name = "lgd", *speaker = "";

void cl_open_streams(void)
{
    for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; fd++) {
        if (fcntl(fd, F_GETFD) != -1 || errno != EBADF) continue;
        if (open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY) == fd) continue; /* the least that is free */
        static const char message[] = "lgd: a standard stream is closed and /dev/null cannot be opened in its place\n";
        (void)!write(STDERR_FILENO, message, sizeof message - 1);
        _exit(CL_FAILED);
    }
}

/* Called inside of parallel loops, whose other threads go on: nothing is freed, nothing more is written. */
static void no_scratch(size_t bytes)
{
    char line[128];
    const int n = snprintf(line, sizeof line, "%s: out of memory: a thread needs %zu bytes to compute in\n",
                           program_name, bytes);
    (void)!write(STDERR_FILENO, line, (size_t)n);
    _exit(CL_FAILED);
}

/* Called by any thread, so that the line is one write. */
static void fewer_threads(int threads, int wanted)
{
    char line[192];
    if (!speaker) return;
    const int n = snprintf(line, sizeof line, "%s: %s%sthe system refuses threads (see ulimit -u): %d of %d compute\n",
                           program_name, speaker, *speaker ? ": " : "", threads, wanted);
    (void)!write(STDERR_FILENO, line, (size_t)n);
}

int cl_init(const char *program)
{
    program_name = program;
    ts_scratch_fails(no_scratch);
    ts_team_refused(fewer_threads);
    setlocale(LC_ALL, "C");
    signal(SIGPIPE, SIG_IGN);
    ts_status st = {0};
    if (ts_isa_init(&st) != TS_OK || ts_threads_check(&st) != TS_OK) return cl_usage("%s", st.message);
    return CL_OK;
}

void cl_speak_as(const char *who) { speaker = who; }

static int flush_failed; /* errno of the first time */

void cl_flush(void)
{
    if (fflush(stdout) != 0 && !flush_failed) flush_failed = errno;
}

static void say(const char *format, va_list args)
{
    if (!speaker) return;
    cl_flush();
    fprintf(stderr, "%s: %s%s", program_name, speaker, *speaker ? ": " : "");
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
}

int cl_usage(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    say(format, args);
    va_end(args);
    if (speaker) fprintf(stderr, "Try '%s --help'.\n", program_name);
    return CL_USAGE;
}

int cl_failed(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    say(format, args);
    va_end(args);
    return CL_FAILED;
}

int cl_stopped(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    say(format, args);
    va_end(args);
    return CL_INTERRUPTED;
}

void cl_note(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    say(format, args);
    va_end(args);
}

bool cl_parse_int(const char *text, int64_t lo, int64_t hi, int64_t *value)
{
    char *end;
    errno = 0;
    if (!*text || isspace((unsigned char)*text)) return false;
    const long long v = strtoll(text, &end, 10);
    if (errno || *end || v < lo || v > hi) return false;
    *value = v;
    return true;
}

bool cl_parse_real(const char *text, double lo, double hi, double *value)
{
    char *end;
    errno = 0;
    if (!*text || isspace((unsigned char)*text)) return false;
    const double v = strtod(text, &end);
    if ((errno && fabs(v) > 1) || *end || !(v >= lo && v <= hi)) return false; /* a denormal sets errno and is fine */
    *value = v;
    return true;
}

bool cl_parse_size(const char *text, double *bytes)
{
    static const char units[] = "KMG";
    char number[32];
    const size_t length = strlen(text);
    const char *unit = length ? strchr(units, text[length - 1]) : NULL;
    if (!unit) return cl_parse_real(text, 1, 1e18, bytes);
    if (length >= sizeof number) return false;
    memcpy(number, text, length - 1);
    number[length - 1] = 0;
    double v;
    if (!cl_parse_real(number, 0, 1e9, &v)) return false;
    for (const char *u = units; u <= unit; u++) v *= 1024;
    if (v < 1) return false;
    *bytes = v;
    return true;
}

bool cl_parse_shard(const char *text, int *shard, int *shards)
{
    char part[16];
    int64_t i, n;
    const char *slash = strchr(text, '/');
    const size_t length = slash ? (size_t)(slash - text) : 0;
    if (length == 0 || length >= sizeof part) return false;
    memcpy(part, text, length);
    part[length] = 0;
    if (!cl_parse_int(slash + 1, 1, 1000000, &n) || !cl_parse_int(part, 1, n, &i)) return false;
    *shard = (int)i;
    *shards = (int)n;
    return true;
}

int cl_finish(int code)
{
    cl_flush();
    if (flush_failed || ferror(stdout)) {
        const int failed = cl_failed("cannot write to standard output: %s", strerror(flush_failed));
        return code ? code : failed;
    }
    return code;
}

void cl_print_version(void) { printf("%s (lgd) %s\n", program_name, LGD_VERSION); }

double cl_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

cl_progress cl_progress_start(const char *what, int64_t total)
{
    return (cl_progress){.what = what, .total = total, .start = cl_seconds(), .terminal = isatty(STDERR_FILENO)};
}

static void print_duration(char *out, size_t size, double s)
{
    const long t = (long)(s + 0.5);
    if (t >= 3600) snprintf(out, size, "%ld:%02ld:%02ld", t / 3600, t / 60 % 60, t % 60);
    else snprintf(out, size, "%ld:%02ld", t / 60, t % 60);
}

/* Of the terminal. */
static int columns(void)
{
    struct winsize size;
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/* What of the text's end has room, so that the line stays one: a path's end says more than its beginning. */
static void print_end(const char *text, int room)
{
    const size_t length = strlen(text);
    if (room < 4) return;
    if (length <= (size_t)room) {
        fputs(text, stderr);
        return;
    }
    const char *end = text + length - (size_t)room + 3;
    while ((*end & 0xc0) == 0x80) end++; /* a whole character of UTF-8 */
    fprintf(stderr, "...%s", end);
}

void cl_progress_show(cl_progress *p, int64_t done, const char *extra)
{
    const double now = cl_seconds();
    if (!p->terminal || (now - p->last < 0.1 && done < p->total)) return;
    p->last = now;
    const double elapsed = now - p->start, rate = elapsed > 0 ? (double)done / elapsed : 0;
    char eta[32] = "-";
    if (rate > 0) print_duration(eta, sizeof eta, (double)(p->total - done) / rate);
    char line[160];
    const int used = snprintf(line, sizeof line, "%s %lld/%lld  %.2f/s  ETA %s  ", p->what, (long long)done,
                              (long long)p->total, rate, eta);
    fprintf(stderr, "\r\033[K%s", line);
    print_end(extra ? extra : "", columns() - used - 1);
}

void cl_progress_end(cl_progress *p)
{
    if (p->terminal && p->last > 0) fputs("\r\033[K", stderr);
}

static volatile sig_atomic_t interrupted;

static void on_signal(int signal_number)
{
    /* A terminal that closes sends SIGHUP twice, through the shell and by itself. */
    if (interrupted && signal_number != SIGHUP) {
        signal(signal_number, SIG_DFL);
        raise(signal_number);
    }
    interrupted = 1;
}

void cl_catch_interrupt(void)
{
    struct sigaction action = {.sa_handler = on_signal};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    struct sigaction hangup;
    if (sigaction(SIGHUP, NULL, &hangup) == 0 && hangup.sa_handler != SIG_IGN) /* nohup ignores it */
        sigaction(SIGHUP, &action, NULL);
}

bool cl_interrupted(void) { return interrupted != 0; }

void cl_remove_made(const char *path, size_t made)
{
    char part[4096];
    for (size_t i = strlen(path); made > 0 && i >= made && i < sizeof part; i--) {
        if ((path[i] != '/' && path[i] != 0) || path[i - 1] == '/') continue;
        memcpy(part, path, i);
        part[i] = 0;
        if (rmdir(part) != 0 && errno != ENOENT) return;
    }
}

ts_code cl_make_folder(const char *path, size_t *made, ts_status *st)
{
    char part[4096];
    const size_t length = strlen(path);
    if (made) *made = 0;
    if (length == 0) return ts_fail(st, TS_INVALID, "an empty folder name");
    if (length >= sizeof part) return ts_fail(st, TS_INVALID, "a folder name of %zu characters is too long", length);
    for (size_t i = 1; i <= length; i++) {
        if (path[i] != '/' && path[i] != 0) continue;
        memcpy(part, path, i);
        part[i] = 0;
        const bool own = mkdir(part, 0777) == 0;
        if (own && made && *made == 0) *made = i;
        if (!own && errno != EEXIST)
            return ts_fail(st, TS_IO, "%s: cannot create the folder: %s", part, strerror(errno));
    }
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISDIR(info.st_mode)) return ts_fail(st, TS_IO, "%s: is not a folder", path);
    ts_sweep(path);
    return TS_OK;
}
