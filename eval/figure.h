/* The paper's figures from a report: SVG to look at, CSV with the same numbers. */
#ifndef EV_FIGURE_H
#define EV_FIGURE_H
#include "eval/run.h"

/* folder/iterations.svg and .csv: RMSE of the renderings over the steps, a line a method (figure 3, upper left). */
ts_code ev_figure_iterations(const ev_report *r, const char *folder, ts_status *st);
/* folder/methods.svg and .csv: RMSE of the renderings over the seconds that they took, a line a method. */
ts_code ev_figure_methods(const ev_report *r, const char *folder, ts_status *st);

/* folder/pareto.svg and .csv: lgd's time against its error at sizes[0 .. count - 1] pixels, over T = 0 .. 24 in f32 and
 * in bf16, and over the tolerance at which tiles end. r: as for ev_run_all, without methods and size; its failures are
 * those of all sizes. TS_INTERRUPTED after Ctrl-C. */
ts_code ev_pareto(ev_run *r, const int *sizes, int count, const char *model, const char *folder, ts_status *st);
#endif
