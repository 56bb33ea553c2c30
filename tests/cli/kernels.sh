#!/bin/sh
# What the compiler made of a kernel for an instruction set that this CPU may not have.
. tests/cli/lib.sh

# The shortest loop of bf16_14_2 with vdpbf16ps in it: how many, and how many references to the stack.
inner_loop() {
    objdump -d --no-show-raw-insn "$1" | awk '
        function number(text,   i, n) {
            for (n = i = 0; i++ < length(text);) n = 16 * n + index("0123456789abcdef", substr(text, i, 1)) - 1
            return n
        }
        /^[0-9a-f]+ <bf16_14_2>:$/ { inside = 1; next }
        inside && !/^ / { exit }
        inside {
            address = $1
            sub(":", "", address)
            at[++n] = number(address)
            text[n] = $0
            if ($2 !~ /^j/ || number($3) > at[n]) next
            products = stack = 0
            for (i = n; i > 0 && at[i] >= number($3); i--) {
                if (text[i] ~ /vdpbf16ps/) products++
                if (text[i] ~ /\(%r[sb]p/) stack++
            }
            if (products && (!length_found || n - i < length_found)) {
                length_found = n - i; found = products " " stack
            }
        }
        END { print found }'
}

# 4 pairs of inputs times 14 pixels times 2 vectors.
bf16_inner_loop_spills_nothing() {
    case ${MAKEFLAGS:-} in *fsanitize*) skip "the sanitizers' build is not optimised" ;; esac
    object=$BUILD/obj/tensor/kernels/conv.avx512bf16.o
    [ -e "$object" ] || skip "no kernels for avx512bf16 in this build"
    command -v objdump >/dev/null || skip "no objdump"
    # In clang's code, f32 or bf16, tiles do not stay in registers.
    objdump -s -j .comment "$object" | grep -q 'GCC:' || skip "compiled by another compiler than gcc"
    # shellcheck disable=SC2046
    set -- $(inner_loop "$object")
    [ $# -eq 2 ] || fail "no loop with vdpbf16ps in bf16_14_2 of $object"
    [ "$1" -eq 112 ] || fail "$1 vdpbf16ps in the inner loop, not 112"
    [ "$2" -eq 0 ] || fail "$2 references to the stack in the inner loop"
    if objdump -d --no-show-raw-insn "$BUILD/obj/tensor/kernels/conv.avx512.o" | grep -q vdpbf16ps; then
        fail "vdpbf16ps in the kernels for avx512"
    fi
}
check bf16_inner_loop_spills_nothing bf16_inner_loop_spills_nothing
