/* The folder of this program, or of the shared library that this is part of. */
#include "data/folders.h"
#include <dlfcn.h>
#include <limits.h>
#include <link.h>
#include <stdlib.h>
#include <string.h>

bool io_own_folder(char *path, size_t size)
{
    static const char here; /* an address in this object */
    Dl_info info;
    struct link_map *object = NULL;
    char whole[PATH_MAX];
    /* The program itself has an empty name, or none where it is linked statically. */
    const bool library = dladdr1(&here, &info, (void **)&object, RTLD_DL_LINKMAP) && object && object->l_name &&
        *object->l_name;
    if (!realpath(library ? object->l_name : "/proc/self/exe", whole)) return false;
    *strrchr(whole, '/') = 0;
    const size_t length = strlen(whole);
    if (length >= size) return false;
    memcpy(path, whole, length + 1);
    return true;
}
