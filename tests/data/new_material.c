#include "tests/data/new_material.h"
#include "tests/test.h"

io_material new_material(int size)
{
    io_material m = {0};
    CHECK(io_material_create(&m, size, NULL) == TS_OK, "no memory for a material of %d", size);
    return m;
}
