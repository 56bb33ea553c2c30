/* maps.exr: the maps of a material as named linear float channels. The reader, io_read_maps_exr, is in data/material.h.
 */
#ifndef IO_EXR_H
#define IO_EXR_H
#include "data/material.h"

ts_code io_write_maps_exr(const char *path, const io_material *m, bool directx, ts_status *st);
#endif
