/* DIR/results.jsonl: a line of JSON for each photograph whose maps are in DIR, or which failed. Several processes may
 * write it at once. The folders' meta.txt is the truth, and what a killed process owes is added when its photographs
 * are met again; a photograph that is done again gets a new line, and the old one goes at the end of the call. Lines
 * that others wrote stay. */
#ifndef CL_MANIFEST_H
#define CL_MANIFEST_H
#include "cli/infer/item.h"

#define CL_MANIFEST_NAME "results.jsonl"

typedef struct cl_manifest cl_manifest;

/* TS_INVALID where one of the plan's photographs is this file, or would have a folder of its name. */
ts_code cl_manifest_check(const cl_plan *plan, const char *folder, ts_status *st);

/* The file in folder, which exists, for the photographs of the plan. Half a line that a killed process left, and lines
 * of which there is a later one, are removed. NULL and st on failure. */
cl_manifest *cl_manifest_open(const cl_plan *plan, const char *folder, ts_status *st);

/* Adds the line of a finished item, complete or failed, as one write; of one that was done already only when the file
 * does not have it. */
ts_code cl_manifest_add(cl_manifest *m, const cl_item *item, ts_status *st);

/* Removes lines of which there is a later one. Nulls the pointer, which may be NULL. */
ts_code cl_manifest_close(cl_manifest **m, ts_status *st);
#endif
