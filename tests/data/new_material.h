/* A material for tests. */
#ifndef TESTS_NEW_MATERIAL_H
#define TESTS_NEW_MATERIAL_H
#include "data/material.h"

/* size x size pixels; their values are the caller's to set. The test fails where there is no memory; io_material_free
 * is the caller's. */
io_material new_material(int size);
#endif
