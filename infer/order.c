#include "infer/order.h"
#include <string.h>

const char *const lgd_output_names[LGD_OUTPUTS] = {"diffuse", "specular",  "roughness", "normal", "exr",  "render",
                                                   "preview", "basecolor", "metallic",  "height", "gltf", "materialx",
                                                   "glb",     "orm",       "ao",        "page"};
const char *const lgd_files[LGD_FILES] = {
    "diffuse.png",  "specular.png",  "roughness.png", "normal.png", "maps.exr",      "render.png",
    "preview.png",  "basecolor.png", "metallic.png",  "height.png", "material.gltf", "material.mtlx",
    "material.glb", "orm.png",       "occlusion.png", "view.html",  "meta.txt"};

ts_code lgd_output_parse(const char *list, unsigned *which, ts_status *st)
{
    *which = 0;
    for (const char *at = list;; at++) {
        const size_t n = strcspn(at, ",");
        int k = 0;
        while (k < LGD_OUTPUTS && (strlen(lgd_output_names[k]) != n || strncmp(at, lgd_output_names[k], n) != 0)) k++;
        if (k == LGD_OUTPUTS)
            return ts_fail(st, TS_INVALID, "'%.*s' is nothing that can be written", (int)(n < 40 ? n : 40), at);
        *which |= 1u << k;
        at += n;
        if (!*at) break;
    }
    return TS_OK;
}

unsigned lgd_output_referred(bool metallic)
{
    return metallic ? LGD_OUT_BASECOLOR | LGD_OUT_ORM | LGD_OUT_NORMAL
                    : LGD_OUT_DIFFUSE | LGD_OUT_SPECULAR | LGD_OUT_ROUGHNESS | LGD_OUT_NORMAL;
}

unsigned lgd_output_complete(unsigned which, bool metallic)
{
    const unsigned f0 = which & (LGD_OUT_DIFFUSE | LGD_OUT_SPECULAR);
    if (metallic) /* what was asked of the one workflow is given in the other */
        which = (which & ~f0) | (f0 & LGD_OUT_DIFFUSE ? LGD_OUT_BASECOLOR : 0) |
            (f0 & LGD_OUT_SPECULAR ? LGD_OUT_METALLIC : 0);
    return which & (LGD_OUT_GLTF | LGD_OUT_MATERIALX) ? which | lgd_output_referred(metallic) : which;
}

ts_code lgd_order_check(const lgd_order *order, ts_status *st)
{
    if (order->which & (LGD_OUT_GLTF | LGD_OUT_GLB | LGD_OUT_MATERIALX) && order->directx)
        return ts_fail(st, TS_INVALID, "glTF and MaterialX need OpenGL normals, not DirectX's");
    if (order->which & LGD_OUT_MATERIALX && order->metallic)
        return ts_fail(st, TS_INVALID, "the MaterialX document refers to F0: not of the metallic workflow");
    return TS_OK;
}
