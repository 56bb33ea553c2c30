/* lgd-faults: runs a program again and again, each time with another of its calls made to fail (tests/faults/shim.c),
 * and checks what a failure must look like: exit status 1 with one line that begins with the program's name, nothing
 * half-written, no signal, no waiting; or, where the call does not matter, the same result as without.
 *
 *   lgd-faults [OPTIONS] SHIM FOLDER PROGRAM ARGUMENTS...
 *
 * The program writes below FOLDER/out, which is made anew for each run, from FOLDER/start where that exists.
 *   --every N    only every N-th failure of the calls for memory and of single characters and lines
 *   --call NAME  only that call
 *   --on         the call keeps failing from the chosen one on
 *   --steps      after a failure weights and curves may be those of an earlier step, whole files nevertheless, and a
 *                log's last row be cut, which a resumed run takes away
 *   --lines N    a failure may say N lines more than a run without (1)
 *   --libraries  the calls that the libraries of images and zlib make, not the program's own
 *   --whole      after a failure FOLDER/out holds all or, in each folder below it, nothing */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <limits.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { SECONDS = 60, LINE = 512, PATH = 4096, FILES = 256 };

typedef struct options {
    int every, lines;
    const char *call;
    bool on, steps, whole, libraries;
    const char *shim, *folder;
    char **program;
} options;

typedef struct counted {
    long runs, injected, failed;
    int defects;
} counted;

static char *path_of(const options *o, const char *name)
{
    static char text[8][PATH];
    static int next;
    char *p = text[next++ % 8];
    snprintf(p, PATH, "%s/%s", o->folder, name);
    return p;
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *at)
{
    (void)info, (void)kind, (void)at;
    return remove(path);
}

static void remove_tree(const char *path) { nftw(path, remove_one, 16, FTW_DEPTH | FTW_PHYS); }

static void command(const char *format, const char *a, const char *b)
{
    char text[2 * PATH + 64];
    snprintf(text, sizeof text, format, a, b);
    if (system(text) != 0) {
        fprintf(stderr, "lgd-faults: failed: %s\n", text);
        exit(2);
    }
}

static void fresh(const options *o)
{
    remove_tree(path_of(o, "out"));
    if (access(path_of(o, "start"), F_OK) == 0) command("cp -a '%s' '%s'", path_of(o, "start"), path_of(o, "out"));
    else mkdir(path_of(o, "out"), 0777);
}

/* The wait status; -1: it did not end. */
static int run(const options *o, const char *fault)
{
    fresh(o);
    unlink(path_of(o, "mark"));
    const pid_t child = fork();
    if (child == 0) {
        const int out = open(path_of(o, "stdout"), O_WRONLY | O_CREAT | O_TRUNC, 0600),
                  err = open(path_of(o, "stderr"), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        dup2(out, 1), dup2(err, 2), close(out), close(err);
        if (fault) setenv("LGD_FAULT", fault, 1);
        else setenv("LGD_FAULT_COUNT", path_of(o, "counts"), 1);
        setenv("LGD_FAULT_MARK", path_of(o, "mark"), 1);
        if (o->libraries) setenv("LGD_FAULT_LIBRARIES", "1", 1);
        setenv("LD_PRELOAD", o->shim, 1);
        execv(o->program[0], o->program);
        _exit(126);
    }
    int status = -1;
    for (int tenth = 0; tenth < SECONDS * 1000; tenth++) {
        if (waitpid(child, &status, WNOHANG) == child) return status;
        usleep(1000);
    }
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return -1;
}

typedef struct tree {
    struct {
        char name[PATH / 8];
        off_t size;
    } file[FILES];
    int files;
} tree;
static tree expected, found;
static tree *filled;
static size_t below;

static int list_one(const char *path, const struct stat *info, int kind, struct FTW *at)
{
    (void)at;
    if (kind != FTW_F || filled->files == FILES) return 0;
    snprintf(filled->file[filled->files].name, sizeof filled->file[0].name, "%s", path + below);
    filled->file[filled->files++].size = info->st_size;
    return 0;
}

static void list(const char *path, tree *t)
{
    t->files = 0;
    filled = t;
    below = strlen(path) + 1;
    nftw(path, list_one, 16, FTW_PHYS);
}

static int find(const tree *t, const char *name)
{
    for (int i = 0; i < t->files; i++)
        if (strcmp(t->file[i].name, name) == 0) return i;
    return -1;
}

static bool same_bytes(const char *a, const char *b)
{
    FILE *f = fopen(a, "rb"), *g = fopen(b, "rb");
    int x = 0, y = 0;
    while (f && g && x == y && x != EOF) x = getc(f), y = getc(g);
    if (f) fclose(f);
    if (g) fclose(g);
    return f && g && x == y;
}

static bool ends_with(const char *name, const char *end)
{
    const size_t n = strlen(name), m = strlen(end);
    return n >= m && strcmp(name + n - m, end) == 0;
}

/* Tables and reports hold times: they have to end with a line. */
static bool has_times(const char *name)
{
    return ends_with(name, ".csv") || ends_with(name, ".html") || ends_with(name, ".json") || ends_with(name, ".jsonl");
}

static bool whole_lines(const char *path)
{
    FILE *f = fopen(path, "rb");
    int last = '\n', c;
    while (f && (c = getc(f)) != EOF) last = c;
    if (f) fclose(f);
    return f && last == '\n';
}

static bool whole_drawing(const char *path)
{
    static const char end[] = "</svg>\n";
    char last[sizeof end] = "";
    FILE *f = fopen(path, "rb");
    const bool read = f && fseek(f, 1 - (long)sizeof end, SEEK_END) == 0 && fread(last, 1, sizeof end - 1, f) > 0;
    if (f) fclose(f);
    return read && strcmp(last, end) == 0;
}

/* A safetensors file's header says where the last tensor ends. */
static bool whole_weights(const char *path, off_t size)
{
    FILE *f = fopen(path, "rb");
    uint64_t header = 0, end = 0;
    char *text = NULL;
    if (f && fread(&header, 8, 1, f) == 1 && header < (uint64_t)size) text = calloc(1, header + 1);
    if (text && fread(text, 1, header, f) == header)
        for (char *at = text; (at = strstr(at, "\"data_offsets\":["));) {
            at = strchr(at, ',') + 1;
            const uint64_t here = strtoull(at, NULL, 10);
            if (here > end) end = here;
        }
    if (f) fclose(f);
    free(text);
    return end > 0 && 8 + header + end == (uint64_t)size;
}

/* The first line of the program's messages that is not one, or what else is wrong with the folder; NULL: nothing. */
static const char *look(const options *o, bool failed, int lines_before)
{
    static char why[LINE + 64];
    char line[LINE], base[PATH], path[PATH];
    const char *name = strrchr(o->program[0], '/') ? strrchr(o->program[0], '/') + 1 : o->program[0];
    int lines = 0;
    bool at_once = false;
    FILE *f = fopen(path_of(o, "stderr"), "r");
    while (f && fgets(line, sizeof line, f)) {
        line[strcspn(line, "\n")] = 0;
        if (!strstr(line, "refuses threads")) lines++;     /* fewer compute: not a failure */
        at_once |= strstr(line, "a thread needs") != NULL; /* then another thread's temporary file may stay */
        if (strncmp(line, name, strlen(name)) != 0 || line[strlen(name)] != ':' || strstr(line, "(null)")) {
            fclose(f);
            return snprintf(why, sizeof why, "says: %s", line), why;
        }
    }
    if (f) fclose(f);
    if (failed && lines == 0) return "says nothing";
    if (failed && lines > lines_before + o->lines) return snprintf(why, sizeof why, "says %d lines", lines), why;
    list(path_of(o, "out"), &found);
    for (int i = 0; i < found.files; i++) {
        const int k = find(&expected, found.file[i].name);
        if (k < 0 && at_once && strstr(found.file[i].name, ".lgd-")) continue;
        if (k < 0) return snprintf(why, sizeof why, "leaves %s", found.file[i].name), why;
        snprintf(base, sizeof base, "%s/%s", path_of(o, "expected"), found.file[i].name);
        snprintf(path, sizeof path, "%s/%s", path_of(o, "out"), found.file[i].name);
        const bool same = has_times(found.file[i].name)             ? (failed && o->steps) || whole_lines(path)
            : failed && o->steps && ends_with(path, ".svg")         ? whole_drawing(path)
            : failed && o->steps && ends_with(path, ".safetensors") ? whole_weights(path, found.file[i].size)
                                                                    : same_bytes(path, base);
        if (!same) return snprintf(why, sizeof why, "leaves another %s", found.file[i].name), why;
    }
    for (int i = 0; i < expected.files; i++) {
        if (find(&found, expected.file[i].name) >= 0) continue;
        if (!failed) return snprintf(why, sizeof why, "exit 0 without %s", expected.file[i].name), why;
        const char *slash = strrchr(expected.file[i].name, '/');
        for (int k = 0; o->whole && slash && k < found.files; k++)
            if (strncmp(found.file[k].name, expected.file[i].name, (size_t)(slash - expected.file[i].name + 1)) == 0)
                return snprintf(why, sizeof why, "leaves %s without %s", found.file[k].name, slash + 1), why;
    }
    return NULL;
}

static const char *judge(const options *o, int status, int lines, bool *failed)
{
    static char why[64];
    *failed = WIFEXITED(status) && WEXITSTATUS(status) == 1;
    if (status == -1) return "does not end";
    if (WIFSIGNALED(status)) return snprintf(why, sizeof why, "signal %d", WTERMSIG(status)), why;
    if (WEXITSTATUS(status) > 1) return snprintf(why, sizeof why, "exit status %d", WEXITSTATUS(status)), why;
    return look(o, *failed, lines);
}

static void try(const options *o, const char *call, long n, int lines, counted *c)
{
    char fault[80];
    bool failed;
    snprintf(fault, sizeof fault, "%s %ld%s", call, n, o->on ? "+" : "");
    const int status = run(o, fault);
    c->runs++;
    if (access(path_of(o, "mark"), F_OK) != 0) return; /* threads took another way this time */
    c->injected++;
    const char *why = judge(o, status, lines, &failed);
    c->failed += failed;
    if (!why) return;
    c->defects++;
    printf("  %s: %s\n", fault, why);
    fflush(stdout);
}

/* Made by the hundred, in the same few places. */
static bool frequent(const char *call)
{
    static const char *const some[] = {"strdup", "asprintf", "fgets", "fputc", "fputs", "fprintf", "printf", "fwrite"};
    for (size_t i = 0; i < sizeof some / sizeof *some; i++)
        if (!strcmp(call, some[i])) return true;
    return strstr(call, "alloc") != NULL;
}

static int parse(int argc, char **argv, options *o)
{
    int at = 1;
    *o = (options){.every = 1, .lines = 1};
    for (; at < argc && strncmp(argv[at], "--", 2) == 0; at++) {
        if (!strcmp(argv[at], "--every") && at + 1 < argc) o->every = atoi(argv[++at]);
        else if (!strcmp(argv[at], "--call") && at + 1 < argc) o->call = argv[++at];
        else if (!strcmp(argv[at], "--lines") && at + 1 < argc) o->lines = atoi(argv[++at]);
        else if (!strcmp(argv[at], "--on")) o->on = true;
        else if (!strcmp(argv[at], "--steps")) o->steps = true;
        else if (!strcmp(argv[at], "--whole")) o->whole = true;
        else if (!strcmp(argv[at], "--libraries")) o->libraries = true;
        else return 2;
    }
    if (argc - at < 3 || o->every < 1) return 2;
    o->shim = argv[at];
    o->folder = argv[at + 1];
    o->program = argv + at + 2;
    return 0;
}

int main(int argc, char **argv)
{
    options o;
    counted c = {0};
    char call[64], line[LINE];
    long n;
    int lines = 0;
    if (parse(argc, argv, &o)) {
        fprintf(stderr,
                "usage: lgd-faults [--every N] [--call NAME] [--on] [--steps] [--lines N] [--libraries] "
                "[--whole] SHIM FOLDER PROGRAM ARGUMENTS...\n");
        return 2;
    }
    const int status = run(&o, NULL);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        fprintf(stderr, "lgd-faults: %s fails without a fault: see %s\n", o.program[0], path_of(&o, "stderr"));
        return 2;
    }
    FILE *f = fopen(path_of(&o, "stderr"), "r");
    while (f && fgets(line, sizeof line, f)) lines++;
    if (f) fclose(f);
    remove_tree(path_of(&o, "expected"));
    command("cp -a '%s' '%s'", path_of(&o, "out"), path_of(&o, "expected"));
    list(path_of(&o, "expected"), &expected);
    f = fopen(path_of(&o, "counts"), "r");
    while (f && fscanf(f, "%63s %ld", call, &n) == 2) {
        if (o.call && strcmp(o.call, call) != 0) continue;
        for (long i = 1; i <= n; i += frequent(call) ? o.every : 1) try(&o, call, i, lines, &c);
    }
    if (f) fclose(f);
    printf("%ld failures injected, %ld of them exit 1, %d defects\n", c.injected, c.failed, c.defects);
    return c.defects > 0 || c.injected == 0;
}
