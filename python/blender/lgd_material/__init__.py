"""Blender: choose a photograph, get a material. It needs the Python package lgd, which the extension brings along."""

import os
import tempfile

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

bl_info = {  # for Blender before 4.2, which knows no blender_manifest.toml
    "name": "Material from a Photograph",
    "author": "the lgd authors",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > Material from a Photograph, and the menu beside a material's slots",
    "description": "The material of a flat surface from one flash photograph",
    "category": "Import-Export",
}


def take_material(path, name):
    """The material of a glTF file that has one on a square, with its images packed; nothing else of the file stays."""
    kinds = (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.images, bpy.data.collections)
    before = [set(kind) for kind in kinds]
    active, selected = bpy.context.view_layer.objects.active, list(bpy.context.selected_objects)
    mode = active.mode if active else "OBJECT"
    try:
        bpy.ops.import_scene.gltf(filepath=path)
    except Exception:
        for kind, old in zip(kinds, before):
            for block in set(kind) - old:
                kind.remove(block)
        raise
    objects, meshes, materials, images, collections = (list(set(k) - b) for k, b in zip(kinds, before))
    for block, kind in [(o, bpy.data.objects) for o in objects] + [(m, bpy.data.meshes) for m in meshes]:
        kind.remove(block)
    for collection in collections:
        bpy.data.collections.remove(collection)
    for o in selected:
        o.select_set(True)
    bpy.context.view_layer.objects.active = active
    if active and active.mode != mode:  # the importer leaves it
        bpy.ops.object.mode_set(mode=mode)
    material = materials[0]
    material.name = name
    material.use_fake_user = True  # it stays in the file though nothing may use it yet
    for image in images:
        image.name = f"{name} {image.name}"
        if not image.packed_file:
            image.pack()
    return material


class IMPORT_IMAGE_OT_lgd_material(bpy.types.Operator, ImportHelper):
    """Estimate the material of a flat surface from a photograph taken straight on with a flash beside the lens"""

    bl_idname = "import_image.lgd_material"
    bl_label = "Material from a Photograph"
    bl_options = {"REGISTER", "UNDO"}

    filter_image: BoolProperty(default=True, options={"HIDDEN"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN"})
    filter_glob: StringProperty(default="", options={"HIDDEN"})
    size: IntProperty(name="Size", description="Side of the maps in pixels", default=512, min=16, max=4096)
    fov: FloatProperty(
        name="Field of view",
        description="Degrees across the photograph's largest centred square; 0: as its EXIF says",
        default=0,
        min=0,
        max=170,
    )
    sample: EnumProperty(
        name="Sample",
        description="What all of the sample is: one photograph often leaves it open",
        items=[
            ("auto", "Unknown", "The model decides"),
            ("dielectric", "No metal", "Wood, stone, cloth, leather, plastic, paint"),
            ("metal", "Metal", "Bare metal"),
        ],
        default="auto",
    )
    seamless: BoolProperty(name="Seamless", description="Make the maps repeat without a visible border", default=False)

    def execute(self, context):
        try:
            import lgd
        except ImportError as error:
            self.report({"ERROR"}, f"the Python package lgd cannot be loaded: {error}")
            return {"CANCELLED"}
        if not hasattr(bpy.types, "IMPORT_SCENE_OT_gltf"):
            self.report({"ERROR"}, "the add-on glTF 2.0 is not enabled, which brings the material in")
            return {"CANCELLED"}
        name = os.path.splitext(os.path.basename(self.filepath))[0]
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            maps = lgd.estimate(
                self.filepath,
                size=self.size,
                fov=self.fov or None,
                sample=self.sample,
                progress=lambda done, rmse: manager.progress_update(int(100 * done)),
            )
            with tempfile.TemporaryDirectory() as folder:
                files = os.path.join(folder, "material")
                maps.save(files, ["glb"], seamless=self.seamless)
                material = take_material(os.path.join(files, "material.glb"), name)
        except (lgd.Error, OSError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        material["lgd_field_of_view"] = f"{maps.photo.fov:.1f} degrees ({maps.fov_from})"
        o = context.active_object
        if o and o.type in {"MESH", "CURVE", "SURFACE", "META", "FONT"}:
            if o.material_slots:
                o.active_material = material
            else:
                o.data.materials.append(material)
        self.report({"INFO"}, f"{material.name}: field of view {maps.photo.fov:.1f} degrees ({maps.fov_from})")
        return {"FINISHED"}


def draw(self, context):
    self.layout.operator(IMPORT_IMAGE_OT_lgd_material.bl_idname, icon="MATERIAL")


MENUS = ("TOPBAR_MT_file_import", "MATERIAL_MT_context_menu")


def register():
    bpy.utils.register_class(IMPORT_IMAGE_OT_lgd_material)
    for menu in MENUS:
        getattr(bpy.types, menu).append(draw)


def unregister():
    for menu in MENUS:
        getattr(bpy.types, menu).remove(draw)
    bpy.utils.unregister_class(IMPORT_IMAGE_OT_lgd_material)
