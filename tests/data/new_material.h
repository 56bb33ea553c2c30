/* Materials for tests. */
#ifndef TESTS_NEW_MATERIAL_H
#define TESTS_NEW_MATERIAL_H
#include "data/material.h"
#include "data/materials/procedural.h"

/* size x size pixels; their values are the caller's to set. The test fails where there is no memory; io_material_free
 * is the caller's. */
io_material new_material(int size);

/* How many values the maps of size x size pixels have. */
size_t material_values(int size);

/* Whether material i of a share of a half is varied. The test fails where it is neither as in plain nor as in varied.
 */
bool material_varies(const io_procedural *half, int i, const io_material *plain, const io_material *varied);
#endif
