/* Every op's gradients against differences, on every instruction set. */
#include "autograd/gradcheck.h"
#include "tensor/cpu.h"
#include "tests/test.h"

static void report(const char *op, int cases, int64_t compared, int64_t excluded, const ts_status *st, void *user)
{
    CHECK(st->code == TS_OK, "%s: %s", ts_isa_name(ts_isa_now()), st->message);
    CHECK(cases > 0 && compared >= 20, "%s: only %lld gradients in %d cases were compared", op, (long long)compared,
          cases);
    CHECK(excluded <= compared / 4, "%s: %lld of %lld gradients sit at a kink", op, (long long)excluded,
          (long long)(compared + excluded));
    ++*(int *)user;
}

static void gradcheck_on(ts_isa isa)
{
    if (isa > ts_isa_best()) test_skip("this CPU has no %s", ts_isa_name(isa));
    ts_isa_use(isa);
    int ops = 0;
    CHECK(ag_gradcheck_all(1 + (uint64_t)isa, report, &ops) == 0, "an op failed"); /* other shapes on each */
    CHECK(ops >= 15, "only %d ops were checked", ops);
}

TEST(gradcheck_base) { gradcheck_on(TS_BASE); }
TEST(gradcheck_avx2) { gradcheck_on(TS_AVX2); }
TEST(gradcheck_avx512) { gradcheck_on(TS_AVX512); }
TEST(gradcheck_avx512bf16) { gradcheck_on(TS_AVX512BF16); }
TEST(gradcheck_amx) { gradcheck_on(TS_AMX); }
