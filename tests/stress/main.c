/* lgd-stress: every part in full. Ends with 1 where a bound breaks. */
#include "cli/cli.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/stress/stress.h"
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    bool (*run)(const stress *);
} parts[] = {{"shading", stress_shading}, {"newton", stress_newton},     {"threads", stress_threads},
             {"sums", stress_sums},       {"unrolled", stress_unrolled}, {"refinement", stress_refinement},
             {"sheets", stress_sheets},   {"training", stress_training}};

static int help(void)
{
    puts("usage: lgd-stress [PART]\nRuns the parts that PART names, all of them without it: what was measured beside "
         "its bound. Exit status 1 where one is broken. Parts:");
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) printf("  %s\n", parts[i].name);
    return 0;
}

int main(int argc, char **argv)
{
    cl_open_streams();
    if (argc > 1 && !strcmp(argv[1], "--help")) return help();
    if (argc > 2 || (argc > 1 && argv[1][0] == '-'))
        return fprintf(stderr, "lgd-stress: one part at most, no options but --help\n"), 2;
    char folder[] = "/tmp/lgd-stress-XXXXXX", command[64];
    ts_status st = {0};
    if (ts_isa_init(&st) != TS_OK) return fprintf(stderr, "lgd-stress: %s\n", st.message), 2;
    if (!mkdtemp(folder)) return perror("lgd-stress: /tmp"), 1;
    ts_threads_set(0);
    const stress s = {true, folder};
    bool ok = true;
    int run = 0;
    printf("%-64s %12s %12s\n", "", "measured", "bound");
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (argc > 1 && !strstr(argv[1], parts[i].name)) continue;
        ok = parts[i].run(&s) && ok;
        run++;
    }
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) fprintf(stderr, "lgd-stress: cannot remove %s\n", folder);
    if (!run) return fprintf(stderr, "lgd-stress: no part is called '%s'\n", argv[1]), 2;
    puts(ok ? "every bound holds" : "a bound is broken");
    return ok ? 0 : 1;
}
