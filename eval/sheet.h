/* A picture of one material's truth and estimates. */
#ifndef EV_SHEET_H
#define EV_SHEET_H
#include "eval/metrics/metrics.h"

/* Three rows (truth, R_0, the last R_t), each: flash picture, diffuse, specular, roughness, normal, three of the
 * evaluation's renderings. The truth's flash picture is the input as the network saw it. Of a capture: its first eight
 * photographs and their re-renderings. Written as an 8-bit sRGB PNG. */
ts_code ev_sheet_write(const char *path, const ev_case *c, const float *first, const float *last, ts_status *st);

/* The same columns for the report, panels of at most EV_SHEET_PANEL pixels: truth, estimate, and four times the
 * difference of the two. bytes of a PNG, malloced and the caller's. */
enum { EV_SHEET_PANEL = 96 };
ts_code ev_sheet_png(const ev_case *c, const float *maps, unsigned char **bytes, size_t *size, ts_status *st);
#endif
