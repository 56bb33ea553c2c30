/* An evaluation in parts: by --shard on any machines that share the output folder, or by the processes that a launcher
 * of MPI programs starts. A process evaluates its materials and writes them to a file; the one that ends last finds all
 * files, and reports as one process would. Nobody waits for anybody, and no MPI library is needed. */
#ifndef EV_SHARDS_H
#define EV_SHARDS_H
#include "eval/command.h"
#include "eval/run.h"

/* A number of all that decides the results: options, methods, the materials' names (not what their files hold),
 * weights, version, instruction set. Parts of other numbers are not put together. model: the weights' file. 0: no
 * memory. */
uint64_t ev_shards_print(const ev_command *c, const ev_run *r, const char *model);

/* Writes the report and failures of r, which did r->shard, to a file in folder. */
ts_code ev_shard_write(const ev_run *r, uint64_t print, const char *folder, ts_status *st);

/* Locks folder against other processes that put parts together, where the file system can; closed by the caller, -1
 * where it cannot be opened. */
int ev_shards_lock(const char *folder);

typedef struct ev_parts {
    int missing; /* not there, or of another evaluation */
    int first;   /* of them */
    int strange; /* of them, those with a file that is of another evaluation, or of none */
    bool mine;   /* r's own is there, which it is not when another process has put it together with the others */
} ev_parts;

/* With all parts there, the report and failures of r become those of all of them. */
ts_code ev_shards_merge(ev_run *r, uint64_t print, const char *folder, ev_parts *parts, ts_status *st);

/* Once the reports are written: removes the parts' files. */
void ev_shards_remove(const ev_run *r, const char *folder);
#endif
