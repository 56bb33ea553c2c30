/* lgd-stress: every part in full. Ends with 1 where a bound breaks. An argument names the parts to run. */
#include "tests/stress/stress.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        bool (*run)(const stress *);
    } parts[] = {{"shading", stress_shading}, {"newton", stress_newton}, {"threads", stress_threads}, {"sums", stress_sums}, {"unrolled", stress_unrolled}, {"refinement", stress_refinement}, {"training", stress_training}};
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
