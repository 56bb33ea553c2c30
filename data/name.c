#include "data/name.h"
#include <math.h>
#include <string.h>
#include <strings.h>

/* cut: without its extension. */
static void last_part(const char *path, bool cut, char *name, size_t capacity)
{
    size_t end = strlen(path);
    while (end > 1 && path[end - 1] == '/') end--;
    size_t start = end;
    while (start > 0 && path[start - 1] != '/') start--;
    size_t length = end - start;
    for (size_t i = length; cut && i-- > 1;)
        if (path[start + i] == '.') {
            length = i;
            break;
        }
    if (length >= capacity) length = capacity - 1;
    memcpy(name, path + start, length);
    name[length] = 0;
}

void io_name_from_path(const char *path, char *name, size_t capacity) { last_part(path, true, name, capacity); }

void io_name_of_folder(const char *path, char *name, size_t capacity) { last_part(path, false, name, capacity); }

bool io_is_image_name(const char *name)
{
    static const char *const endings[] = {"jpg", "jpeg", "png", "heic", "heif", "avif", "webp", "tif", "tiff",
                                          "exr", "hdr",  "bmp", "tga",  "ppm",  "pgm",  "dng",  "jp2", "jxl"};
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; name[0] != '.' && dot && i < sizeof endings / sizeof *endings; i++)
        if (strcasecmp(dot + 1, endings[i]) == 0) return true;
    return false;
}

void io_normal_decode(const float stored[3], bool directx, float normal[3])
{
    float x = 2 * stored[0] - 1, y = 2 * stored[1] - 1, z = 2 * stored[2] - 1;
    if (directx) y = -y;
    /* Compression and averaging leave normals at or below the surface, which nothing can show: they are lifted to the
     * grazing limit. */
    float length = sqrtf(x * x + y * y + z * z);
    if (!(length > 1e-6f) || !isfinite(length)) x = y = 0, z = length = 1;
    x /= length, y /= length, z /= length;
    if (z < 1e-3f) {
        float flat = sqrtf(x * x + y * y);
        z = 1e-3f;
        if (flat > 0) x *= sqrtf(1 - z * z) / flat, y *= sqrtf(1 - z * z) / flat;
    }
    normal[0] = x;
    normal[1] = y;
    normal[2] = z;
}
