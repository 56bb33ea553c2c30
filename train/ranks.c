#include "train/ranks.h"
#include "data/library.h"
#include "tensor/hash.h"
#include <stdlib.h>
#include <string.h>

/* The launchers' variables: how many processes, this one's number, its number on its host, and the library that speaks
 * the launcher's language. Slurm's srun sets PMIX_RANK for Open MPI (--mpi=pmix) and PMI_SIZE for MPICH (--mpi=pmi2).
 */
typedef struct launcher {
    const char *marker, *size, *rank, *local, *library, *package;
} launcher;
static const launcher launchers[] = {
    {"OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_LOCAL_RANK",
     "liblgd_openmpi.so", "Open MPI (libopenmpi-dev)"},
    {"PMI_SIZE", "PMI_SIZE", "PMI_RANK", "MPI_LOCALRANKID", "liblgd_mpich.so", "MPICH (libmpich-dev)"},
    {"PMIX_RANK", "SLURM_STEP_NUM_TASKS", "PMIX_RANK", "SLURM_LOCALID", "liblgd_openmpi.so",
     "Open MPI (libopenmpi-dev)"},
};

static int number(const char *name)
{
    const char *text = getenv(name);
    return text ? atoi(text) : 0;
}

static const launcher *launched_by(void)
{
    for (size_t i = 0; i < sizeof launchers / sizeof *launchers; i++)
        if (getenv(launchers[i].marker)) return number(launchers[i].size) > 1 ? &launchers[i] : NULL;
    return NULL;
}

bool tr_launched(void) { return launched_by() != NULL; }
int tr_launched_rank(void) { return tr_launched() ? number(launched_by()->rank) : 0; }
bool tr_launched_first(void) { return !tr_launched() || number(launched_by()->local) == 0; }

ts_code tr_ranks_start(tr_ranks *ranks, ts_status *st)
{
    const launcher *by = launched_by();
    *ranks = (tr_ranks){.count = 1};
    if (!by) return TS_OK;
    const tr_mpi *mpi = io_library_load(by->library, TR_MPI_TABLE, st);
    if (mpi && strcmp(mpi->build, TR_MPI_BUILD) != 0)
        ts_fail(st, TS_UNSUPPORTED, "%s belongs to another version of this program", by->library);
    if (st->code)
        return ts_context(st, "started as one of %d processes, for which lgd has to be built where %s is installed",
                          number(by->size), by->package);
    if (mpi->start(&ranks->world, st) != TS_OK) return st->code;
    const int begun = number(by->size), seen = ranks->world.count;
    if (seen != begun) { /* each would train by itself, all of them in one folder */
        mpi->finish();
        return ts_fail(st, TS_INVALID,
                       "started as one of %d processes, of which %s sees %d: use the mpirun of %s, or build lgd with "
                       "the MPI of this one",
                       begun, by->library, seen, by->package);
    }
    ranks->mpi = mpi;
    ranks->rank = ranks->world.rank;
    ranks->count = ranks->world.count;
    return TS_OK;
}

void tr_ranks_end(tr_ranks *ranks, int status)
{
    enum { PATIENCE = 5 }; /* seconds; ranks that fail together do so within a step's end */
    if (!ranks->mpi) return;
    if (!ranks->mpi->all_here(PATIENCE)) ranks->mpi->abort(status ? status : 1);
    ranks->mpi->finish();
    *ranks = (tr_ranks){.count = 1};
}

int tr_share(const tr_ranks *ranks, int total, int *from)
{
    *from = (int)((int64_t)total * ranks->rank / ranks->count);
    return (int)((int64_t)total * (ranks->rank + 1) / ranks->count) - *from;
}

int tr_first_failed(const tr_ranks *ranks, bool failed)
{
    const int mine = failed ? ranks->rank : ranks->count, first = ranks->mpi ? ranks->mpi->least(mine) : mine;
    return first < ranks->count ? first : -1;
}

ts_code tr_agree(const tr_ranks *ranks, ts_code code, ts_status *st)
{
    if (!ranks->mpi || tr_first_failed(ranks, code != TS_OK) < 0) return code;
    if (code == TS_OK) *st = (ts_status){.code = TS_INVALID};
    return st->code;
}

ts_code tr_same_bytes(const tr_ranks *ranks, const void *data, size_t bytes, const char *what, ts_status *st)
{
    if (!ranks->mpi) return TS_OK;
    const uint64_t mine = ts_hash(data, bytes, 0);
    uint64_t first = mine;
    ranks->mpi->broadcast(&first, sizeof first);
    return tr_agree(ranks, first == mine ? TS_OK : ts_fail(st, TS_INVALID, "%s rank 0's", what), st);
}
