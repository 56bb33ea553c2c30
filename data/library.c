#include "data/library.h"
#include "data/folders.h"
#include <dlfcn.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Beside the folder of the program or of liblgd.so: ../lib/lgd after make install, and after make of programs; lib/lgd
 * of liblgd.so after make. False where there is none. */
static bool beside_us(const char *file, char *path, size_t size)
{
    static const char *const folders[] = {"../lib/lgd", "lib/lgd"};
    char own[PATH_MAX - 64];
    if (!io_own_folder(own, sizeof own)) return false;
    for (int i = 0; i < 2; i++)
        if (snprintf(path, size, "%s/%s/%s", own, folders[i], file) < (int)size && access(path, F_OK) == 0) return true;
    return false;
}

const void *io_library_load(const char *file, const char *symbol, ts_status *st)
{
    char path[PATH_MAX];
    if (!beside_us(file, path, sizeof path)) snprintf(path, sizeof path, "%s/lgd/%s", io_library_folder, file);
    if (access(path, F_OK) != 0) {
        ts_fail(st, TS_IO, "%s is neither in ../lib/lgd beside the program or library nor in %s/lgd", file,
                io_library_folder);
        return NULL;
    }
    void *handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    const void *found = handle ? dlsym(handle, symbol) : NULL;
    if (!handle) ts_fail(st, TS_IO, "%s", dlerror());
    else if (!found) ts_fail(st, TS_UNSUPPORTED, "%s: belongs to another version of this program", path);
    return found;
}
