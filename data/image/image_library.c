/* Loads the shared object that has OpenImageIO behind it, once, when the first call needs it. */
#include "data/image/oiio.h"
#include "data/library.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define FILE_NAME "liblgd_image.so"

static pthread_once_t once = PTHREAD_ONCE_INIT;
static const oi_library *library;
static ts_status failure;

static void load(void)
{
    const oi_library *found = io_library_load(FILE_NAME, OI_LIBRARY, &failure);
    if (!found) {
        ts_context(&failure, "this image needs " FILE_NAME " (install it again)");
        return;
    }
    if (strcmp(found->build, OI_BUILD) != 0) {
        ts_fail(&failure, TS_UNSUPPORTED, FILE_NAME " belongs to another version of this program: install it again");
        return;
    }
    found->start();
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
