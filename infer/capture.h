/* A capture's pictures as the models read them. */
#ifndef LGD_CAPTURE_H
#define LGD_CAPTURE_H
#include "data/capture.h"
#include "infer/lgd.h"

/* Reads a capture.ini (data/capture_ini.h) or a folder in MaterialGAN's layout (data/capture.h) and brings the
 * pictures, in place, to the brightness and colour that the models were trained with: as if the first one's light,
 * wherever it is, lit the sample's centre as the default flash does. */
ts_code lgd_read_capture(const char *path, int size, int64_t max_pixels, io_capture *c, ts_status *st);

/* The first min(images, most) pictures of a capture that lgd_read_capture read; photo[k].image points into c. Returns
 * how many. */
int lgd_capture_photos(const io_capture *c, int most, lgd_photo *photo);
#endif
