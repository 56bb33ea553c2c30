/* A capture's pictures as the models read them. */
#ifndef LGD_CAPTURE_H
#define LGD_CAPTURE_H
#include "data/capture.h"
#include "infer/lgd.h"

/* What its pictures' colours are multiplied by, so that the light is white and, if not as_taken, the first one's light,
 * wherever it is, lights the sample's centre as the default flash does. What that makes brighter than 1 is lost, so
 * that pictures of a light whose power is not believed stay as bright as they were taken. */
void lgd_capture_gain(const io_capture *c, bool as_taken, float gain[3]);

/* Reads a capture.ini (data/capture_ini.h) or a folder in MaterialGAN's layout (data/capture.h) and multiplies the
 * pictures, in place, and the light's power by lgd_capture_gain. */
ts_code lgd_read_capture(const char *path, int size, int64_t max_pixels, bool as_taken, io_capture *c, ts_status *st);

/* The first min(images, most) pictures of a capture that lgd_read_capture read; photo[k].image points into c. Returns
 * how many. */
int lgd_capture_photos(const io_capture *c, int most, lgd_photo *photo);
#endif
