/* Shared objects of ours that a program loads when it needs what stands behind them. */
#ifndef IO_LIBRARY_H
#define IO_LIBRARY_H
#include "tensor/status.h"

/* The symbol of file, which is in ../lib/lgd beside the program (so it is after make and after make install) or in the
 * installed lib/lgd. It stays loaded. NULL and st on failure: TS_IO where the file is missing or cannot be loaded,
 * TS_UNSUPPORTED where it is not ours. */
const void *io_library_load(const char *file, const char *symbol, ts_status *st);
#endif
