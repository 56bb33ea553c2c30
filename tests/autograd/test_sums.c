/* Gradients of values that several sums read. */
#include "tests/support/networks.h"

TEST(tape_gradient_of_a_value_used_twice)
{
    ag_tape *tape = tape_create(true);
    float x = 0.5f, g = 10;
    ag_value *p = ag_parameter(tape, ts_view(&x, (ts_shape){1, 1, 1, 1}), &g);
    ag_value *t = ag_tanh(tape, p);
    ag_value *y = ag_add(tape, ag_add(tape, t, ag_scale(tape, t, 3)), ag_scale(tape, p, 0.25f)); /* 4 tanh x + x/4 */
    CHECK(ag_backward(tape, y) == TS_OK, "%s", ag_status(tape)->message);
    const float want = 10 + 4 * (1 - tanhf(0.5f) * tanhf(0.5f)) + 0.25f; /* added to what was there */
    CHECK(fabsf(g - want) < 1e-5f, "the gradient is %g, not %g", (double)g, (double)want);
    ag_tape_destroy(&tape);
}

/* Sums hand their gradient on without a copy: to one input of two, to a convolution that multiplies it where it is,
 * and in a second pass, when all values have gradients. */
TEST(tape_gradient_of_sums_of_sums)
{
    ag_tape *tape = tape_create(true);
    float a = -2, b = 5, w = 0.75f, da = 0, db = 0, dw = 0;
    const ts_shape one = {1, 1, 1, 1};
    ag_value *p = ag_parameter(tape, ts_view(&a, one), &da), *q = ag_parameter(tape, ts_view(&b, one), &db);
    ag_value *u = ag_conv(tape, p, ag_parameter(tape, ts_view(&w, one), &dw), NULL, 1, TS_PAD_ZERO, 0.5f);
    ag_value *v = ag_scale(tape, q, 3), *s = ag_add(tape, u, v), *t = ag_add(tape, s, s);
    ag_value *loss = ag_add(tape, ag_add(tape, t, u), v); /* 3 (u + v) */
    for (int pass = 1; pass <= 2; pass++) {
        CHECK(ag_backward(tape, loss) == TS_OK, "%s", ag_status(tape)->message);
        const float want[3] = {3 * 0.75f * 0.5f, 9, 3 * 0.5f * -2};
        CHECK(da == (float)pass * want[0] && db == (float)pass * want[1] && dw == (float)pass * want[2],
              "pass %d: %g, %g, %g, not %d times %g, %g, %g", pass, (double)da, (double)db, (double)dw, pass,
              (double)want[0], (double)want[1], (double)want[2]);
    }
    ag_tape_destroy(&tape);
}
