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
    holds "preview.png"
    expect 2 infer --maps normal,nothing
    says "$T/err" "'nothing'"
    expect 2 infer --maps ""
    expect 2 infer --workflow plastic
    says "$T/err" "'plastic'"
    for o in "--normal=dx --maps=gltf" "--workflow=metallic --maps=materialx"; do
        expect 2 infer $o
        says "$T/err" "MaterialX"
    done
}

# Base colour and metalness, read back as a metallic map folder, are the maps that the specular workflow gives, but for the error that is printed.
metallic() {
    expect 0 infer --workflow metallic --maps diffuse,specular,roughness,normal
    holds "basecolor.png meta.txt metallic.png normal.png roughness.png"
    says "$T/err" "base colour and metalness miss diffuse by 0.0"
    mkdir "$T/set"
    mv "$T/o/flash" "$T/set/x"
    expect 0 "$BIN/lgd-eval" --size 32 --iterations 0 --threads 1 --set "maps:$T/set" -o "$T/e"
}

gltf() {
    command -v assimp >/dev/null || skip "assimp is not installed (assimp-utils)"
    expect 0 infer --maps gltf
    holds "diffuse.png material.gltf meta.txt normal.png roughness.png specular.png"
    expect 0 assimp info "$T/o/flash/material.gltf"
    says "$T/out" "Vertices:           4"
    for f in diffuse roughness normal; do says "$T/out" "'$f.png'"; done
    # the index of refraction that makes specularColorTexture F0 itself; assimp keeps 0 as it is
    python3 - "$T/o/flash/material.gltf" <<'EOF' || fail "the document does not say what it should"
import base64, json, struct, sys
d = json.load(open(sys.argv[1]))
m = d["materials"][0]
assert m["extensions"]["KHR_materials_ior"]["ior"] == 0 and m["pbrMetallicRoughness"]["metallicFactor"] == 0
file = lambda t: d["images"][d["textures"][t["index"]]["source"]]["uri"]
assert file(m["pbrMetallicRoughness"]["baseColorTexture"]) == "diffuse.png" and file(m["normalTexture"]) == "normal.png"
assert file(m["pbrMetallicRoughness"]["metallicRoughnessTexture"]) == "roughness.png"
assert file(m["extensions"]["KHR_materials_specular"]["specularColorTexture"]) == "specular.png"
b = base64.b64decode(d["buffers"][0]["uri"].split(",")[1])
assert len(b) == d["buffers"][0]["byteLength"]
def corners(accessor, n):
    a = d["accessors"][accessor]
    v = d["bufferViews"][a["bufferView"]]
    return [struct.unpack_from("<%df" % n, b, v["byteOffset"] + a["byteOffset"] + i * v["byteStride"]) for i in range(a["count"])]
for p, t in zip(corners(0, 3), corners(3, 2)):
    assert t == (p[0] + 0.5, 0.5 - p[1]), (p, t) # the picture's top is the sample's top
EOF
}

materialx() {
    expect 0 infer --maps materialx
    holds "diffuse.png material.mtlx meta.txt normal.png roughness.png specular.png"
    python3 -c 'import MaterialX' 2>/dev/null || skip "the MaterialX library for Python is not installed"
    python3 - "$T/o/flash/material.mtlx" <<'EOF' || fail "the MaterialX library does not take it: $(tail -n 1 "$T/.log")"
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
    command -v exrheader >/dev/null || skip "exrheader is not installed (openexr)"
    expect 0 infer --maps exr
    expect 0 exrheader "$T/o/flash/maps.exr"
    for c in diffuse.R diffuse.G diffuse.B specular.R specular.G specular.B normal.X normal.Y normal.Z roughness.Y; do says "$T/out" "$c, 32-bit floating-point"; done
    says "$T/out" "compression (type compression): none"
}

check export_only_what_is_asked_for only_what_is_asked_for
check export_metallic metallic
check export_gltf gltf
check export_materialx materialx
check export_exr exr
