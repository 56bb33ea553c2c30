/* What the five programs share: exit codes, messages, progress, Ctrl-C, streams. The only code besides the main.c files
 * that prints. */
#ifndef CL_CLI_H
#define CL_CLI_H
#include "tensor/status.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CL_OK = 0, CL_FAILED = 1, CL_USAGE = 2, CL_INTERRUPTED = 130 };

/* The first call of every main: opens /dev/null as those of the descriptors 0 to 2 that are closed, so that no file
 * that is opened later becomes the standard stream that messages go to. It is opened the wrong way round: what reads or
 * writes such a stream gets an error. Ends the program where there is no /dev/null. */
void cl_open_streams(void);

/* Locale "C" for numbers, SIGPIPE as an error of write, LGD_ISA checked. Returns CL_OK or prints one line and returns
 * CL_USAGE. */
int cl_init(const char *program);

/* Of several processes of one command: messages begin with "program: who: " from now on (who empty: with "program: ").
 * NULL: there are none until the next call. who is kept. */
void cl_speak_as(const char *who);

/* "program: message" on stderr. cl_usage adds "try 'program --help'" and returns CL_USAGE; cl_failed returns CL_FAILED.
 */
int cl_usage(const char *format, ...) __attribute__((format(printf, 1, 2)));
int cl_failed(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* The same after cl_interrupted: CL_INTERRUPTED, as shells report Ctrl-C. */
int cl_stopped(const char *format, ...) __attribute__((format(printf, 1, 2)));
void cl_note(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Whole-string numbers in the C locale, within [lo, hi]; false otherwise. */
bool cl_parse_int(const char *text, int64_t lo, int64_t hi, int64_t *value);
bool cl_parse_real(const char *text, double lo, double hi, double *value);
/* Bytes: a number, or one with K, M or G (powers of 1024) behind it; at least 1. */
bool cl_parse_size(const char *text, double *bytes);
/* "I/N" with I in 1 .. N and N up to a million. */
bool cl_parse_shard(const char *text, int *shard, int *shards);

/* Flushes stdout; cl_finish says why that failed. */
void cl_flush(void);

/* Flushes stdout; a failed write (closed pipe, full disk) prints one line and returns CL_FAILED, otherwise code. */
int cl_finish(int code);

/* --version's text on stdout. */
void cl_print_version(void);

/* A line on stderr with count, rate and ETA, only on a terminal, at most ten times a second. */
typedef struct cl_progress {
    const char *what;
    int64_t total;
    double start, last;
    bool terminal;
} cl_progress;
cl_progress cl_progress_start(const char *what, int64_t total);
void cl_progress_show(cl_progress *p, int64_t done, const char *extra /* or NULL */);
void cl_progress_end(cl_progress *p);

double cl_seconds(void); /* monotonic */

/* With LGD_TRACE=1 in the environment: a line on stderr for each operation, with its shapes, way and time. */
void cl_trace(void);

/* Ctrl-C, SIGTERM and, where nohup does not ignore it, SIGHUP set a flag; a second Ctrl-C or SIGTERM ends the program
 * at once. */
void cl_catch_interrupt(void);
bool cl_interrupted(void);

/* Creates an output folder and its parents. An existing folder is fine: what killed processes have left in it is
 * removed (ts_sweep). made (may be NULL): how long the path of the first is that this call has created, 0: none. */
ts_code cl_make_folder(const char *path, size_t *made, ts_status *st);

/* Removes what of a path is empty, from its end to the first made bytes of it. */
void cl_remove_made(const char *path, size_t made);
#endif
