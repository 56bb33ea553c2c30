/* A program's options as one table, which parses them and prints the help. */
#ifndef CL_ARGUMENTS_H
#define CL_ARGUMENTS_H
#include "tensor/status.h"
#include <getopt.h>
#include <stdio.h>

typedef struct cl_argument {
    int key;           /* a letter: also the short option; above 255: long only; 0 ends the table */
    const char *name;  /* without the dashes */
    const char *value; /* what stands after it in the help, or NULL for a switch */
    const char *help;
} cl_argument;

enum { CL_ARGUMENT_END = -1, CL_ARGUMENT_BAD = -2 };

/* The key of the next option and its value through the pointer; at the end the operands are argv[*operands] …
 * argv[argc-1] (GNU order: options may stand behind operands, "--" ends them). CL_ARGUMENT_BAD with st for what the
 * table does not have. */
int cl_argument_next(int argc, char **argv, const cl_argument *table, const char **value, int *operands, ts_status *st);

/* getopt_long, but that a fault is CL_ARGUMENT_BAD with st. shorts begins with ":". */
int cl_option_next(int argc, char **argv, const char *shorts, const struct option *longs, ts_status *st);

/* The word behind that value, for an option that has two; NULL when there is none. */
const char *cl_argument_second(int argc, char **argv);

/* TS_INVALID with st where the name of a file or folder is empty, as a shell's variable may be. what: the option, or
 * what the name is of. */
ts_code cl_check_name(const char *what, const char *name, ts_status *st);

/* A line (or more) for each option. */
void cl_argument_help(const cl_argument *table, FILE *out);
#endif
