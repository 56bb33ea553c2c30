/* Pictures that lgd-data takes of materials. */
#ifndef CL_PICTURES_H
#define CL_PICTURES_H
#include "data/material.h"

/* A hand-held phone: the first picture is the flash photograph, the others are taken around it with the flash beside
 * the lens. */
ts_code cl_write_capture(const char *folder, const io_material *m, ts_status *st);
#endif
