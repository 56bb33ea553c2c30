#!/bin/sh
# Which room may include which (docs/architecture.md): prints every include that breaks the rule and ends with 1.
# A room is a folder; one that has no row of its own has the row of the folder that it stands in.
allowed() {
    case $1 in
    tensor/kernels) echo "tensor tensor/kernels" ;;
    tensor/conv) echo "tensor tensor/kernels tensor/conv" ;;
    tensor) echo "tensor tensor/kernels" ;;
    autograd) echo "autograd tensor tensor/conv tensor/kernels" ;;
    render/kernels) echo "render/kernels tensor tensor/kernels" ;;
    render) echo "render render/kernels autograd tensor tensor/kernels" ;;
    nn/weights) echo "nn/weights nn tensor tensor/kernels" ;;
    nn) echo "nn nn/weights render autograd tensor tensor/conv tensor/kernels" ;;
    data/image) echo "data/image data tensor" ;;
    data/materials) echo "data/materials data data/image tensor tensor/conv tensor/kernels" ;;
    data/rectify) echo "data/rectify data/image data tensor" ;;
    data) echo "data data/image data/materials data/rectify tensor tensor/conv" ;;
    cli) echo "cli render data autograd tensor" ;;
    cli/data) echo "cli cli/data render data data/image data/materials data/rectify autograd tensor" ;;
    cli/infer|cli/convert)
        echo "cli cli/infer infer nn nn/weights render data data/image data/rectify autograd tensor tensor/conv" ;;
    cli/capture) echo "cli cli/capture render data data/image data/rectify autograd tensor" ;;
    train/mpi) echo "train/mpi tensor" ;;
    train) echo "train train/mpi cli nn nn/weights render data data/image data/materials autograd tensor tensor/conv" ;;
    infer) echo "infer nn nn/weights render data data/image data/rectify autograd tensor tensor/conv" ;;
    eval/metrics) echo "eval/metrics eval nn nn/weights render data data/image autograd tensor tensor/conv" ;;
    eval/methods)
        echo "eval/methods eval/metrics eval cli infer nn nn/weights render data data/materials" \
            "autograd tensor tensor/conv" ;;
    eval)
        echo "eval eval/methods eval/metrics cli infer nn nn/weights render data data/image data/materials" \
            "data/rectify autograd tensor tensor/conv" ;;
    *) return 1 ;;
    esac
}
bad=0
rooms="tensor autograd render nn data cli train infer eval"
for file in $(find $rooms -name '*.[ch]' -o -name '*.cpp'); do
    room=${file%/*}
    if ! ok=$(allowed "$room"); then echo "$room/ has no row in .ci/includes.sh" >&2; bad=1; continue; fi
    case $file in
    */main.c) ok="$ok data/materials" ;;
    esac
    for used in $(sed -n 's/^ *# *include "\([a-z/_]*\)\/[a-z_0-9]*\.h".*/\1/p' "$file"); do
        case " $ok " in
        *" $used "*) ;;
        *) echo "$file includes $used/, which $room/ may not" >&2; bad=1 ;;
        esac
    done
done
# Intrinsics and target flags belong to the kernels alone.
if grep -lE '_mm(256|512)?_|immintrin|__AVX' $(find $rooms -name '*.[ch]' -not -path '*/kernels/*'); then
    echo "instruction-set knowledge outside tensor/kernels/ and render/kernels/" >&2
    bad=1
fi
exit $bad
