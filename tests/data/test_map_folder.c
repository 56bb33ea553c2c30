/* Map folders as people have them: names, conventions, sizes. */
#include "data/map_folder.h"
#include "tests/support/map_folders.h"
#include <unistd.h>

TEST(map_folder_conventions)
{
    const char *folder = usual("set");
    refused(folder, IO_NORMAL_FROM_FILE, "normal: OpenGL y");
    CHECK(near(first(folder, IO_NORMAL_GL, 0).normal[1], 0.6f, 0.01f), "OpenGL by the option");
    CHECK(near(first(folder, IO_NORMAL_DX, 0).normal[1], -0.6f, 0.01f), "DirectX by the option");
    static const struct {
        const char *meta;
        float y;
    } cases[] = {{"normal: tangent space, OpenGL y (measured)\n", 0.6f},
                 {"basecolor: sRGB\r\nnormal: DirectX y\r\n", -0.6f},
                 {"NORMAL = dx", -0.6f},
                 {"\xef\xbb\xbfnormal: gl", 0.6f},
                 {"# normal: DirectX\n\n  normal:opengl # not DirectX", 0.6f}};
    for (int i = 0; i < 5; i++) {
        words(folder, "meta.txt", cases[i].meta);
        CHECK(near(first(folder, IO_NORMAL_FROM_FILE, 0).normal[1], cases[i].y, 0.01f), "wrong y for: %s",
              cases[i].meta);
        CHECK(near(first(folder, IO_NORMAL_DX, 0).normal[1], -0.6f, 0.01f), "the option does not win over: %s",
              cases[i].meta);
    }
    words(folder, "meta.txt", "normal: OpenGL or DirectX\n");
    refused(folder, IO_NORMAL_FROM_FILE, "both conventions");
    words(folder, "meta.txt", "normals: OpenGL\nsource: normal = DirectX\n");
    refused(folder, IO_NORMAL_FROM_FILE, "nothing says");
}

TEST(map_folder_values)
{
    const char *folder = usual("set");
    io_texel t = first(folder, IO_NORMAL_GL, 0);
    CHECK(near(t.diffuse[0], io_srgb_to_linear(128 / 255.f), 1e-6f) && near(t.roughness, 0.2f, 1e-6f),
          "dielectric: %g %g", (double)t.diffuse[0], (double)t.roughness);
    CHECK(near(t.specular[0], 0.04f, 1e-6f), "F0 of a dielectric is %g", (double)t.specular[0]);
    flat(folder, "metallic.png", 4, 4, 51, 51, 51); /* 0.2 */
    t = first(folder, IO_NORMAL_GL, 0);
    float base = io_srgb_to_linear(128 / 255.f);
    CHECK(near(t.diffuse[1], 0.8f * base, 1e-6f) && near(t.specular[1], 0.032f + 0.2f * base, 1e-6f),
          "metallic 0.2: %g %g", (double)t.diffuse[1], (double)t.specular[1]);
    words(folder, "meta.txt", "basecolor: linear value\n");
    t = first(folder, IO_NORMAL_GL, 0);
    CHECK(near(t.diffuse[1], 0.8f * 128 / 255, 1e-6f), "linear base colour: %g", (double)t.diffuse[1]);
    const char *other = fresh("specular");
    flat(other, "x_diffuse.png", 4, 4, 128, 128, 128), flat(other, "x_specular.png", 4, 4, 128, 0, 255);
    flat(other, "x_normal.png", 4, 4, 128, 128, 255), flat(other, "x_glossiness.png", 4, 4, 51, 51, 51);
    t = first(other, IO_NORMAL_GL, 0);
    CHECK(near(t.diffuse[0], base, 1e-6f) && near(t.specular[0], base, 1e-6f) && t.specular[1] == 0 &&
              near(t.specular[2], 1, 1e-6f),
          "specular workflow");
    CHECK(near(t.roughness, 0.8f, 1e-6f), "roughness from gloss is %g", (double)t.roughness);
}

TEST(map_folder_names)
{
    static const char *const names[][3] = {
        {"Rock020_1K_Color.png", "Rock020_1K_NormalGL.png", "Rock020_1K_Roughness.png"},
        {"wall-albedo.png", "wall-normal-ogl.png", "wall-rough.png"},
        {"MetalPlateBaseColor.png", "MetalPlateNormal_OpenGL.png", "Metal Plate Roughness.png"},
        {"brick_diff_1k.png", "brick_nor_gl_1k.png", "brick_rough_1k.png"}};
    for (int i = 0; i < 4; i++) {
        char name[16];
        snprintf(name, sizeof name, "%d", i);
        const char *folder = fresh(name);
        flat(folder, names[i][0], 4, 4, 128, 128, 128), flat(folder, names[i][1], 4, 4, 128, 204, 230),
            flat(folder, names[i][2], 4, 4, 51, 51, 51);
        words(folder, "notes_color.txt", "not an image"), words(folder, ".hidden_normal.png", "not an image"),
            flat(folder, "preview.png", 4, 4, 0, 0, 0);
        io_texel t = first(folder, IO_NORMAL_FROM_FILE, 0);
        CHECK(near(t.diffuse[0], io_srgb_to_linear(128 / 255.f), 1e-6f) && near(t.normal[1], 0.6f, 0.01f) &&
                  near(t.roughness, 0.2f, 1e-6f),
              "set %d", i);
    }
    /* Both conventions side by side, as some libraries ship them: either is right, and the option chooses. */
    const char *folder = fresh("both");
    flat(folder, "a_Color.png", 4, 4, 9, 9, 9), flat(folder, "a_Roughness.png", 4, 4, 9, 9, 9);
    flat(folder, "a_NormalGL.png", 4, 4, 128, 204, 230), flat(folder, "a_NormalDX.png", 4, 4, 128, 51, 230);
    CHECK(near(first(folder, IO_NORMAL_FROM_FILE, 0).normal[1], 0.6f, 0.01f), "both, none asked for");
    CHECK(near(first(folder, IO_NORMAL_DX, 0).normal[1], 0.6f, 0.01f), "both, DirectX asked for");
    words(
        folder, "meta.txt",
        "file.basecolor: a_Roughness.png\nfile.normal: a_NormalDX.png\nfile.roughness: a_Color.png\nnormal: DirectX\n");
    CHECK(near(first(folder, IO_NORMAL_FROM_FILE, 0).normal[1], 0.6f, 0.01f), "named in meta.txt");
}

/* meta.txt names what several files could be; the others are found by their names. */
TEST(map_folder_named_in_part)
{
    const char *folder = fresh("part");
    flat(folder, "a_albedo.png", 4, 4, 1, 2, 3), flat(folder, "a_color.png", 4, 4, 128, 128, 128);
    flat(folder, "a_normal_gl.png", 4, 4, 128, 204, 230), flat(folder, "a_roughness.png", 4, 4, 51, 51, 51);
    refused(folder, IO_NORMAL_FROM_FILE, "name it in meta.txt (file.basecolor: ...)");
    words(folder, "meta.txt", "file.basecolor: a_color.png\n");
    const io_texel t = first(folder, IO_NORMAL_FROM_FILE, 0);
    CHECK(near(t.diffuse[0], io_srgb_to_linear(128 / 255.f), 1e-6f), "another colour map than the named one");
    CHECK(near(t.normal[1], 0.6f, 0.01f) && near(t.roughness, 0.2f, 1e-6f), "normals and roughness are not found");
    flat(folder, "a_diffuse.png", 4, 4, 1, 2, 3), flat(folder, "a_gloss.png", 4, 4, 1, 2, 3);
    refused(folder, IO_NORMAL_FROM_FILE, "both a_roughness.png and a_gloss.png");
    words(folder, "meta.txt", "file.basecolor: a_color.png\nfile.roughness: a_roughness.png\n");
    CHECK(near(first(folder, IO_NORMAL_FROM_FILE, 0).roughness, 0.2f, 1e-6f), "gloss in place of the named roughness");
    words(folder, "meta.txt", "file.basecolor: a_color.png\nfile.roughness: a_gloss.png\n");
    CHECK(near(first(folder, IO_NORMAL_FROM_FILE, 0).roughness, 1 / 255.f, 1e-2f), "a file is what meta.txt says");
}

TEST(map_folder_refused)
{
    char path[600];
    const char *folder = usual("two");
    flat(folder, "Albedo.png", 4, 4, 1, 2, 3);
    refused(folder, IO_NORMAL_GL, "both Albedo.png and basecolor.png");
    const char *mixed = usual("mixed");
    flat(mixed, "metallic.png", 4, 4, 0, 0, 0), flat(mixed, "specular.png", 4, 4, 255, 255, 255);
    refused(mixed, IO_NORMAL_GL, "workflow: ");
    words(mixed, "meta.txt", "workflow: metallic (the specular map is the engine's)\n");
    CHECK(near(first(mixed, IO_NORMAL_GL, 0).specular[0], 0.04f, 1e-6f), "metallic as meta.txt says");
    words(mixed, "meta.txt", "workflow: specular\n");
    CHECK(near(first(mixed, IO_NORMAL_GL, 0).specular[0], 1, 1e-6f), "specular as meta.txt says");
    static const char *const maps[] = {"basecolor", "normal", "roughness"},
                             *const says[] = {"no colour map", "no normal map", "no roughness map"};
    for (int i = 0; i < 3; i++) {
        const char *less = usual(maps[i]);
        snprintf(path, sizeof path, "%s/%s.png", less, maps[i]);
        unlink(path);
        refused(less, IO_NORMAL_GL, says[i]);
    }
    refused(fresh("empty"), IO_NORMAL_GL, "no colour map");
    snprintf(path, sizeof path, "%s/missing", test_folder());
    refused(path, IO_NORMAL_GL, "No such file");
    snprintf(path, sizeof path, "%s/two/normal.png", test_folder());
    refused(path, IO_NORMAL_GL, "not a folder");
    const char *broken = usual("broken");
    words(broken, "roughness.png", "not an image");
    refused(broken, IO_NORMAL_GL, "roughness.png");
}

TEST(map_folder_sizes)
{
    /* The largest short side is the size; a wider map gives its centre; a smaller one is enlarged. */
    const char *folder = fresh("sizes");
    bytes f = {0};
    uint8_t wide[3 * 9 * 3];
    for (int i = 0; i < 27; i++) memset(wide + 3 * i, i % 9 < 3 ? 0 : i % 9 < 6 ? 128 : 255, 3);
    png_begin(&f, 9, 3, 8, 2), png_pixels(&f, wide, 27, 3), png_end(&f);
    bytes_save(&f, folder, "color.png");
    flat(folder, "roughness.png", 1, 1, 51, 51, 51), flat(folder, "normal.png", 6, 2, 128, 204, 230);
    ts_status st = {0};
    io_material m;
    for (int size = 0; size <= 12; size += 4) {
        CHECK(io_read_map_folder(folder, &(io_map_convention){.normal = IO_NORMAL_GL}, size, &m, &st) == TS_OK, "%s",
              st.message);
        CHECK(m.size == (size ? size : 3), "size %d became %d", size, m.size);
        CHECK(!strcmp(m.name, "sizes"), "named %s", m.name);
        for (int i = 0; i < m.size * m.size; i++) {
            io_texel t = io_texel_get(m.maps + i * MAP_CHANNELS);
            CHECK(near(t.diffuse[0], io_srgb_to_linear(128 / 255.f), 1e-5f), "colour %g: not the centre",
                  (double)t.diffuse[0]);
            CHECK(near(t.roughness, 0.2f, 1e-5f) && near(t.normal[1], 0.6f, 0.01f), "roughness %g, y %g",
                  (double)t.roughness, (double)t.normal[1]);
        }
        io_material_free(&m);
    }
    /* Normals are averaged as vectors: slopes to the left and right give a flat one, of unit length. */
    const char *slopes = usual("slopes");
    uint8_t pixels[4 * 4 * 3];
    for (int i = 0; i < 16; i++) memcpy(pixels + 3 * i, i % 2 ? "\xcc\x80\xe6" : "\x33\x80\xe6", 3);
    png_begin(&f, 4, 4, 8, 2), png_pixels(&f, pixels, 12, 4), png_end(&f);
    bytes_save(&f, slopes, "normal.png");
    io_texel t = first(slopes, IO_NORMAL_GL, 1);
    CHECK(near(t.normal[0], 0, 0.01f) && near(t.normal[2], 1, 1e-3f), "mean normal %g %g %g", (double)t.normal[0],
          (double)t.normal[1], (double)t.normal[2]);
}

/* A value that is no number does not spread to its neighbours. */
TEST(map_folder_no_numbers)
{
    const char *folder = fresh("odd");
    float values[4 * 4 * 3];
    static const float odd[3] = {NAN, -INFINITY, NAN};
    for (int i = 0; i < 48; i++) values[i] = i < 3 ? odd[i] : 0.25f;
    bytes b = exr_file(4, 4, values, NULL);
    bytes_save(&b, folder, "roughness.exr");
    b = exr_file(4, 4, values, NULL);
    bytes_save(&b, folder, "basecolor.exr");
    words(folder, "meta.txt", "basecolor: linear\n");
    for (int i = 3; i < 48; i++) values[i] = i % 3 == 2 ? 1 : 0.5f;
    b = exr_file(4, 4, values, NULL);
    bytes_save(&b, folder, "normal.exr");
    const io_texel t = first(folder, IO_NORMAL_GL, 1);
    CHECK(near(t.diffuse[0], 0.24f, 0.01f) && near(t.roughness, 0.24f, 0.01f), "%g, roughness %g", (double)t.diffuse[0],
          (double)t.roughness);
    CHECK(t.normal[2] > 0.999f, "a normal of no numbers is flat, not %g", (double)t.normal[2]);
}

/* Maps of one shape at other sizes, with sides rounded either way; of several shapes no pixel lies on its own. */
TEST(map_folder_shapes)
{
    static const struct {
        int width, height;
        bool alike;
    } normal[] = {{30, 20, true},  {15, 10, true},  {8, 5, true},    {7, 5, true},  {1, 1, true},
                  {30, 19, false}, {20, 30, false}, {20, 20, false}, {8, 8, false}, {9, 5, false}};
    char name[16];
    for (int i = 0; i < (int)(sizeof normal / sizeof *normal); i++) {
        snprintf(name, sizeof name, "shape%d", i);
        const char *folder = fresh(name);
        flat(folder, "basecolor.png", 30, 20, 128, 128, 128);
        flat(folder, "roughness.png", 30, 20, 51, 51, 51);
        flat(folder, "normal_gl.png", normal[i].width, normal[i].height, 128, 204, 230);
        if (normal[i].alike) CHECK(near(first(folder, IO_NORMAL_FROM_FILE, 0).normal[1], 0.6f, 0.01f), "%s", name);
        else refused(folder, IO_NORMAL_FROM_FILE, "not the same shape");
    }
    char path[600];
    snprintf(path, sizeof path, "%s/shape7", test_folder());
    refused(path, IO_NORMAL_FROM_FILE, "basecolor.png is 30 x 20 and normal_gl.png 20 x 20: not the same shape");
}

/* --- the sets of TESTDATA --- */

static const char *const sets[] = {
    "acg_Bark014",      "acg_Facade005",    "acg_Metal007",     "acg_Metal009",
    "acg_Metal053C",    "acg_Onyx003",      "acg_Rock020",      "acg_Rock053",
    "acg_Tiles036",     "acg_WoodFloor043", "pc_seaside_rocks", "tps_painted_gun_metal",
    "tps_rivet_panels", "tps_tech_panels",  "tps_trim_lights",  "tps_trim_misc",
};

/* By their meta.txt. */
static const char *const directx_sets = "acg_Metal007 acg_Metal009 acg_Rock020 acg_Tiles036 acg_WoodFloor043 "
                                        "pc_seaside_rocks tps_painted_gun_metal tps_tech_panels";

TEST(artists_conventions)
{
    const char *data = test_data();
    for (int k = 0; k < 16; k++) {
        char path[600];
        ts_status st = {0};
        io_map_set set;
        snprintf(path, sizeof path, "%s/maps/%s", data, sets[k]);
        CHECK(io_describe_map_folder(path, NULL, &set, &st) == TS_OK, "%s", st.message);
        CHECK(set.directx == (strstr(directx_sets, sets[k]) != NULL), "%s: read as %s", sets[k],
              set.directx ? "DirectX" : "OpenGL");
        CHECK(!set.specular && !set.linear[IO_BASECOLOR] && set.file[IO_BASECOLOR][0] && set.file[IO_ROUGHNESS_MAP][0],
              "%s", sets[k]);
        CHECK(io_describe_map_folder(path, &(io_map_convention){.normal = IO_NORMAL_DX}, &set, &st) == TS_OK &&
                  set.directx,
              "%s: the option does not win", sets[k]);
    }
}

TEST(artists_map_sets)
{
    const char *data = test_data();
    for (int k = 0; k < 16; k++) {
        char path[600];
        ts_status st = {0};
        io_material m;
        snprintf(path, sizeof path, "%s/maps/%s", data, sets[k]);
        CHECK(io_read_map_folder(path, NULL, 64, &m, &st) == TS_OK, "%s", st.message);
        CHECK(m.size == 64 && !strcmp(m.name, sets[k]), "%s: %d", m.name, m.size);
        double y = 0, albedo = 0, z = 0, f0 = 1;
        for (int i = 0; i < 64 * 64; i++) {
            io_texel t = io_texel_get(m.maps + i * MAP_CHANNELS);
            z += (double)t.normal[2] / (64 * 64), y += (double)t.normal[1] / (64 * 64);
            for (int c = 0; c < 3; c++) {
                albedo += (double)(t.diffuse[c] + t.specular[c]) / (3 * 64 * 64);
                f0 = fmin(f0, (double)t.specular[c]);
            }
        }
        CHECK(z > 0.8 && fabs(y) < 0.05, "%s: mean normal y %g, z %g", sets[k], y, z);
        CHECK(albedo > 0.04 && albedo < 0.9, "%s: mean colour %g", sets[k], albedo);
        CHECK(f0 > 0 && f0 < 0.5, "%s: F0 from %g", sets[k], f0);
        io_material_free(&m);
    }
}
