/* Loads the shared object that has OpenImageIO behind it, once, when the first call needs it. */
#include "data/folders.h"
#include "data/image/oiio.h"
#include "tensor/threads.h"
#include <dlfcn.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define FILE_NAME "liblgd_image.so"

static pthread_once_t once = PTHREAD_ONCE_INIT;
static const oi_library *library;
static ts_status failure;

/* Beside the folder of the program or of liblgd.so: ../lib/lgd after make install, and after make of programs; lib/lgd
 * of liblgd.so after make. False where there is none. */
static bool beside_us(char *path, size_t size)
{
    static const char *const folders[] = {"../lib/lgd", "lib/lgd"};
    char own[PATH_MAX - 64];
    if (!io_own_folder(own, sizeof own)) return false;
    for (int i = 0; i < 2; i++)
        if (snprintf(path, size, "%s/%s/" FILE_NAME, own, folders[i]) < (int)size && access(path, F_OK) == 0)
            return true;
    return false;
}

static void load(void)
{
    char path[PATH_MAX];
    if (!beside_us(path, sizeof path)) snprintf(path, sizeof path, "%s/lgd/" FILE_NAME, io_library_folder);
    if (access(path, F_OK) != 0) {
        ts_fail(&failure, TS_IO,
                "this image needs " FILE_NAME
                ", which is neither in ../lib/lgd beside the program or library nor in %s/lgd: install it again",
                io_library_folder);
        return;
    }
    void *handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
        ts_fail(&failure, TS_IO, "%s", dlerror());
        return;
    }
    const oi_library *found = dlsym(handle, OI_LIBRARY);
    if (!found || strcmp(found->build, OI_BUILD) != 0) {
        ts_fail(&failure, TS_UNSUPPORTED, "%s: belongs to another version of this program", path);
        return;
    }
    found->start(ts_threads());
    library = found;
}

/* NULL with st, which names what it was needed for. */
static const oi_library *loaded(const char *name, ts_status *st)
{
    pthread_once(&once, load);
    if (!library) ts_fail(st, failure.code, "%s: %s", name, failure.message);
    return library;
}

ts_code oi_read(const char *path, int64_t max_pixels, double max_bytes, oi_image *image, ts_status *st)
{
    memset(image, 0, sizeof *image);
    const oi_library *l = loaded(path, st);
    if (!l) return failure.code;
    const ts_code code = l->read(path, max_pixels, max_bytes, image, st);
    if (code != TS_OK) oi_free(image);
    return code;
}

void oi_free(oi_image *image)
{
    free(image->data);
    free(image->icc);
    memset(image, 0, sizeof *image);
}

ts_code oi_encode_jpeg(const char *name, const oi_encoding *e, const uint8_t *pixels, unsigned char **bytes,
                       size_t *size, ts_status *st)
{
    const oi_library *l = loaded(name, st);
    return l ? l->encode_jpeg(name, e, pixels, bytes, size, st) : failure.code;
}

bool oi_knows_extension(const char *extension)
{
    /* The common ones need no look into the library. */
    static const char *const common[] = {"png", "jpg", "jpeg", "tif", "tiff", "exr", "hdr"};
    for (size_t i = 0; i < sizeof common / sizeof *common; i++)
        if (strcasecmp(extension, common[i]) == 0) return true;
    if (strcasecmp(extension, "txt") == 0) return false;
    const oi_library *l = loaded(extension, NULL);
    return l && l->knows_extension(extension);
}
