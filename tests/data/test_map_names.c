/* Which file of a map folder is which map, as libraries name them. */
#include "tests/support/map_folders.h"

/* The last word that says something is the map's; what stands before it is the asset's name. */
TEST(map_folder_names_of_other_maps)
{
    static const char *const others[] = {"MetalPlate_AO.png",
                                         "rusty_metal_02_disp_1k.png",
                                         "rusty_metal_02_arm_1k.png",
                                         "Poliigon_MetalRust_7642_AmbientOcclusion.png",
                                         "Poliigon_MetalRust_7642.png",
                                         "Poliigon_MetalRust_7642_Displacement.png",
                                         "metal_bump_4k.png",
                                         "Poliigon_MetalRust_7642_Preview1.png",
                                         "Rough_Metal_Opacity.png",
                                         "Rough_Metal_DISP16_3K.png",
                                         "rough_wood_mask.png",
                                         "MetalPlate_specularLevel.png",
                                         "MetalPlate_Specular_Level.png"};
    const char *folder = usual("dielectric");
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) flat(folder, others[i], 4, 4, 255, 255, 255);
    const io_texel t = first(folder, IO_NORMAL_GL, 0);
    CHECK(near(t.specular[0], 0.04f, 1e-6f) && near(t.roughness, 0.2f, 1e-6f), "F0 %g, roughness %g",
          (double)t.specular[0], (double)t.roughness);
    const char *haven = fresh("metal_plate_02");
    static const char *const files[] = {"disp", "ao", "arm", "rough", "nor_gl", "diff", "metal"};
    for (int i = 0; i < 7; i++) {
        char name[64];
        snprintf(name, sizeof name, "metal_plate_02_%s_1k.png", files[i]);
        flat(haven, name, 4, 4, i == 3 ? 51 : 128, i == 3 ? 51 : i == 4 ? 204 : 128, i == 3 ? 51 : i == 4 ? 230 : 128);
    }
    CHECK(near(first(haven, IO_NORMAL_FROM_FILE, 0).roughness, 0.2f, 1e-6f), "another map than rough");
    /* What a map holds in its fourth channel is part of its name. */
    const char *cut_out = fresh("cut_out");
    flat(cut_out, "Leaf_BaseColorAlpha.png", 4, 4, 128, 128, 128), flat(cut_out, "Leaf_Opacity.png", 4, 4, 0, 0, 0);
    flat(cut_out, "Leaf_NormalGL.png", 4, 4, 128, 204, 230), flat(cut_out, "Leaf_Roughness.png", 4, 4, 51, 51, 51);
    flat(cut_out, "Leaf_Metallic_Mask.png", 4, 4, 255, 255, 255);
    CHECK(near(first(cut_out, IO_NORMAL_FROM_FILE, 0).specular[0], io_srgb_to_linear(128 / 255.f), 1e-6f),
          "a mask of what is metal");
}

/* Three maps in one picture are not averaged; one whose name is of several is read. */
TEST(map_folder_packed)
{
    static const char *const names[] = {"metallicRoughness.png", "Wood_OcclusionRoughnessMetallic.png",
                                        "a_rough_metal.png", "a_specularGlossiness.png"};
    for (int i = 0; i < 4; i++) {
        char name[16];
        snprintf(name, sizeof name, "packed%d", i);
        const char *folder = fresh(name);
        flat(folder, "basecolor.png", 4, 4, 128, 128, 128), flat(folder, "normal.png", 4, 4, 128, 204, 230);
        if (i == 1 || i == 2) flat(folder, "roughness.png", 4, 4, 51, 51, 51);
        flat(folder, names[i], 4, 4, 255, 51, 0);
        refused(folder, IO_NORMAL_GL, "a packed map must be taken apart");
        refused(folder, IO_NORMAL_GL, names[i]);
        if (i) continue;
        words(folder, "meta.txt", "file.roughness: metallicRoughness.png");
        CHECK(near(first(folder, IO_NORMAL_GL, 0).roughness, 0.4f, 1e-6f), "as meta.txt says");
    }
    const char *paint = fresh("paint");
    flat(paint, "CarPaintMetallic_Color.png", 4, 4, 128, 128, 128);
    flat(paint, "CarPaintMetallic_NormalGL.png", 4, 4, 128, 204, 230);
    flat(paint, "CarPaintMetallic_Roughness.png", 4, 4, 51, 53, 50);
    const io_texel t = first(paint, IO_NORMAL_FROM_FILE, 0);
    CHECK(near(t.roughness, 154 / 765.f, 1e-6f) && near(t.specular[0], 0.04f, 1e-6f), "the asset's name is metallic");
}

/* Poliigon ends all names in the workflow. */
TEST(map_folder_workflow_in_all_names)
{
    const char *metal = fresh("metal");
    flat(metal, "Metal01_COL_2K_METALNESS.png", 4, 4, 128, 128, 128);
    flat(metal, "Metal01_NRM_2K_METALNESS.png", 4, 4, 128, 204, 230);
    flat(metal, "Metal01_ROUGHNESS_2K_METALNESS.png", 4, 4, 51, 51, 51);
    flat(metal, "Metal01_DISP_2K_METALNESS.png", 4, 4, 9, 9, 9);
    const io_texel dielectric = first(metal, IO_NORMAL_GL, 0);
    CHECK(near(dielectric.specular[0], 0.04f, 1e-6f) && near(dielectric.roughness, 0.2f, 1e-6f), "no metalness map");
    flat(metal, "Metal01_METALNESS_2K_METALNESS.png", 4, 4, 255, 255, 255);
    const io_texel t = first(metal, IO_NORMAL_GL, 0);
    CHECK(near(t.specular[0], io_srgb_to_linear(128 / 255.f), 1e-6f) && near(t.normal[1], 0.6f, 0.01f) &&
              near(t.roughness, 0.2f, 1e-6f),
          "metalness");
    flat(metal, "Metal01_REFL_2K_SPECULAR.png", 4, 4, 9, 9, 9);
    refused(metal, IO_NORMAL_GL, "both ");
    const char *older = fresh("older");
    flat(older, "Wood01_COL_2K_SPECULAR.png", 4, 4, 128, 128, 128);
    flat(older, "Wood01_NRM_2K_SPECULAR.png", 4, 4, 128, 204, 230);
    flat(older, "Wood01_GLOSS_2K_SPECULAR.png", 4, 4, 51, 51, 51);
    flat(older, "Wood01_REFL_2K_SPECULAR.png", 4, 4, 128, 128, 128);
    const io_texel gloss = first(older, IO_NORMAL_GL, 0);
    CHECK(near(gloss.specular[0], io_srgb_to_linear(128 / 255.f), 1e-6f) && near(gloss.roughness, 0.8f, 1e-6f),
          "reflection and gloss");
    flat(older, "Wood01_OVERLAY_2K_SPECULAR.png", 4, 4, 255, 0, 0);
    CHECK(near(first(older, IO_NORMAL_GL, 0).roughness, 0.8f, 1e-6f), "an overlay is no map");
}

/* A reflection map is F0 only beside a gloss map, and where no other map says F0. */
TEST(map_folder_reflection)
{
    const char *folder = usual("dielectric");
    flat(folder, "wood_reflection.png", 4, 4, 128, 128, 128);
    CHECK(near(first(folder, IO_NORMAL_GL, 0).specular[0], 0.04f, 1e-6f), "beside roughness");
    const char *metal = fresh("metal");
    flat(metal, "m_col.png", 4, 4, 128, 128, 128), flat(metal, "m_nrm.png", 4, 4, 128, 204, 230);
    flat(metal, "m_gloss.png", 4, 4, 51, 51, 51), flat(metal, "m_metalness.png", 4, 4, 255, 255, 255);
    flat(metal, "m_refl.png", 4, 4, 9, 9, 9);
    CHECK(near(first(metal, IO_NORMAL_GL, 0).specular[0], io_srgb_to_linear(128 / 255.f), 1e-6f), "beside metalness");
}

/* Alpha of a colour map is another map or a cut-out, whether it is sRGB or linear; names are whole. */
TEST(map_folder_alpha)
{
    const char *folder = usual("wood_3.5cm");
    bytes f = {0};
    uint8_t pixels[4 * 4 * 4];
    for (int i = 0; i < 16; i++) memcpy(pixels + 4 * i, i % 2 ? "\x80\x80\x80\x40" : "\x80\x80\x80\x00", 4);
    png_begin(&f, 4, 4, 8, 6), png_pixels(&f, pixels, 16, 4), png_end(&f);
    bytes_save(&f, folder, "basecolor.png");
    CHECK(near(first(folder, IO_NORMAL_GL, 0).diffuse[0], io_srgb_to_linear(128 / 255.f), 1e-6f), "sRGB times alpha");
    words(folder, "meta.txt", "basecolor: linear\n");
    CHECK(near(first(folder, IO_NORMAL_GL, 0).diffuse[0], 128 / 255.f, 1e-6f), "linear times alpha");
    ts_status st = {0};
    io_material m;
    CHECK(!io_read_map_folder(folder, &(io_map_convention){.normal = IO_NORMAL_GL}, 0, &m, &st) &&
              !strcmp(m.name, "wood_3.5cm"),
          "named %s: %s", m.name, st.message);
    io_material_free(&m);
}
