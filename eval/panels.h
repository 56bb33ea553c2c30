/* Sheets of square panels side by side that hold a peer's maps. */
#ifndef EV_PANELS_H
#define EV_PANELS_H
#include "data/material.h"

/* Nine panels: input, then normal, diffuse, roughness, specular of the truth, then those of the peer. The input is
 * sRGB; the truth's maps are linear; of the peer's, diffuse and specular are v^(1/2.2) and roughness is 0.9 r + 0.1.
 * input: linear, size x size x 3, malloced and the caller's. The materials are zeroed or reused. */
ts_code ev_read_nine_panels(const char *path, int size, float **input, io_material *truth, io_material *peer,
                            ts_status *st);

/* Four panels: the peer's maps alone. */
ts_code ev_read_four_panels(const char *path, int size, io_material *peer, ts_status *st);
#endif
