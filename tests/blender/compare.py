"""Imports material.glb, renders it with Cycles under the lights of preview.png and compares the two.

Usage: compare.py FOLDER [PHOTO], with what lgd-infer --maps glb,preview,normal wrote of PHOTO; when that is given, the
material is the one that the add-on makes of it. Prints a line for each light and ends
with 1 when a mean ratio is off by more than 2%, the correlation of the high-pass is below .98, or light from above does
not brighten what faces up."""
import math
import os
import sys

import bpy
import mathutils
import numpy as np

LIGHTS, POWER, SAMPLES = 4, 329288 / 65536, 64
FOLDER, PHOTO = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None


def image(path):
    """The file's values, top row first."""
    i = bpy.data.images.load(path)
    w, h = i.size
    v = np.array(i.pixels[:], dtype=np.float64).reshape(h, w, -1)[::-1, :, :3]
    bpy.data.images.remove(i)
    return v


def linear(v):
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def camera_height():
    for line in open(os.path.join(FOLDER, "meta.txt")):
        if line.startswith("camera: "):
            return float(line.split()[3].rstrip(","))
    raise SystemExit("meta.txt names no camera")


def scene(size):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=os.path.join(FOLDER, "material.glb"))
    plane = [o for o in bpy.context.scene.objects if o.type == "MESH"][0]
    if PHOTO:
        import addon_utils

        # as Blender does, which disables it again at exit. As a module, bpy 4.5 waits forever there for a thread of its
        # own where any class is still registered that Blender does not know to be an add-on's
        addon_utils.enable("lgd_material")
        bpy.context.view_layer.objects.active = plane
        bpy.ops.import_image.lgd_material(filepath=PHOTO, size=size)
        if plane.active_material.name.split(".")[0] != os.path.splitext(os.path.basename(PHOTO))[0]:
            raise SystemExit(f"the material is {plane.active_material.name}: WRONG")
    # glTF has y up, Blender z: the importer has turned the square upright
    plane.rotation_mode = "QUATERNION"
    plane.matrix_world = mathutils.Matrix.Rotation(math.radians(-90), 4, "X") @ plane.matrix_world
    for node in plane.active_material.node_tree.nodes:
        if node.type == "TEX_IMAGE":
            node.interpolation = "Closest"  # our renderer has pixels
        if node.type == "BSDF_PRINCIPLED":
            node.distribution = "GGX"  # and light that is reflected once; the importer's default adds 1.6%
    s = bpy.context.scene
    s.render.engine = "CYCLES"
    s.cycles.samples = SAMPLES
    s.cycles.use_denoising = False
    s.cycles.max_bounces = 0
    s.cycles.pixel_filter_type = "BOX"
    s.cycles.filter_width = 1
    s.render.resolution_x = s.render.resolution_y = size
    s.render.resolution_percentage = 100
    s.view_settings.view_transform = "Raw"
    s.world = bpy.data.worlds.new("dark")
    s.world.use_nodes = True
    s.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    d = camera_height()
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0, 0, d)
    camera.data.angle = 2 * math.atan(0.5 / d)
    camera.data.clip_start = 0.01
    s.collection.objects.link(camera)
    s.camera = camera
    return s


def render(s, position):
    data = bpy.data.lights.new("light", "POINT")
    data.energy = 4 * math.pi * POWER  # watts of a point of that intensity
    data.shadow_soft_size = 0
    light = bpy.data.objects.new("light", data)
    light.location = position
    s.collection.objects.link(light)
    path = os.path.join(FOLDER, "cycles.exr")
    s.render.image_settings.file_format = "OPEN_EXR"
    s.render.image_settings.color_depth = "32"
    s.render.filepath = path
    bpy.ops.render.render(write_still=True)
    v = image(path)
    os.remove(path)
    bpy.data.objects.remove(light)
    return v


def high_pass(v, r=8):
    """Minus the mean of a box of 2 r + 1."""
    p = np.pad(v, r, mode="edge").cumsum(0).cumsum(1)
    p = np.pad(p, ((1, 0), (1, 0)))
    n = 2 * r + 1
    return v - (p[n:, n:] - p[:-n, n:] - p[n:, :-n] + p[:-n, :-n]) / n**2


def main():
    preview = linear(image(os.path.join(FOLDER, "preview.png")))
    normal = image(os.path.join(FOLDER, "normal.png"))
    size = preview.shape[0]
    s = scene(size)
    bad = 0
    for k in range(LIGHTS):
        phi = 2 * math.pi * (k + 0.5) / LIGHTS
        ours = preview[:, k * size : (k + 1) * size].mean(2)
        clipped = preview[:, k * size : (k + 1) * size].max(2) > 0.99
        theirs = render(s, (0.75 * math.cos(phi), 0.75 * math.sin(phi), 0.6)).mean(2)
        seen = ~clipped
        ratio = theirs[seen].sum() / ours[seen].sum()
        a, b = high_pass(np.where(seen, theirs, 0))[seen], high_pass(np.where(seen, ours, 0))[seen]
        same = np.corrcoef(a, b)[0, 1]
        up = np.corrcoef(a, normal[:, :, 1][seen])[0, 1] * math.copysign(1, math.sin(phi))
        fine = abs(ratio - 1) <= 0.02 and same >= 0.98 and up > 0
        bad += not fine
        print(f"light {k}: mean ratio {ratio:.4f}, correlation of the high-pass {same:.4f}, "
              f"of brightness with what faces the light {up:.2f}{'' if fine else ': WRONG'}")
    sys.exit(1 if bad else 0)


main()
