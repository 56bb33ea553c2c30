# lgd-infer on photographs taken at an angle.
. tests/cli/lib_infer.sh

angle() {
    model
    photo "$T/a.ppm" 60 40
    expect 0 infer --corners 10,5 40,8 42,35 8,30 "$T/a.ppm" --fov 50 -o "$T/o"
    complete "$T/o/a"
    says "$T/err" "from straight above"
    says "$T/o/a/meta.txt" "across the square (by the corners; 50.0 degrees across the photograph: --fov)"
    expect 0 infer "$T/a.ppm" --corners "10,5 40,8 42,35 8,30" -o "$T/p"
    says "$T/err" "warning: assumed"
    says "$T/p/a/meta.txt" "assumed"
    if cmp -s "$T/o/a/render.png" "$T/p/a/render.png"; then fail "the field of view changes nothing"; fi
}

mistakes() {
    model
    photo "$T/a.ppm" 60 40
    expect 2 infer --corners 10,5 42,35 40,8 8,30 "$T/a.ppm" -o "$T/o"
    says "$T/err" cross
    expect 2 infer --corners=-3,5 40,8 42,35 8,30 "$T/a.ppm" -o "$T/o"
    says "$T/err" "corner 1 at -3,5 is outside the photograph"
    expect 2 infer --corners 10,5 40,8 42,35 8,30 --orientations 2 "$T/a.ppm" -o "$T/o"
    says "$T/err" "not with --corners"
    expect 2 infer --corners 10,5 40,8 42,35 "$T/a.ppm" -o "$T/o"
    says "$T/err" a.ppm
    expect 2 infer --corners 10,5 40,8 42,35 8,30 "$T/a.ppm" "$T/b.ppm" -o "$T/o"
    says "$T/err" "--corners takes 1 photograph at most: '$T/b.ppm' is one too many"
    says "$T/err" b.ppm
    expect 1 infer --corners 10,5 70,8 72,35 8,30 "$T/a.ppm" -o "$T/o"
    says "$T/err" outside
    lines "$T/err" 1
    [ ! -e "$T/o/a" ] || fail "maps in spite of bad corners"
}

check angle_infer angle
check angle_mistakes mistakes
