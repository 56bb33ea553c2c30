/* The folder of this program, or of the shared library that this is part of. */
#include "data/folders.h"
#include <dlfcn.h>
#include <limits.h>
#include <link.h>
#include <stdlib.h>
#include <string.h>

static char folder[PATH_MAX];
static bool found;

/* When the program begins or the library is loaded: the name that it was loaded by may be relative to the working
 * folder of then. */
__attribute__((constructor)) static void find(void)
{
    static const char here; /* an address in this object */
    Dl_info info;
    struct link_map *object = NULL;
    /* The program itself has an empty name, or none where it is linked statically. */
    const bool library = dladdr1(&here, &info, (void **)&object, RTLD_DL_LINKMAP) && object && object->l_name &&
        *object->l_name;
    found = realpath(library ? object->l_name : "/proc/self/exe", folder);
    if (found) *strrchr(folder, '/') = 0;
}

bool io_own_folder(char *path, size_t size)
{
    const size_t length = strlen(folder);
    if (!found || length >= size) return false;
    memcpy(path, folder, length + 1);
    return true;
}
