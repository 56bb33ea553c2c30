#include "tests/data/new_material.h"
#include "tests/test.h"
#include <string.h>

io_material new_material(int size)
{
    io_material m = {0};
    CHECK(io_material_create(&m, size, NULL) == TS_OK, "no memory for a material of %d", size);
    return m;
}

size_t material_values(int size) { return (size_t)size * (size_t)size * MAP_CHANNELS; }

bool material_varies(const io_procedural *half, int i, const io_material *plain, const io_material *varied)
{
    io_material m = new_material(plain->size);
    const size_t bytes = material_values(plain->size) * sizeof(float);
    io_procedural_make(half, (uint64_t)i, &m);
    const bool is_plain = !memcmp(m.maps, plain->maps, bytes);
    CHECK(is_plain || !memcmp(m.maps, varied->maps, bytes), "material %d is neither plain nor varied", i);
    io_material_free(&m);
    return !is_plain;
}
