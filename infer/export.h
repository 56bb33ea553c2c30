/* Documents that say to other tools what the maps of a folder mean, and one file that has them in it. All refer to the
 * maps by their names (OpenGL normals). */
#ifndef LGD_EXPORT_H
#define LGD_EXPORT_H
#include "tensor/status.h"
#include <stdbool.h>

/* glTF 2.0: a unit square with the material, of diffuse.png, roughness.png, normal.png and specular.png. F0 is
 * specularColorTexture of KHR_materials_specular times ((ior - 1) / (ior + 1))^2 of KHR_materials_ior: with ior = 1000
 * that is 0.996. (ior = 0, which stands for infinity there, is chrome in Blender.) metallic: of basecolor.png, orm.png
 * and normal.png, without extensions; ambient occlusion is orm.png's red. repeats: the textures do. */
typedef struct lgd_gltf {
    bool metallic, repeats;
    const char *name; /* of the object and its material */
    bool occlusion;   /* not metallic: occlusion.png too */
} lgd_gltf;
ts_code lgd_write_gltf(const char *path, const lgd_gltf *kind, ts_status *st);
/* material.glb: the same with the images of the folder in it, 2 GB at most. */
ts_code lgd_write_glb(const char *path, const char *folder, const lgd_gltf *kind, ts_status *st);

/* MaterialX 1.39: the materials surface (standard_surface) and openpbr (open_pbr_surface). Both take an index of
 * refraction and a tint where the map has F0: ior = (1 + sqrt L) / (1 - sqrt L) from its luminance L in [1e-4, 0.98],
 * tint = F0 / L, so that at normal incidence the product is F0; toward grazing angles the tint stays, where Schlick's F
 * goes to white. */
ts_code lgd_write_materialx(const char *path, ts_status *st);
#endif
