/* Documents that say to other tools what the maps of a folder mean. All refer to diffuse.png, specular.png,
 * roughness.png and normal.png (OpenGL) beside them by name. */
#ifndef LGD_EXPORT_H
#define LGD_EXPORT_H
#include "tensor/status.h"

/* glTF 2.0: a unit square with the material. KHR_materials_ior with ior = 0 makes F0 at full strength 1, so that
 * specularColorTexture of KHR_materials_specular is F0 itself, and is meant for just this (that extension, "Interaction
 * with other extensions"). */
ts_code lgd_write_gltf(const char *path, ts_status *st);

/* MaterialX 1.39: the materials surface (standard_surface) and openpbr (open_pbr_surface). Both take an index of
 * refraction and a tint where the map has F0: ior = (1 + sqrt L) / (1 - sqrt L) from its luminance L in [1e-4, 0.98],
 * tint = F0 / L, so that at normal incidence the product is F0; toward grazing angles the tint stays, where Schlick's F
 * goes to white. */
ts_code lgd_write_materialx(const char *path, ts_status *st);
#endif
