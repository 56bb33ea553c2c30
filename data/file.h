/* Whole files. */
#ifndef IO_FILE_H
#define IO_FILE_H
#include "tensor/status.h"
#include <stddef.h>

/* As ts_new_file does (tensor/new_file.h): a reader sees the old file or the whole new one, and after a failure nothing
 * is left behind. ts_sync_folder, called once for all files of a folder, makes the new names survive a power cut. A
 * path that exists and is no regular file (a device, a pipe) is written to directly; a symbolic link is followed. */
ts_code io_write_bytes(const char *path, const void *bytes, size_t size, ts_status *st);

/* The whole file, with a zero byte after its end; malloced, the caller frees it. More than limit bytes are an error. */
ts_code io_read_bytes(const char *path, size_t limit, char **bytes, size_t *size, ts_status *st);

/* TS_OK when path is a readable regular file that is not empty; otherwise the message says what it is. */
ts_code io_check_file(const char *path, ts_status *st);
#endif
