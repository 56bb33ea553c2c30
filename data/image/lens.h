/* What a photograph's file says of its camera's angle. */
#ifndef IO_LENS_H
#define IO_LENS_H
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Exif 2.32, tables 4, 7 and 8; 0 or false: not said. */
typedef struct io_lens {
    double focal_35mm;    /* FocalLengthIn35mmFilm: of the lens that frames the same on 36 x 24 mm, by the diagonal */
    double focal;         /* FocalLength, mm */
    double plane;         /* FocalPlaneXResolution, pixels per mm of the sensor */
    double zoom;          /* DigitalZoomRatio */
    int width, height;    /* PixelXDimension, PixelYDimension: of the photograph when it was taken */
    bool zoom_in_focal35; /* focal_35mm has the digital zoom in it: the maker (Make) is Apple; others state the lens */
} io_lens;

/* Degrees across the side of the largest centred square of a photograph of width x height pixels (upright or as stored)
 * with that lens: 2 atan(side / 2 f), f in pixels: focal_35mm times the diagonal over that of 36 x 24 mm, or focal
 * times plane; both times the zoom that they do not have. 0 where nothing is said, where it cannot be (IO_FOV_LEAST ..
 * IO_FOV_MOST), and where the picture is not the whole that was taken: its shape is another than the lens's width and
 * height. why (size bytes): what it comes from, or what is missing. */
#define IO_FOV_LEAST 3.0
#define IO_FOV_MOST 150.0
double io_lens_fov(const io_lens *lens, int width, int height, char *why, size_t size);

#ifdef __cplusplus
}
#endif
#endif
