/* glTF 2.0 documents, and the same with their images as one binary file (section 4 of the specification). */
#include "data/file.h"
#include "data/html.h"
#include "data/json.h"
#include "data/text.h"
#include "infer/export.h"
#include "tensor/new_file.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Little-endian, as glTF wants it on any machine. */
static unsigned char *put_float(unsigned char *to, float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    for (int i = 0; i < 4; i++) *to++ = (unsigned char)(bits >> 8 * i);
    return to;
}

enum { CORNERS = 4, POSITION = 0, NORMAL = 48, TANGENT = 96, TEXCOORD = 160, INDEX = 192, BUFFER = 204 };

/* Corners anticlockwise from the lower left; texture coordinates begin in the upper left. */
static void square(unsigned char out[BUFFER])
{
    static const float x[CORNERS] = {-0.5f, 0.5f, 0.5f, -0.5f}, y[CORNERS] = {-0.5f, -0.5f, 0.5f, 0.5f};
    static const unsigned char index[6] = {0, 1, 2, 0, 2, 3};
    unsigned char *at = out;
    for (int i = 0; i < CORNERS; i++) at = put_float(put_float(put_float(at, x[i]), y[i]), 0);
    for (int i = 0; i < CORNERS; i++) at = put_float(put_float(put_float(at, 0), 0), 1);
    for (int i = 0; i < CORNERS; i++) at = put_float(put_float(put_float(put_float(at, 1), 0), 0), 1);
    for (int i = 0; i < CORNERS; i++) at = put_float(put_float(at, x[i] + 0.5f), 0.5f - y[i]);
    for (int i = 0; i < 6; i++) *at++ = index[i], *at++ = 0;
}

enum { IMAGES_MOST = 5 };
#define IMAGE_LIMIT ((size_t)1 << 31) /* of a binary file the lengths have 32 bits */

/* The images in the order of the document's textures. */
static const char *const f0_images[] = {"diffuse.png", "roughness.png", "normal.png", "specular.png", "occlusion.png"},
                         *const metallic_images[] = {"basecolor.png", "orm.png", "normal.png"};

static int count_images(const lgd_gltf *kind) { return kind->metallic ? 3 : 4 + kind->occlusion; }

static const char f0_material[] =
    "    \"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0}, \"metallicFactor\": 0, "
    "\"metallicRoughnessTexture\": {\"index\": 1}},\n"
    "    \"normalTexture\": {\"index\": 2},\n"
    "    \"extensions\": {\"KHR_materials_ior\": {\"ior\": 1000}, \"KHR_materials_specular\": "
    "{\"specularColorTexture\": {\"index\": 3}}}\n",
                  metallic_material[] = "    \"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0}, "
                                        "\"metallicRoughnessTexture\": {\"index\": 1}},\n"
                                        "    \"occlusionTexture\": {\"index\": 1},\n"
                                        "    \"normalTexture\": {\"index\": 2}\n";

/* size[k]: bytes of image k, which stand behind the geometry in a binary file, each from a multiple of 4 on; NULL: a
 * document that names them. */
static void print_gltf(FILE *f, const lgd_gltf *kind, const size_t *size)
{
    const int images = count_images(kind);
    const char *const *name = kind->metallic ? metallic_images : f0_images;
    unsigned char bytes[BUFFER];
    size_t total = BUFFER;
    fprintf(f,
            "{\n"
            "  \"asset\": {\"version\": \"2.0\", \"generator\": \"lgd-infer\"},\n"
            "%s"
            "  \"scene\": 0,\n"
            "  \"scenes\": [{\"nodes\": [0]}],\n"
            "  \"nodes\": [{\"mesh\": 0, \"name\": ",
            kind->metallic ? "" : "  \"extensionsUsed\": [\"KHR_materials_specular\", \"KHR_materials_ior\"],\n");
    io_put_json(f, kind->name);
    fputs("}],\n"
          "  \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0, \"NORMAL\": 1, \"TANGENT\": 2, "
          "\"TEXCOORD_0\": 3}, \"indices\": 4, \"material\": 0}]}],\n"
          "  \"materials\": [{\n"
          "    \"name\": ",
          f);
    io_put_json(f, kind->name);
    fputs(",\n", f);
    if (kind->occlusion && !kind->metallic) fputs("    \"occlusionTexture\": {\"index\": 4},\n", f);
    fputs(kind->metallic ? metallic_material : f0_material, f);
    fputs("  }],\n  \"textures\": [", f);
    for (int k = 0; k < images; k++) fprintf(f, "%s{\"source\": %d, \"sampler\": 0}", k ? ", " : "", k);
    fprintf(f, "],\n  \"samplers\": [{\"magFilter\": 9729, \"minFilter\": 9987, \"wrapS\": %d, \"wrapT\": %d}],\n",
            kind->repeats ? 10497 : 33071, kind->repeats ? 10497 : 33071);
    fputs("  \"images\": [", f);
    for (int k = 0; k < images; k++)
        if (size) fprintf(f, "%s{\"bufferView\": %d, \"mimeType\": \"image/png\"}", k ? ", " : "", k + 4);
        else fprintf(f, "%s{\"uri\": \"%s\"}", k ? ", " : "", name[k]);
    fprintf(f,
            "],\n"
            "  \"accessors\": [\n"
            "    {\"bufferView\": 0, \"byteOffset\": %d, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\", "
            "\"min\": [-0.5, -0.5, 0], \"max\": [0.5, 0.5, 0]},\n"
            "    {\"bufferView\": 0, \"byteOffset\": %d, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\"},\n"
            "    {\"bufferView\": 1, \"byteOffset\": 0, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC4\"},\n"
            "    {\"bufferView\": 2, \"byteOffset\": 0, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC2\"},\n"
            "    {\"bufferView\": 3, \"byteOffset\": 0, \"componentType\": 5123, \"count\": 6, \"type\": \"SCALAR\"}\n"
            "  ],\n"
            "  \"bufferViews\": [\n"
            "    {\"buffer\": 0, \"byteOffset\": 0, \"byteLength\": %d, \"byteStride\": 12, \"target\": 34962},\n"
            "    {\"buffer\": 0, \"byteOffset\": %d, \"byteLength\": %d, \"byteStride\": 16, \"target\": 34962},\n"
            "    {\"buffer\": 0, \"byteOffset\": %d, \"byteLength\": %d, \"byteStride\": 8, \"target\": 34962},\n"
            "    {\"buffer\": 0, \"byteOffset\": %d, \"byteLength\": %d, \"target\": 34963}",
            POSITION, NORMAL, TANGENT, TANGENT, TEXCOORD - TANGENT, TEXCOORD, INDEX - TEXCOORD, INDEX, BUFFER - INDEX);
    for (int k = 0; k < images && size; k++) {
        fprintf(f, ",\n    {\"buffer\": 0, \"byteOffset\": %zu, \"byteLength\": %zu}", total, size[k]);
        total += (size[k] + 3) / 4 * 4;
    }
    fprintf(f, "\n  ],\n  \"buffers\": [{\"byteLength\": %zu", total);
    if (!size) {
        square(bytes);
        fputs(", \"uri\": \"data:application/octet-stream;base64,", f);
        io_put_base64(f, bytes, sizeof bytes);
        fputc('"', f);
    }
    fputs("}]\n}\n", f);
}

/* The document as text, malloced; NULL with st. */
static char *document(const char *path, const lgd_gltf *kind, const size_t *size, size_t *length, ts_status *st)
{
    io_text text;
    if (io_text_begin(&text, path, st) != TS_OK) return NULL;
    print_gltf(text.f, kind, size);
    io_text_end(&text, path, st);
    *length = text.size;
    return text.bytes;
}

ts_code lgd_write_gltf(const char *path, const lgd_gltf *kind, ts_status *st)
{
    size_t length = 0;
    char *text = document(path, kind, NULL, &length, st);
    if (text) io_write_bytes(path, text, length, st);
    free(text);
    return st->code;
}

static void put_word(unsigned char **to, size_t v)
{
    for (int i = 0; i < 4; i++) *(*to)++ = (unsigned char)(v >> 8 * i);
}

/* Header, the document filled up with blanks, geometry and images filled up with zeros. */
static ts_code put_together(const char *path, const lgd_gltf *kind, int images, char *const *image, const size_t *size,
                            ts_status *st)
{
    size_t length = 0, binary = BUFFER;
    char *text = document(path, kind, size, &length, st);
    if (!text) return st->code;
    for (int k = 0; k < images; k++) binary += (size[k] + 3) / 4 * 4;
    const size_t padded = (length + 3) / 4 * 4, total = 12 + 8 + padded + 8 + binary;
    unsigned char *bytes = total < IMAGE_LIMIT ? calloc(total, 1) : NULL, *at = bytes;
    ts_code code = TS_OK;
    if (total >= IMAGE_LIMIT)
        code = ts_fail(st, TS_UNSUPPORTED, "%s: %zu bytes are more than a .glb can have: gltf has no such limit", path,
                       total);
    else if (!bytes) code = ts_fail(st, TS_NOMEM, "%s: no memory for %zu bytes", path, total);
    if (!code) {
        put_word(&at, 0x46546c67), put_word(&at, 2), put_word(&at, total);
        put_word(&at, padded), put_word(&at, 0x4e4f534a);
        memset(at, ' ', padded);
        memcpy(at, text, length);
        at += padded;
        put_word(&at, binary), put_word(&at, 0x004e4942);
        square(at);
        at += BUFFER;
        for (int k = 0; k < images; k++, at += (size[k - 1] + 3) / 4 * 4) memcpy(at, image[k], size[k]);
        code = io_write_bytes(path, bytes, total, st);
    }
    free(bytes);
    free(text);
    return code;
}

ts_code lgd_write_glb(const char *path, const char *folder, const lgd_gltf *kind, ts_status *st)
{
    const int images = count_images(kind);
    const char *const *name = kind->metallic ? metallic_images : f0_images;
    char file[TS_PATH_LENGTH], *image[IMAGES_MOST] = {NULL};
    size_t size[IMAGES_MOST] = {0};
    ts_code code = TS_OK;
    for (int k = 0; k < images && !code; k++) {
        code = ts_path_in(file, folder, name[k], st);
        if (!code) code = io_read_bytes(file, IMAGE_LIMIT, &image[k], &size[k], st);
    }
    if (!code) code = put_together(path, kind, images, image, size, st);
    for (int k = 0; k < images; k++) free(image[k]);
    return code;
}
