/* Photographs of one flat sample under known lights and cameras, listed in an INI file:
 *
 *   [capture]
 *   side = 20            ; of the sample, in the unit of the positions; default: positions are in patch widths
 *   power = 480          ; radiance = BRDF max(n.l, 0) power / distance^2 in that unit; default: the default light's
 *   [photo_1]            ; a section for each photograph, in any order, with any name
 *   file = left.jpg      ; relative to the INI file, or absolute; "wood #2.jpg" in quotation marks
 *   light = -5, 0, 20    ; x right, y up, z toward the camera, from the sample's centre
 *   camera = 0, 0, 20
 *   exposure = 1.3       ; so many times brighter than the others; default 1
 *   corners = 10,10 90,12 88,90 8,85 ; data/rectify/corners.h; light and camera may then be left out
 *   focal = 26           ; with corners: mm on 35 mm film, where EXIF has none
 */
#ifndef IO_CAPTURE_INI_H
#define IO_CAPTURE_INI_H
#include "data/capture.h"

/* The largest centred square of each photograph, or the one that has the corners, as io_read_photo reads it, brought to
 * size x size. default_power: the power when the file has none, for distances in patch widths. The caller frees after
 * success; c is empty after a failure, which names the file and the line or key. */
ts_code io_read_capture_ini(const char *path, int size, float default_power, int64_t max_pixels, io_capture *c,
                            ts_status *st);

/* The paths of the files that it lists, each malloced, which the caller frees; after a failure *files are there. */
ts_code io_capture_ini_files(const char *path, char *file[IO_CAPTURE_IMAGES], int *files, ts_status *st);
#endif
