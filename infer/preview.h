/* Renderings of the estimated material: render.png and preview.png. */
#ifndef LGD_PREVIEW_H
#define LGD_PREVIEW_H
#include "data/material.h"
#include "infer/lgd.h"
#include "render/scene.h"

enum { LGD_PREVIEW_LIGHTS = 4 };

/* View number index of preview.png, under a light of its own: seen from as far away as the photograph. */
rd_view lgd_preview_view(int index, const lgd_photo *photo);

/* The photograph, of the material's size, beside the material as its camera sees it under its light and the ambient
 * light (lgd_options.ambient). */
ts_code lgd_write_render(const char *path, const io_material *m, const lgd_photo *photo, double ambient, ts_status *st);

/* The material under LGD_PREVIEW_LIGHTS lights, side by side. */
ts_code lgd_write_preview(const char *path, const io_material *m, const lgd_photo *photo, ts_status *st);
#endif
