/* Rank and number of processes, from the environment that a launcher of MPI programs sets. */
#ifndef EV_LAUNCHER_H
#define EV_LAUNCHER_H
#include <stdbool.h>

/* Which part of how many this process is by the environment of mpirun (Open MPI, MPICH and Slurm's PMI); false: it was
 * not started so, or alone. */
bool ev_shard_of_launcher(int *shard, int *shards);
#endif
