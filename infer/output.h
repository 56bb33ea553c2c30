/* The files of one photograph, all or none. */
#ifndef LGD_OUTPUT_H
#define LGD_OUTPUT_H
#include "data/material.h"
#include <stdbool.h>

enum { LGD_FILES = 8, LGD_PREVIEW_LIGHTS = 4 };
extern const char *const lgd_files[LGD_FILES];

/* Fails with one clear line when nothing can be made inside the folder, before any work is done for it. */
ts_code lgd_output_check(const char *folder, ts_status *st);

/* Writes diffuse.png, specular.png, roughness.png, normal.png, maps.exr, meta.txt (what these mean), render.png (photo beside the re-rendered flash picture) and
 * preview.png (a strip of LGD_PREVIEW_LIGHTS light positions) to parent/stem. They are written to a hidden folder first and renamed
 * when all are complete: a failure leaves what was there before, and nothing else. photo: linear, of the material's size. */
ts_code lgd_output_write(const char *parent, const char *stem, const io_material *m, const io_image *photo, bool directx, ts_status *st);
#endif
