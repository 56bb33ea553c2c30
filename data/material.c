#include "data/material.h"
#include "tensor/memory.h"
#include <stdlib.h>
#include <string.h>

enum { MAX_SIZE = 1 << 15 };

ts_code io_material_create(io_material *m, int size, ts_status *st)
{
    memset(m, 0, sizeof *m);
    if (size < 1 || size > MAX_SIZE)
        return ts_fail(st, TS_INVALID, "maps of %d x %d pixels: the size must be 1 .. %d", size, size, MAX_SIZE);
    const size_t bytes = (size_t)size * (size_t)size * MAP_CHANNELS * sizeof *m->maps;
    if (!(m->maps = ts_memory(bytes))) return ts_fail(st, TS_NOMEM, "no memory for maps of %d x %d pixels", size, size);
    m->size = size;
    return TS_OK;
}

void io_material_free(io_material *m)
{
    free(m->maps);
    memset(m, 0, sizeof *m);
}
