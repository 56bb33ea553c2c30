"""Maps that lgd wrote, for scripts beside it."""
import numpy as np
import OpenEXR


def read(path):
    """Of a maps.exr, linear: d diffuse, s specular [h, w, 3], r roughness [h, w, 1], n normals' x and y [h, w, 2]."""
    with OpenEXR.File(str(path)) as file:
        c = {k: v.pixels.astype(np.float64) for k, v in file.channels().items()}
    return {
        "d": c["diffuse"],
        "s": c["specular"],
        "r": c["roughness.Y"][..., None],
        "n": np.stack([c["normal.X"], c["normal.Y"]], -1),
    }
