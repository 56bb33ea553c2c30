/* The radiance of maps that reflect otherwise than the renderer's BRDF. */
#ifndef CL_REFLECT_H
#define CL_REFLECT_H
#include "data/camera.h"
#include "render/scene.h"

/* image [size][size][3], not clamped, of maps [size][size][MAP_CHANNELS] under view, an RD_POINT view whose
 * light is the disk flash. The second lobe is lit by the disk's centre alone: it is broad. */
void cl_reflect(const io_reflection *how, const rd_view *view, const io_disk *flash, int size, const float *maps,
                float *image);
#endif
