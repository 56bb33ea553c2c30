#include "tensor/cgroup.h"
#include <stdio.h>
#include <string.h>

void ts_cgroup_each(void (*visit)(const char *folder, void *user), void *user)
{
    char line[512], folder[600];
    visit("/sys/fs/cgroup", user);
    FILE *f = fopen("/proc/self/cgroup", "re");
    if (!f) return;
    while (fgets(line, sizeof line, f)) {
        if (strncmp(line, "0::/", 4) != 0) continue;
        line[strcspn(line, "\n")] = 0;
        /* A limit may stand at any level above. */
        for (char *end = line + strlen(line); end > line + 3; end = strrchr(line + 3, '/')) {
            *end = 0;
            if (!line[3]) break;
            snprintf(folder, sizeof folder, "/sys/fs/cgroup%s", line + 3);
            visit(folder, user);
        }
    }
    fclose(f);
}
