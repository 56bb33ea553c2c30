/* Files and folders that appear when they are complete. They are made under a hidden name in the folder where they will
 * stand, .lgd-KERNEL-PROCESS-NUMBER.tmp, and renamed. A killed process leaves its hidden names; ts_sweep removes them.
 *
 * Process numbers are used again, and those of other hosts or containers say nothing here. Whether a maker is alive is
 * told by a lock (flock) that it holds on what it makes, which ends with the process. KERNEL is a number of this boot
 * of this machine: on a file system that several machines share, a lock may be seen on one of them alone. */
#ifndef TS_NEW_FILE_H
#define TS_NEW_FILE_H
#include "tensor/status.h"
#include <stddef.h>
#include <stdint.h>

/* A file that is being written: put as often as needed (the first error stays), then end. */
typedef struct ts_new_file {
    const char *name; /* the caller's path, which must live until the end */
    char *path;       /* what is replaced: name, or the file that the link name leads to */
    char *temporary;  /* NULL: name is a device or a pipe and is written to directly */
    int fd, error;
    int64_t written;
} ts_new_file;

/* A symbolic link to a file is followed. After a failure there is nothing to end. */
ts_code ts_new_file_begin(ts_new_file *f, const char *name, ts_status *st);
void ts_new_file_put(ts_new_file *f, const void *data, size_t size);
/* Syncs the file and renames it: a reader sees the old file or the whole new one. When code is an error, or one is met
 * here, the temporary file is removed and the old one stays. Returns code, or what was met. */
ts_code ts_new_file_end(ts_new_file *f, ts_code code, ts_status *st);

/* A new hidden folder in parent: *path is malloced and the caller's, *lock a descriptor that is closed when the folder
 * has been renamed or removed. */
ts_code ts_hidden_folder(const char *parent, char **path, int *lock, ts_status *st);
/* Removes the folder and the files in it, and closes the lock. A folder that is no more is fine. */
void ts_hidden_folder_remove(const char *path, int *lock);

/* The folder that path stands in, malloced and the caller's; NULL: no memory. */
char *ts_folder_of(const char *path);

/* path = folder/name; TS_INVALID: it is too long. */
enum { TS_PATH_LENGTH = 4096 };
ts_code ts_path_in(char path[TS_PATH_LENGTH], const char *folder, const char *name, ts_status *st);

/* from/name becomes to/name, in place of what has that name there. */
ts_code ts_move_file(const char *from, const char *to, const char *name, ts_status *st);

/* Writes the names in folder to the disk. 0, or errno; a file system that cannot do so is no error. */
int ts_sync_folder(const char *folder);

/* Removes what killed processes have left in folder: hidden names without a lock if they were made under this boot of
 * this machine, otherwise, and where the file system has no locks, those that have not changed for a day. What cannot
 * be removed stays. */
void ts_sweep(const char *folder);
#endif
