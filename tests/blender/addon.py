"""The add-on in Blender: addon.py ZIP PHOTO installs the extension and makes materials. Ends with 1 when one is
wrong."""
import os
import sys

import bpy

ZIP, PHOTO = sys.argv[1:3]
SIZE = 64


def expect(condition, what):
    if not condition:
        print(f"addon: {what}: WRONG")
        sys.exit(1)


def image_behind(socket):
    """The first image on the way to a socket."""
    seen = [link.from_node for link in socket.links]
    while seen:
        node = seen.pop(0)
        if node.type == "TEX_IMAGE":
            return node.image
        seen += [link.from_node for i in node.inputs for link in i.links]
    return None


def image_mean(material, socket):
    """Of the values of the image at the shader's socket, alpha left out."""
    nodes = bpy.data.materials[material].node_tree.nodes
    shader = [n for n in nodes if n.type == "BSDF_PRINCIPLED"][0]
    values = [v for i, v in enumerate(image_behind(shader.inputs[socket]).pixels) if i % 4 < 3]
    return sum(values) / len(values)


def fails(text, **options):
    try:
        bpy.ops.import_image.lgd_material(**options)
    except RuntimeError as error:
        expect(text in str(error), f"'{error}' does not say {text}")
        return
    expect(False, f"{options} is taken")


def main():
    bpy.ops.wm.read_factory_settings()  # a cube, a light and a camera
    bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default", enable_on_install=True)
    import lgd

    expect(lgd.__file__.startswith(os.environ["BLENDER_USER_RESOURCES"]), f"lgd is that of {lgd.__file__}")
    cube, objects = bpy.context.active_object, set(bpy.data.objects)
    expect(cube and cube.type == "MESH", "there is no cube")
    result = bpy.ops.import_image.lgd_material(filepath=PHOTO, size=SIZE)
    expect(result == {"FINISHED"}, f"it ends with {result}")
    expect(set(bpy.data.objects) == objects, f"the objects are {list(bpy.data.objects)}")
    expect(bpy.context.active_object == cube and cube.select_get(), "another object is active")
    material = cube.active_material
    expect(material.name == "flash" and material.use_fake_user, f"the material is {material.name}")
    expect("EXIF" in material["lgd_field_of_view"], material["lgd_field_of_view"])
    shader = [n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"][0]
    for socket, space in [("Base Color", "sRGB"), ("Roughness", "Non-Color"), ("Normal", "Non-Color"),
                          ("Specular Tint", "sRGB")]:
        image = image_behind(shader.inputs[socket])
        expect(image, f"{socket} has no image")
        expect(image.packed_file and tuple(image.size) == (SIZE, SIZE), f"{image.name} is {tuple(image.size)}")
        expect(image.colorspace_settings.name == space, f"{socket} is {image.colorspace_settings.name}")
        expect(image.name.startswith("flash "), f"an image is called {image.name}")
    expect(abs(shader.inputs["IOR"].default_value - 1000) < 1, "F0 is not the map's")

    # without an object: the material is there for later
    bpy.context.view_layer.objects.active = None
    result = bpy.ops.import_image.lgd_material(filepath=PHOTO, size=SIZE, fov=28, seamless=True)
    expect(result == {"FINISHED"} and bpy.data.materials["flash.001"].users == 1, "without an object")
    expect(bpy.data.materials["flash.001"]["lgd_field_of_view"].startswith("28.0"), "the field of view is another")

    result = bpy.ops.import_image.lgd_material(filepath=PHOTO, size=SIZE, sample="metal")
    diffuse = [image_mean(name, "Base Color") for name in ("flash.001", "flash.002")]
    expect(result == {"FINISHED"} and diffuse[1] < 0.17 < diffuse[0], f"diffuse is {diffuse}, of a metal last")

    materials = len(bpy.data.materials)
    fails("absent.jpg", filepath=os.path.join(os.path.dirname(PHOTO), "absent.jpg"))
    sys.modules["lgd"] = None  # as if it were not installed
    fails("lgd cannot be loaded", filepath=PHOTO)
    expect(len(bpy.data.materials) == materials, "a failure leaves a material")
    print("addon: fine")


main()
