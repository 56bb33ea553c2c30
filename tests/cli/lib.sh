# Helpers of the scripts in this folder. Each test is a function; `check NAME function` runs it in a subshell with
# an empty folder $T as scratch, and prints one line. A test fails by `fail "why"` or ends early by `skip "why"`.
set -u
ROOT=$(pwd)
: "${BUILD:=build}" "${TESTDATA:=../shared/testdata}" "${FIXTURES:=../shared/fixtures}"
case $BUILD in /*) ;; *) BUILD=$ROOT/$BUILD ;; esac
case $TESTDATA in /*) ;; *) TESTDATA=$ROOT/$TESTDATA ;; esac
BIN=$BUILD/bin

fail() { echo "$*" >"$T/.why"; exit 1; }
skip() { echo "$*" >"$T/.why"; exit 77; }

check() {
    T=$(mktemp -d) || exit 1
    ( "$2" ) >"$T/.log" 2>&1
    case $? in
    0) echo "ok $1" ;;
    77) echo "skip $1: $(cat "$T/.why")" ;;
    *) echo "FAIL $1: $(cat "$T/.why" 2>/dev/null || tail -n 1 "$T/.log" | cut -c1-300)" ;;
    esac
    chmod -R u+w "$T" 2>/dev/null
    rm -rf "$T"
}

# expect CODE command…: runs it with stdout in $T/out and stderr in $T/err, fails unless it exits with CODE.
expect() {
    want=$1
    shift
    "$@" >"$T/out" 2>"$T/err"
    got=$?
    [ "$got" -eq "$want" ] || fail "'$*' exited with $got, not $want: $(head -n 1 "$T/err" | cut -c1-200)"
}

# Root may write everywhere: sets NOT_ROOT to what a command begins with that is to be another user's, who can read $T.
# Skips where there is no other or not one who may run $1.
not_root() {
    NOT_ROOT=
    [ "$(id -u)" -eq 0 ] || return 0
    command -v setpriv >/dev/null || skip "root may write everywhere, and setpriv is not installed (util-linux)"
    NOT_ROOT="setpriv --reuid=65534 --regid=65534 --clear-groups"
    chmod -R a+rX "$T"
    $NOT_ROOT test -r "$T" || skip "root may write everywhere, and no other user may read $T"
    $NOT_ROOT "$1" --version >/dev/null 2>&1 || skip "root may write everywhere, and no other user may run $1"
}

# make install and make manuals need help2man, which make test installs where it may.
has_help2man() { command -v help2man >/dev/null || skip "help2man is not installed"; }

# says FILE TEXT: fails unless the file contains the text. lines FILE N: fails unless it has N lines.
says() { grep -qF -- "$2" "$1" || fail "no '$2' in: $(head -n 2 "$1" | cut -c1-200)"; }
lines() { [ "$(wc -l <"$1")" -eq "$2" ] || fail "$(wc -l <"$1") lines, not $2: $(head -n 3 "$1" | cut -c1-200)"; }
