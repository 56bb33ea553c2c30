/* maps.exr: the maps of a material as named linear channels. The reader, io_read_maps_exr, is in data/material.h. */
#ifndef IO_EXR_H
#define IO_EXR_H
#include "data/material.h"

/* half: 16-bit floats, ZIP compressed: a quarter of the file, and maps to 0.05% of each value; else 32-bit floats,
 * uncompressed, since ZIP saves a twelfth of those and takes longer than the estimate. threads: that it is made on; 0:
 * the process's number. */
ts_code io_write_maps_exr(const char *path, const io_material *m, bool directx, bool half, int threads, ts_status *st);
#endif
