#include "infer/meta.h"
#include "data/file.h"
#include "data/text.h"
#include "render/scene.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* In the order of lgd_files. */
static const char *const meaning[LGD_OUTPUTS] = {
    "sRGB, 8 bit: diffuse albedo",
    "sRGB, 8 bit: F0, the reflectance straight on",
    "linear, 16 bit: perceptual roughness, alpha = roughness^2",
    "linear, 16 bit: (n + 1) / 2 of the unit normal n, x to the right, y %s, z toward the camera",
    "linear, %s: diffuse, specular (F0), roughness, normal; R, G, B are diffuse",
    "sRGB, 8 bit: the photograph and the maps under its light",
    "sRGB, 8 bit: the maps under four lights",
    "sRGB, 8 bit: base colour of the metallic workflow",
    "linear, 16 bit: metalness",
    "linear, 16 bit: height, %s",
    "glTF 2.0: a square with the material",
    "MaterialX 1.39: the material",
    "glTF 2.0 as one file: a square with the material",
    "linear, 16 bit: red ambient occlusion, green roughness, blue metalness",
    "linear, 8 bit: ambient occlusion of the height, 1 is open",
    "a page for browsers: the material under a light that follows the pointer"};

static void print_scene(FILE *f, const lgd_photo *p, const lgd_order *order)
{
    fprintf(f, "field of view: %.2f degrees across the square (%s)\n", rd_fov_of((double)p->camera[2]),
            order->fov_from);
    fprintf(f, "camera: %.4f %.4f %.4f, in sides of the square, from its centre\n", (double)p->camera[0],
            (double)p->camera[1], (double)p->camera[2]);
    if (order->ambient > 0) fprintf(f, "ambient light: of radiance %.4f\n", order->ambient);
    fprintf(f, "light: %.4f %.4f %.4f, of power %.4f\n", (double)p->light[0], (double)p->light[1], (double)p->light[2],
            (double)p->power);
}

static const char incomplete[] = "incomplete";

/* The line of a file in a meta.txt, with its end; NULL: it has none. */
static const char *line_of(const char *text, const char *file, size_t *size)
{
    const size_t length = strlen(file);
    for (const char *line = text, *end; *line; line = end) {
        end = strchr(line, '\n');
        end = end ? end + 1 : line + strlen(line);
        if (strncmp(line, file, length) != 0 || line[length] != ':') continue;
        *size = (size_t)(end - line);
        return line;
    }
    return NULL;
}

unsigned lgd_meta_files(const char *text)
{
    unsigned files = 0;
    size_t size;
    if (!strstr(text, "\nestimate: ") && strncmp(text, incomplete, strlen(incomplete)) != 0) return 0;
    for (int k = 0; k < LGD_OUTPUTS; k++)
        if (line_of(text, lgd_files[k], &size)) files |= 1u << k;
    return files;
}

static void print(FILE *f, const lgd_photo *photo, const lgd_order *order, const lgd_output_result *facts,
                  const char *before, unsigned kept)
{
    char height[128];
    snprintf(height, sizeof height, "value v is %.6f + %.6f v sides of the square, up is toward the camera",
             (double)facts->low, (double)(facts->high - facts->low));
    const bool colours = (order->which | kept) & (LGD_OUT_DIFFUSE | LGD_OUT_SPECULAR);
    io_print_conventions(f, colours ? IO_MAPS_DIFFUSE | IO_MAPS_SPECULAR : 0, order->directx);
    for (int k = 0; k < LGD_OUTPUTS; k++) {
        size_t size = 0;
        const char *line = kept >> k & 1 ? line_of(before, lgd_files[k], &size) : NULL;
        if (line) fwrite(line, 1, size, f);
        if (line || !(order->which >> k & 1)) continue;
        const char *more = 1u << k == LGD_OUT_EXR ? order->half ? "half float" : "float"
            : 1u << k == LGD_OUT_HEIGHT           ? height
            : order->directx                      ? "down (DirectX)"
                                                  : "up (OpenGL)";
        fprintf(f, "%s: ", lgd_files[k]);
        fprintf(f, meaning[k], more);
        fputc('\n', f);
    }
    if (order->repeats)
        fputs("seamless: the maps repeat; a seam was cut through the photograph's and 7/8 of them stretched to the "
              "whole\n",
              f);
    print_scene(f, photo, order);
}

ts_code lgd_write_meta(const char *path, const lgd_photo *photo, const lgd_order *order, const lgd_output_result *facts,
                       const char *mark, const char *before, unsigned kept, ts_status *st)
{
    io_text text;
    if (io_text_begin(&text, path, st) != TS_OK) return st->code;
    print(text.f, photo, order, facts, before, kept);
    if (order->record) fputs(order->record, text.f);
    fputs(mark, text.f);
    return io_text_write(&text, path, st);
}

ts_code lgd_write_meta_begun(const char *path, unsigned files, ts_status *st)
{
    io_text text;
    if (io_text_begin(&text, path, st) != TS_OK) return st->code;
    fprintf(text.f, "%s: these files are being replaced, or a process was killed that did\n", incomplete);
    for (int k = 0; k < LGD_OUTPUTS; k++)
        if (files >> k & 1) fprintf(text.f, "%s: of this estimate or of the one before\n", lgd_files[k]);
    return io_text_write(&text, path, st);
}

char *lgd_meta_read(const char *folder)
{
    char *path = NULL, *text = NULL;
    size_t size;
    if (asprintf(&path, "%s/meta.txt", folder) < 0) return NULL;
    if (io_read_bytes(path, 1 << 16, &text, &size, NULL) != TS_OK) text = NULL;
    free(path);
    return text;
}
