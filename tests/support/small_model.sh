# The beginning of a configuration of lgd-train, up to [data]: the smallest network that has all parts of a large one.
# $1: its steps, 2 where not given.
small_model() {
    printf '%s\n' '[model]' 'g_width = 4' 'g_width_max = 8' 'g_levels = 2' 'g_size = 16' 'h_width = 8' 'h_gru = 4' \
        "iterations = ${1:-2}" '[data]' 'patch = 16'
}

# A whole one, whose last.safetensors are the weights that training starts with.
first_weights() {
    small_model "$@"
    printf '%s\n' '[train]' 'batch = 2' 'steps = 1' 'rate = 0' 'ema = 0' '[validate]' 'count = 2' 'size = 16'
}
