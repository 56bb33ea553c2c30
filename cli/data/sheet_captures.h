/* Photographs of a material in the window of a printed sheet (data/rectify/tag_sheet.h), as a phone takes them. */
#ifndef CL_SHEET_CAPTURES_H
#define CL_SHEET_CAPTURES_H
#include "data/material.h"
#include "data/rectify/pinhole.h"
#include <stdint.h>

enum { CL_SHEET_SHOTS = 5 };

typedef struct cl_sheet_shot {
    io_pinhole camera;
    double light[3]; /* in the camera's frame: right, down, forward, in the window's sides */
    double exposure; /* paper in the middle of the sheet, straight under the light at 220 mm, is so bright, linear */
} cl_sheet_shot;

/* The shots number (seed, index) with pictures of width x 3/4 width pixels: a lens of 26 mm (2% more or less, which
 * EXIF does not say) with a radial distortion of up to 0.03; one camera from 0 to 5 degrees off the sheet's axis, the
 * others around it at 15 to 40 degrees, 210 to 245 mm away; exposures up to 30% apart; the flash 2 cm beside the lens.
 */
void cl_sheet_shots(uint64_t seed, uint64_t index, int width, cl_sheet_shot shot[CL_SHEET_SHOTS]);

/* DIR/photo_1.jpg ... with sensor noise and JPEG, DIR/maps/ of the material, and DIR/exact/: the window alone under the
 * same lights from the same cameras without any fault, which says where they are (data/capture.h). All or nothing. */
ts_code cl_write_sheet_captures(const char *folder, const io_material *m, uint64_t seed, uint64_t index, int width,
                                int quality, ts_status *st);
#endif
