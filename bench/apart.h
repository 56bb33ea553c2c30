/* How far from each other the CPUs are on which the threads run. */
#ifndef BENCH_APART_H
#define BENCH_APART_H

/* Seconds that a word of memory takes from one thread to another and back, a mean: some 60 to 100 ns between cores that
 * share a cache, three times that or more between those that do not, which fetch all from each other that slowly. A
 * virtual machine's host chooses, and changes its mind. 0: there is one thread, or no second came. */
double bench_apart(void);
#endif
