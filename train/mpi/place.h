/* Where ranks are, for messages. */
#ifndef TR_PLACE_H
#define TR_PLACE_H
#include <stddef.h>

typedef struct tr_place {
    char host[64];
    int pid;
} tr_place;

/* "ranks 0-1 on HOST (PIDs 17 18), ..." of all ranks, as many as fit. */
void tr_places_say(const tr_place *place, int ranks, char *text, size_t size);
#endif
