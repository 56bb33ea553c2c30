/* What meta.txt and results.jsonl say of how a photograph's files were made. meta.txt is written last and so is the
 * truth: a line of results.jsonl that a killed process owes is made from it. */
#ifndef CL_RECORD_H
#define CL_RECORD_H
#include "cli/infer/item.h"
#include "cli/infer/options.h"

/* The lines of meta.txt that are the same for all photographs of a call: the weights' name and the hash of their bytes,
 * and every option that changes a byte of what is written. NULL and st on failure; the caller frees it. */
char *cl_recipe(const cl_command *c, const char *weights, uint64_t hash, ts_status *st);

/* Whether the photograph's folder is complete, made from these very bytes by this recipe. Then *result gets what
 * cl_record_result finds in its meta.txt. */
bool cl_record_is_done(const cl_command *c, const cl_item *item, const char *recipe, char **result);

/* The lines for meta.txt of an estimated item: the photograph's hash, the recipe and "result: {…}", what of the
 * line in results.jsonl the estimate decides. NULL: no memory; the caller frees it. */
char *cl_record(const cl_command *c, const cl_item *item, const char *recipe);

/* What stands behind "result: {" in the text, up to the closing brace; NULL: there is none, or no memory. The caller
 * frees it. */
char *cl_record_result(const char *text);
#endif
