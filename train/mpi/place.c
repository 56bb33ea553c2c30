#include "train/mpi/place.h"
#include <stdio.h>
#include <string.h>

void tr_places_say(const tr_place *p, int ranks, char *text, size_t size)
{
    size_t n = 0;
    text[0] = 0;
    for (int i = 0, end; i < ranks; i = end) {
        for (end = i + 1; end < ranks && !strcmp(p[end].host, p[i].host);) end++;
        char part[160];
        int m = end - i > 1
            ? snprintf(part, sizeof part, "%sranks %d-%d on %s (PIDs", i ? ", " : "", i, end - 1, p[i].host)
            : snprintf(part, sizeof part, "%srank %d on %s (PID", i ? ", " : "", i, p[i].host);
        for (int k = i; k < end && m < (int)sizeof part - 16; k++)
            m += snprintf(part + m, sizeof part - (size_t)m, " %d", p[k].pid);
        snprintf(part + m, sizeof part - (size_t)m, ")");
        if (n + strlen(part) + 8 > size) {
            snprintf(text + n, size - n, ", ...");
            return;
        }
        n += (size_t)snprintf(text + n, size - n, "%s", part);
    }
}
