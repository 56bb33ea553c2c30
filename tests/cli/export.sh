# What lgd-infer writes for other people's tools, opened by a reader that is not ours.
. tests/cli/lib.sh
MODEL=${LGD_TEST_MODEL:-$ROOT/models/single.safetensors}
export LGD_MODEL="$MODEL"
PHOTO=$ROOT/demo/flash.jpg

infer() { "$BIN/lgd-infer" --size 32 --iterations 1 --threads 1 "$PHOTO" -o "$T/o" "$@"; }
holds() { [ "$(ls -A "$T/o/flash" | tr '\n' ' ')" = "$1 " ] || fail "files: $(ls -A "$T/o/flash" | tr '\n' ' ')"; }

only_what_is_asked_for() {
    expect 0 infer --maps normal,height
    holds "height.png meta.txt normal.png"
    rm -r "$T/o"
    expect 0 infer --maps preview
    holds "meta.txt preview.png"
    expect 2 infer --maps normal,nothing
    says "$T/err" "'nothing'"
    expect 2 infer --maps ""
    expect 2 infer --workflow plastic
    says "$T/err" "'plastic'"
    for o in "--normal=dx --maps=gltf" "--normal=dx --maps=glb" "--workflow=metallic --maps=materialx"; do
        expect 2 infer $o
        says "$T/err" "MaterialX"
    done
}

# Base colour and metalness, read back as a metallic map folder, are the maps that the specular workflow gives, but for
# the error that is printed.
metallic() {
    expect 0 infer --workflow metallic --maps diffuse,specular,roughness,normal
    holds "basecolor.png meta.txt metallic.png normal.png roughness.png"
    says "$T/err" "base colour and metalness miss diffuse by 0.0"
    mkdir "$T/set"
    mv "$T/o/flash" "$T/set/x"
    expect 0 "$BIN/lgd-eval" --size 32 --iterations 0 --threads 1 --set "maps:$T/set" -o "$T/e"
}

gltf() {
    command -v python3 >/dev/null || skip "python3 is not installed"
    expect 0 infer --maps gltf
    holds "diffuse.png material.gltf meta.txt normal.png roughness.png specular.png"
    # an index of refraction that makes specularColorTexture F0 itself, in Blender too
    python3 - "$T/o/flash/material.gltf" <<'EOF' || fail "the document does not say what it should"
import base64, json, struct, sys
d = json.load(open(sys.argv[1]))
m = d["materials"][0]
assert m["extensions"]["KHR_materials_ior"]["ior"] == 1000 and m["pbrMetallicRoughness"]["metallicFactor"] == 0
file = lambda t: d["images"][d["textures"][t["index"]]["source"]]["uri"]
assert file(m["pbrMetallicRoughness"]["baseColorTexture"]) == "diffuse.png" and file(m["normalTexture"]) == "normal.png"
assert file(m["pbrMetallicRoughness"]["metallicRoughnessTexture"]) == "roughness.png"
assert file(m["extensions"]["KHR_materials_specular"]["specularColorTexture"]) == "specular.png"
b = base64.b64decode(d["buffers"][0]["uri"].split(",")[1])
assert len(b) == d["buffers"][0]["byteLength"]
def corners(accessor, n):
    a = d["accessors"][accessor]
    v = d["bufferViews"][a["bufferView"]]
    first = v["byteOffset"] + a["byteOffset"]
    return [struct.unpack_from("<%df" % n, b, first + i * v["byteStride"]) for i in range(a["count"])]
for p, t in zip(corners(0, 3), corners(3, 2)):
    assert t == (p[0] + 0.5, 0.5 - p[1]), (p, t) # the picture's top is the sample's top
EOF
    if grep -q occlusion "$T/o/flash/material.gltf"; then fail "ambient occlusion that nobody asked for"; fi
    expect 0 infer --maps gltf --ao
    python3 - "$T/o/flash/material.gltf" <<'EOF' || fail "the document does not say where the occlusion is"
import json, sys
d = json.load(open(sys.argv[1]))
assert d["images"][d["textures"][d["materials"][0]["occlusionTexture"]["index"]]["source"]]["uri"] == "occlusion.png"
EOF
    command -v assimp >/dev/null || skip "assimp is not installed (assimp-utils)"
    expect 0 assimp info "$T/o/flash/material.gltf"
    says "$T/out" "Vertices:           4"
    for f in diffuse roughness normal; do says "$T/out" "'$f.png'"; done
}

# One file with all in it: the chunks, and the images the same bytes as the files.
glb() {
    command -v python3 >/dev/null || skip "python3 is not installed"
    for workflow in specular metallic; do
        expect 0 infer --workflow $workflow --maps glb --ao
        holds "material.glb meta.txt occlusion.png"
        rm -r "$T/o"
        expect 0 infer --workflow $workflow --maps glb
        [ $workflow = specular ] || says "$T/err" "base colour and metalness miss diffuse by 0.0"
        holds "material.glb meta.txt"
        expect 0 infer --workflow $workflow --maps gltf,glb --ao
        python3 - "$T/o/flash" <<'EOF' || fail "$workflow: material.glb does not hold what it should"
import json, os, struct, sys
b = open(sys.argv[1] + "/material.glb", "rb").read()
magic, version, total, n, kind = struct.unpack_from("<4sIII4s", b)
assert (magic, version, total, kind) == (b"glTF", 2, len(b), b"JSON") and n % 4 == 0
d = json.loads(b[20 : 20 + n])
size, kind = struct.unpack_from("<I4s", b, 20 + n)
binary = b[28 + n :]
assert kind == b"BIN\0" and size == len(binary) == d["buffers"][0]["byteLength"] and "uri" not in d["buffers"][0]
other = json.load(open(sys.argv[1] + "/material.gltf"))
assert d["nodes"][0]["name"] == d["materials"][0]["name"] == "flash"
assert d["materials"] == other["materials"] and len(d["images"]) == len(other["images"])
for image, named in zip(d["images"], other["images"]):
    v = d["bufferViews"][image["bufferView"]]
    assert v["byteOffset"] % 4 == 0 and image["mimeType"] == "image/png"
    inside = binary[v["byteOffset"] : v["byteOffset"] + v["byteLength"]]
    assert inside == open(os.path.join(sys.argv[1], named["uri"]), "rb").read(), named
EOF
        rm -r "$T/o"
    done
    command -v assimp >/dev/null || return 0
    expect 0 infer --maps glb
    expect 0 assimp info "$T/o/flash/material.glb"
    says "$T/out" "Vertices:           4"
}

# The document of the metallic workflow, and the packed map: green is roughness, blue metalness.
packed() {
    expect 0 infer --workflow metallic --maps gltf
    holds "basecolor.png material.gltf meta.txt normal.png orm.png"
    for f in basecolor orm normal; do says "$T/o/flash/material.gltf" "\"$f.png\""; done
    if grep -q KHR_ "$T/o/flash/material.gltf"; then fail "an extension"; fi
    rm -r "$T/o"
    expect 0 infer --maps orm,roughness,metallic,ao
    holds "meta.txt metallic.png occlusion.png orm.png roughness.png"
    says "$T/err" "base colour and metalness miss diffuse by 0.0"
    for f in metallic occlusion orm roughness; do says "$T/o/flash/meta.txt" "$f.png: linear, "; done
}

occlusion() {
    expect 0 infer --maps diffuse --ao
    holds "diffuse.png meta.txt occlusion.png"
    mv "$T/o" "$T/option"
    expect 0 infer --maps diffuse,ao
    cmp "$T/o/flash/occlusion.png" "$T/option/flash/occlusion.png" || fail "--ao and --maps ao differ"
}

materialx() {
    expect 0 infer --maps materialx
    holds "diffuse.png material.mtlx meta.txt normal.png roughness.png specular.png"
    python3 -c 'import MaterialX' 2>/dev/null || skip "the MaterialX library for Python is not installed"
    python3 - "$T/o/flash/material.mtlx" <<'EOF' || fail \
        "the MaterialX library does not take it: $(tail -n 1 "$T/.log")"
import sys, MaterialX as mx
import MaterialX.PyMaterialXGenShader, MaterialX.PyMaterialXGenGlsl as glsl
doc, library = mx.createDocument(), mx.createDocument()
mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
doc.setDataLibrary(library) if hasattr(doc, "setDataLibrary") else doc.importLibrary(library)
mx.readFromXmlFile(doc, sys.argv[1])
fine, message = doc.validate()
assert fine, message
generator = glsl.GlslShaderGenerator.create()
context = mx.PyMaterialXGenShader.GenContext(generator)
context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
names = [m.getName() for m in doc.getMaterialNodes()]
assert names == ["surface", "openpbr"], names
for m in doc.getMaterialNodes():
    source = generator.generate(m.getName(), m, context).getSourceCode("pixel")
    for word in ("diffuse_file", "f0_file", "roughness_file", "normal_file_file"):
        assert word in source, word
EOF
}

exr() {
    expect 0 infer --maps exr --exr half
    says "$T/o/flash/meta.txt" "maps.exr: linear, half float: "
    expect 0 infer --maps exr --size 513 --iterations 0
    says "$T/o/flash/meta.txt" "maps.exr: linear, half float: "
    expect 2 infer --exr double
    says "$T/err" "'double'"
    command -v exrheader >/dev/null || skip "exrheader is not installed (openexr)"
    expect 0 infer --maps exr
    expect 0 exrheader "$T/o/flash/maps.exr"
    for c in diffuse.R diffuse.G diffuse.B specular.R specular.G specular.B normal.X normal.Y normal.Z roughness.Y; do
        says "$T/out" "$c, 32-bit floating-point"
    done
    for c in R G B; do
        grep -q "^ *$c, 32-bit floating-point" "$T/out" || fail "no channel $c, which other programs show"
    done
    says "$T/out" "compression (type compression): none"
    expect 0 infer --maps exr --exr half
    expect 0 exrheader "$T/o/flash/maps.exr"
    for c in R diffuse.R normal.Z roughness.Y; do says "$T/out" "$c, 16-bit floating-point"; done
    says "$T/out" "compression (type compression): zip, multi-scanline blocks"
}

check export_only_what_is_asked_for only_what_is_asked_for
check export_metallic metallic
check export_gltf gltf
check export_glb glb
check export_packed packed
check export_occlusion occlusion
check export_materialx materialx
# Maps that repeat: another picture, of which meta.txt says so; the photograph's rendering stays that of the photograph.
seamless() {
    expect 0 infer --maps diffuse,height,render --seamless
    says "$T/o/flash/meta.txt" "seamless: the maps repeat"
    grep -Eq '^height.png: linear, 16 bit: height, value v is -0\.[0-9]+ \+ 0\.[0-9]+ v sides of the square' \
        "$T/o/flash/meta.txt" ||
        fail "no scale of the height: $(cat "$T/o/flash/meta.txt")"
    mv "$T/o" "$T/s"
    expect 0 infer --maps diffuse,render
    cmp "$T/o/flash/render.png" "$T/s/flash/render.png" || fail "render.png differs"
    if cmp -s "$T/o/flash/diffuse.png" "$T/s/flash/diffuse.png"; then fail "--seamless changes nothing"; fi
    expect 2 "$BIN/lgd-infer" --seamless --size 15 "$PHOTO" -o "$T/o"
    says "$T/err" "--seamless needs a --size of 16 at least"
}

check export_seamless seamless
check export_exr exr
