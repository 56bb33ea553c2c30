#!/bin/sh
# Who may include whom (docs/architecture.md): prints every include that breaks the rule and ends with 1.
allowed() {
    case $1 in
    tensor) echo "tensor" ;;
    autograd) echo "autograd tensor" ;;
    render) echo "render autograd tensor" ;;
    nn) echo "nn render autograd tensor" ;;
    data) echo "data tensor" ;;
    cli) echo "cli tensor" ;;
    train) echo "train cli nn render data autograd tensor" ;;
    infer) echo "infer cli nn render data autograd tensor" ;;
    eval) echo "eval cli infer nn render data autograd tensor" ;;
    esac
}
bad=0
for folder in tensor autograd render nn data cli train infer eval; do
    for file in $(find "$folder" -name '*.[ch]' -o -name '*.cpp'); do
        ok=$(allowed "$folder")
        case $file in
        */main.c|infer/convert_main.c) ok="$ok cli nn render data autograd infer" ;;
        esac
        for used in $(sed -n 's/^ *# *include "\([a-z]*\)\/.*/\1/p' "$file"); do
            case " $ok " in
            *" $used "*) ;;
            *) echo "$file includes $used/, which $folder/ may not" >&2; bad=1 ;;
            esac
        done
    done
done
# Intrinsics and target flags belong to the kernels alone.
if grep -lE '_mm(256|512)?_|immintrin|__AVX' $(find autograd render nn data cli train infer eval tensor -maxdepth 1 -name '*.[ch]') 2>/dev/null; then
    echo "instruction-set knowledge outside tensor/kernels/" >&2
    bad=1
fi
exit $bad
