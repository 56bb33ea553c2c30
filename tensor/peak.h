/* The most that the machine can do at this moment, as a yardstick for times. */
#ifndef TS_PEAK_H
#define TS_PEAK_H

/* FLOP/s of independent FMAs in registers on all threads in use, now: the best of a few short runs (about 20 ms in
 * all), since a peak is what the machine can do and not what its neighbours leave at this moment. */
double ts_fma_peak(void);

/* The same of what run(rounds) does, which returns the FLOP that it made; now: the clock, in seconds. */
double ts_peak_of(double (*run)(long rounds), double (*now)(void));
#endif
