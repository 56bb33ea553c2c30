# What the tests of lgd-eval share: one thread, since at these sizes more only wait for each other when the machine is
# busy.
. tests/cli/lib.sh
MODEL=${LGD_TEST_MODEL:-$ROOT/models/single.safetensors}
export LGD_MODEL="$MODEL"

model() { [ -f "$MODEL" ] || fail "$MODEL is absent: the weights that the project ships"; }
evaluate() { "$BIN/lgd-eval" --size 32 --iterations 2 --threads 1 "$@"; }
