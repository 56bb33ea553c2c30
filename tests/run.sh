#!/bin/sh
# Every test: the C runner, then each script of tests/cli. Prints a line a test and "N passed, N failed" last.
# Environment: BUILD, TESTDATA, FIXTURES.
set -u
: "${BUILD:=build}" "${TESTDATA:=../shared/testdata}" "${FIXTURES:=../shared/fixtures}"
export BUILD TESTDATA FIXTURES
results=$(mktemp) || exit 1
trap 'rm -f "$results"' EXIT

"$BUILD/bin/lgd-test" >"$results.part" 2>&1
code=$?
cat "$results.part" | tee -a "$results"
# A runner that died says nothing of the tests it did not reach.
if [ $code -ne 0 ] && ! grep -q '^FAIL ' "$results.part"; then
    echo "FAIL lgd-test: exit status $code" | tee -a "$results"
fi
rm -f "$results.part"
for script in tests/cli/*.sh; do
    case $script in */lib.sh | */lib_*.sh) continue ;; esac
    sh "$script" >"$results.part" 2>&1
    code=$?
    cat "$results.part" | tee -a "$results"
    if [ $code -ne 0 ]; then echo "FAIL $script: exit status $code" | tee -a "$results"; fi
    rm -f "$results.part"
done

passed=$(grep -c '^ok ' "$results")
failed=$(grep -c '^FAIL ' "$results")
skipped=$(grep -c '^skip ' "$results")
if [ "$skipped" -gt 0 ]; then echo "Skipped:"; grep '^skip ' "$results"; fi
if [ "$failed" -gt 0 ]; then echo "Failed:"; grep '^FAIL ' "$results"; fi
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
