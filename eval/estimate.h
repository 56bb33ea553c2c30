/* One photograph through one method, timed and scored. */
#ifndef EV_ESTIMATE_H
#define EV_ESTIMATE_H
#include "eval/methods/method.h"

/* Runs an open method repeat times. row[i] is what R_step[i] of the first run scores, i = 0 .. points - 1 (SSIM, FLIP
 * and LPIPS of the first and the last alone); seconds[i] the median over the runs of the time from the photograph to
 * it, without that of the scores. last gets the last maps, [size, size, 9], first (may be NULL) those of step[0].
 * TS_NUMERIC when an estimate has no finite error; TS_INTERRUPTED after Ctrl-C. */
ts_code ev_estimate(ev_estimator *e, const ev_case *c, const int *step, int points, int repeat, ev_row *row,
                    double *seconds, float *first, float *last, ts_status *st);
#endif
