/* Runs every registered test in a process of its own, so that a crash is one failure and not the end, and prints
 * "ok NAME", "FAIL NAME: why" or "skip NAME: why" for each. An argument selects the tests whose name contains it.
 * A test and what it starts are one process group, which ends with the test, and after LIMIT_SECONDS at the latest. */
#include "tests/test.h"
#include "cli/cli.h"
#include "tensor/cpu.h"
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MAX_TESTS = 1024, LIMIT_SECONDS = 600 };

static struct {
    const char *name;
    test_function f;
} tests[MAX_TESTS];
static int count;
static int report = -1; /* the pipe to the runner */
static char folder[64];

void test_register(const char *name, test_function f)
{
    if (count == MAX_TESTS) abort();
    tests[count].name = name;
    tests[count++].f = f;
}

static void remove_folder(void)
{
    if (!folder[0]) return;
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) fprintf(stderr, "cannot remove %s\n", folder);
}

static _Noreturn void leave(char kind, const char *text)
{
    char line[1024];
    const int n = snprintf(line, sizeof line, "%c%s", kind, text);
    if (write(report, line, (size_t)(n < (int)sizeof line ? n : (int)sizeof line - 1)) < 0) perror("report");
    remove_folder();
    fflush(NULL);
    _exit(kind == 'F');
}

void test_fail(const char *file, int line, const char *format, ...)
{
    char text[900];
    const int n = snprintf(text, sizeof text, "%s:%d: ", file, line);
    va_list args;
    va_start(args, format);
    vsnprintf(text + n, sizeof text - (size_t)n, format, args);
    va_end(args);
    leave('F', text);
}

void test_skip(const char *format, ...)
{
    char text[900];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    leave('S', text);
}

static const char *existing(const char *variable, const char *fallback)
{
    const char *path = getenv(variable);
    if (!path || !*path) path = fallback;
    struct stat info;
    if (stat(path, &info) != 0) test_skip("%s is absent (set %s)", path, variable);
    return path;
}

const char *test_data(void) { return existing("TESTDATA", "../shared/testdata"); }
const char *test_fixtures(void) { return existing("FIXTURES", "../shared/fixtures"); }

const char *test_build(void)
{
    const char *b = getenv("BUILD");
    return b && *b ? b : "build";
}

const char *test_folder(void)
{
    if (!folder[0]) {
        strcpy(folder, "/tmp/lgd-test-XXXXXX");
        if (!mkdtemp(folder)) test_fail(__FILE__, __LINE__, "mkdtemp: %s", strerror(errno));
    }
    return folder;
}

static int by_name(const void *a, const void *b) { return strcmp(*(const char *const *)a, *(const char *const *)b); }

static volatile sig_atomic_t group, late; /* the group of the test that runs, 0: none */

static void at_the_limit(int signal)
{
    (void)signal;
    late = 1;
    if (group) kill((pid_t)-group, SIGKILL);
}

/* A terminal's Ctrl-C does not reach the group of the test. */
static void stopped(int number)
{
    if (group) kill((pid_t)-group, SIGKILL);
    signal(number, SIG_DFL);
    raise(number);
}

/* What is ignored stays so, as under nohup. */
static void handle(bool in_runner)
{
    static const int ends[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGALRM};
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        struct sigaction action = {.sa_handler = SIG_DFL}, old;
        if (in_runner) action.sa_handler = ends[i] == SIGALRM ? at_the_limit : stopped;
        sigaction(ends[i], NULL, &old);
        if (old.sa_handler != SIG_IGN || ends[i] == SIGALRM) sigaction(ends[i], &action, NULL);
    }
}

static _Noreturn void be_test(int i, int out)
{
    report = out;
    tests[i].f();
    leave('O', "");
}

/* 0 ok, 1 failed, 2 skipped */
static int run(int i)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0 || fcntl(ends[0], F_SETFL, O_NONBLOCK) != 0) abort();
    fflush(NULL);
    late = 0;
    sigset_t all, before; /* a signal between the fork and the note of its group would leave the test behind */
    sigfillset(&all);
    sigprocmask(SIG_BLOCK, &all, &before);
    const pid_t child = fork();
    if (child < 0) abort();
    if (child == 0) {
        setpgid(0, 0);
        handle(false);
        sigprocmask(SIG_SETMASK, &before, NULL);
        alarm(LIMIT_SECONDS + 10); /* where the runner itself was killed */
        close(ends[0]);
        be_test(i, ends[1]);
    }
    setpgid(child, child); /* whichever of the two comes first */
    group = child;
    sigprocmask(SIG_SETMASK, &before, NULL);
    alarm(LIMIT_SECONDS);
    close(ends[1]);
    int status;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR) abort();
    alarm(0);
    kill(-child, SIGKILL); /* what it has left running */
    group = 0;
    char text[1024]; /* written at once: all of it is there */
    const ssize_t used = read(ends[0], text, sizeof text - 1);
    text[used > 0 ? used : 0] = 0;
    close(ends[0]);
    const int failed_exit = !(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    if (text[0] == 'F') printf("FAIL %s: %s\n", tests[i].name, text + 1);
    else if (late && failed_exit) printf("FAIL %s: not done after %d s\n", tests[i].name, LIMIT_SECONDS);
    else if (WIFSIGNALED(status))
        printf("FAIL %s: killed by signal %d (%s)\n", tests[i].name, WTERMSIG(status), strsignal(WTERMSIG(status)));
    else if (failed_exit || (text[0] != 'O' && text[0] != 'S'))
        printf("FAIL %s: ended with status %d without a report\n", tests[i].name,
               WIFEXITED(status) ? WEXITSTATUS(status) : -1);
    else if (text[0] == 'S') printf("skip %s: %s\n", tests[i].name, text + 1);
    else printf("ok %s\n", tests[i].name);
    fflush(stdout);
    return failed_exit || (text[0] != 'O' && text[0] != 'S') ? 1 : text[0] == 'S' ? 2 : 0;
}

int main(int argc, char **argv)
{
    cl_open_streams();
    ts_status st = {0};
    if (ts_isa_init(&st) != TS_OK) {
        fprintf(stderr, "%s\n", st.message);
        return 2;
    }
    qsort(tests, (size_t)count, sizeof tests[0], by_name);
    handle(true);
    int failed = 0, ran = 0;
    if (argc > 2) {
        fprintf(stderr, "lgd-test takes one word of the tests' names at most\n");
        return 2;
    }
    for (int i = 0; i < count; i++) {
        if (argc > 1 && !strstr(tests[i].name, argv[1])) continue;
        failed += run(i) == 1;
        ran++;
    }
    if (!ran) fprintf(stderr, "lgd-test: no test's name has the word '%s'\n", argc > 1 ? argv[1] : "");
    return !ran ? 2 : failed != 0;
}
