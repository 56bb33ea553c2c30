#include "infer/export.h"
#include "data/file.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void base64(FILE *f, const unsigned char *bytes, size_t n)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < n; i += 3) {
        const uint32_t v = (uint32_t)bytes[i] << 16 | (i + 1 < n ? (uint32_t)bytes[i + 1] << 8 : 0) |
            (i + 2 < n ? bytes[i + 2] : 0);
        fputc(digit[v >> 18], f);
        fputc(digit[v >> 12 & 63], f);
        fputc(i + 1 < n ? digit[v >> 6 & 63] : '=', f);
        fputc(i + 2 < n ? digit[v & 63] : '=', f);
    }
}

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

static const char gltf_before[] =
    "{\n"
    "  \"asset\": {\"version\": \"2.0\", \"generator\": \"lgd-infer\"},\n"
    "  \"extensionsUsed\": [\"KHR_materials_specular\", \"KHR_materials_ior\"],\n"
    "  \"scene\": 0,\n"
    "  \"scenes\": [{\"nodes\": [0]}],\n"
    "  \"nodes\": [{\"mesh\": 0, \"name\": \"sample\"}],\n"
    "  \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0, \"NORMAL\": 1, \"TANGENT\": 2, "
    "\"TEXCOORD_0\": 3}, \"indices\": 4, \"material\": 0}]}],\n"
    "  \"materials\": [{\n"
    "    \"name\": \"sample\",\n"
    "    \"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0}, \"metallicFactor\": 0, "
    "\"metallicRoughnessTexture\": {\"index\": 2}},\n"
    "    \"normalTexture\": {\"index\": 3},\n"
    "    \"extensions\": {\"KHR_materials_ior\": {\"ior\": 0}, \"KHR_materials_specular\": {\"specularColorTexture\": "
    "{\"index\": 1}}}\n"
    "  }],\n"
    "  \"textures\": [{\"source\": 0, \"sampler\": 0}, {\"source\": 1, \"sampler\": 0}, {\"source\": 2, \"sampler\": "
    "0}, {\"source\": 3, \"sampler\": 0}],\n"
    "  \"samplers\": [{\"magFilter\": 9729, \"minFilter\": 9987, \"wrapS\": 33071, \"wrapT\": 33071}],\n"
    "  \"images\": [{\"uri\": \"diffuse.png\"}, {\"uri\": \"specular.png\"}, {\"uri\": \"roughness.png\"}, {\"uri\": "
    "\"normal.png\"}],\n";

static void print_gltf(FILE *f)
{
    unsigned char bytes[BUFFER];
    square(bytes);
    fputs(gltf_before, f);
    fprintf(f,
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
            "    {\"buffer\": 0, \"byteOffset\": %d, \"byteLength\": %d, \"target\": 34963}\n"
            "  ],\n"
            "  \"buffers\": [{\"byteLength\": %d, \"uri\": \"data:application/octet-stream;base64,",
            POSITION, NORMAL, TANGENT, TANGENT, TEXCOORD - TANGENT, TEXCOORD, INDEX - TEXCOORD, INDEX, BUFFER - INDEX,
            BUFFER);
    base64(f, bytes, sizeof bytes);
    fputs("\"}]\n}\n", f);
}

static const char materialx[] =
    "<?xml version=\"1.0\"?>\n"
    "<materialx version=\"1.39\" colorspace=\"lin_rec709\">\n"
    "  <nodegraph name=\"maps\">\n"
    "    <image name=\"diffuse\" type=\"color3\"><input name=\"file\" type=\"filename\" value=\"diffuse.png\" "
    "colorspace=\"srgb_texture\"/></image>\n"
    "    <image name=\"f0\" type=\"color3\"><input name=\"file\" type=\"filename\" value=\"specular.png\" "
    "colorspace=\"srgb_texture\"/></image>\n"
    "    <image name=\"roughness\" type=\"float\"><input name=\"file\" type=\"filename\" "
    "value=\"roughness.png\"/></image>\n"
    "    <image name=\"normal_file\" type=\"vector3\"><input name=\"file\" type=\"filename\" "
    "value=\"normal.png\"/></image>\n"
    "    <normalmap name=\"normal\" type=\"vector3\"><input name=\"in\" type=\"vector3\" "
    "nodename=\"normal_file\"/></normalmap>\n"
    "    <luminance name=\"grey\" type=\"color3\"><input name=\"in\" type=\"color3\" nodename=\"f0\"/></luminance>\n"
    "    <extract name=\"grey_value\" type=\"float\"><input name=\"in\" type=\"color3\" nodename=\"grey\"/><input "
    "name=\"index\" type=\"integer\" value=\"0\"/></extract>\n"
    "    <clamp name=\"level\" type=\"float\"><input name=\"in\" type=\"float\" nodename=\"grey_value\"/><input "
    "name=\"low\" type=\"float\" value=\"0.0001\"/>"
    "<input name=\"high\" type=\"float\" value=\"0.98\"/></clamp>\n"
    "    <divide name=\"tint\" type=\"color3\"><input name=\"in1\" type=\"color3\" nodename=\"f0\"/><input "
    "name=\"in2\" type=\"float\" nodename=\"level\"/></divide>\n"
    "    <sqrt name=\"root\" type=\"float\"><input name=\"in\" type=\"float\" nodename=\"level\"/></sqrt>\n"
    "    <add name=\"above\" type=\"float\"><input name=\"in1\" type=\"float\" value=\"1\"/><input name=\"in2\" "
    "type=\"float\" nodename=\"root\"/></add>\n"
    "    <subtract name=\"below\" type=\"float\"><input name=\"in1\" type=\"float\" value=\"1\"/><input name=\"in2\" "
    "type=\"float\" nodename=\"root\"/></subtract>\n"
    "    <divide name=\"ior\" type=\"float\"><input name=\"in1\" type=\"float\" nodename=\"above\"/><input "
    "name=\"in2\" type=\"float\" nodename=\"below\"/></divide>\n"
    "    <output name=\"diffuse_out\" type=\"color3\" nodename=\"diffuse\"/>\n"
    "    <output name=\"tint_out\" type=\"color3\" nodename=\"tint\"/>\n"
    "    <output name=\"ior_out\" type=\"float\" nodename=\"ior\"/>\n"
    "    <output name=\"roughness_out\" type=\"float\" nodename=\"roughness\"/>\n"
    "    <output name=\"normal_out\" type=\"vector3\" nodename=\"normal\"/>\n"
    "  </nodegraph>\n"
    "  <standard_surface name=\"surface_shader\" type=\"surfaceshader\">\n"
    "    <input name=\"base\" type=\"float\" value=\"1\"/>\n"
    "    <input name=\"base_color\" type=\"color3\" nodegraph=\"maps\" output=\"diffuse_out\"/>\n"
    "    <input name=\"specular\" type=\"float\" value=\"1\"/>\n"
    "    <input name=\"specular_color\" type=\"color3\" nodegraph=\"maps\" output=\"tint_out\"/>\n"
    "    <input name=\"specular_IOR\" type=\"float\" nodegraph=\"maps\" output=\"ior_out\"/>\n"
    "    <input name=\"specular_roughness\" type=\"float\" nodegraph=\"maps\" output=\"roughness_out\"/>\n"
    "    <input name=\"normal\" type=\"vector3\" nodegraph=\"maps\" output=\"normal_out\"/>\n"
    "  </standard_surface>\n"
    "  <open_pbr_surface name=\"openpbr_shader\" type=\"surfaceshader\">\n"
    "    <input name=\"base_color\" type=\"color3\" nodegraph=\"maps\" output=\"diffuse_out\"/>\n"
    "    <input name=\"specular_color\" type=\"color3\" nodegraph=\"maps\" output=\"tint_out\"/>\n"
    "    <input name=\"specular_ior\" type=\"float\" nodegraph=\"maps\" output=\"ior_out\"/>\n"
    "    <input name=\"specular_roughness\" type=\"float\" nodegraph=\"maps\" output=\"roughness_out\"/>\n"
    "    <input name=\"geometry_normal\" type=\"vector3\" nodegraph=\"maps\" output=\"normal_out\"/>\n"
    "  </open_pbr_surface>\n"
    "  <surfacematerial name=\"surface\" type=\"material\"><input name=\"surfaceshader\" type=\"surfaceshader\" "
    "nodename=\"surface_shader\"/></surfacematerial>\n"
    "  <surfacematerial name=\"openpbr\" type=\"material\"><input name=\"surfaceshader\" type=\"surfaceshader\" "
    "nodename=\"openpbr_shader\"/></surfacematerial>\n"
    "</materialx>\n";

static void print_materialx(FILE *f) { fputs(materialx, f); }

static ts_code write_document(const char *path, void (*print)(FILE *f), ts_status *st)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    if (f) print(f);
    ts_code code = TS_OK;
    if (!f || fclose(f) != 0 || !text) code = ts_fail(st, TS_NOMEM, "%s: no memory for its text", path);
    else code = io_write_bytes(path, text, size, st);
    free(text);
    return code;
}

ts_code lgd_write_gltf(const char *path, ts_status *st) { return write_document(path, print_gltf, st); }
ts_code lgd_write_materialx(const char *path, ts_status *st) { return write_document(path, print_materialx, st); }
