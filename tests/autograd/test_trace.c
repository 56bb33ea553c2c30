/* A traced tape computes the same, and says what each operation was. */
#include "autograd/trace.h"
#include "ops.h"
#include "tests/test.h"
#include <string.h>

enum { MOST = 16, SIDE = 8 };
static ag_trace seen[MOST];
static int count;

static void note(const ag_trace *r)
{
    CHECK(count < MOST, "%d operations", count);
    seen[count++] = *r;
}

static void run(float *y, float *dx)
{
    static float x[SIDE * SIDE * 4], weight[8 * 4];
    ts_status st = {0};
    for (int i = 0; i < SIDE * SIDE * 4; i++) x[i] = (float)(i % 7) - 3;
    for (int i = 0; i < 8 * 4; i++) weight[i] = (float)(i % 5) - 2;
    ag_tape *tape = ag_tape_create(true, &st);
    CHECK(tape, "%s", st.message);
    memset(dx, 0, sizeof x);
    ag_value *in = ag_parameter(tape, ts_view(x, (ts_shape){1, SIDE, SIDE, 4}), dx),
             *w = ag_constant(tape, ts_view(weight, (ts_shape){8, 4, 1, 1}));
    ag_value *out = ag_conv(tape, in, w, NULL, 1, TS_PAD_ZERO, 1), *sum = ag_channel_mean(tape, ag_tanh(tape, out));
    float ones[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    ag_value *loss = ag_linear(tape, sum, ag_constant(tape, ts_view(ones, (ts_shape){1, 1, 1, 8})), NULL);
    CHECK(ag_backward(tape, loss) == TS_OK, "%s", ag_status(tape)->message);
    memcpy(y, out->t.data, (size_t)SIDE * SIDE * 8 * sizeof *y);
    ag_tape_destroy(&tape);
}

TEST(trace_says_what_ran)
{
    static float y[2][SIDE * SIDE * 8], dx[2][SIDE * SIDE * 4];
    run(y[0], dx[0]);
    CHECK(count == 0, "traced without being asked");
    ag_trace_set(note);
    run(y[1], dx[1]);
    ag_trace_set(NULL);
    CHECK(!memcmp(y[0], y[1], sizeof y[0]) && !memcmp(dx[0], dx[1], sizeof dx[0]), "other values when traced");
    CHECK(count == 8, "%d records of 4 operations forward and backward", count);
    const ag_trace *f = &seen[0], *b = &seen[7];
    CHECK(!strcmp(f->op, "conv") && !strcmp(f->pass, "forward") && f->way && !strcmp(f->way, "pointwise"),
          "first %s %s", f->op, f->pass);
    CHECK(!strcmp(b->op, "conv") && !strcmp(b->pass, "backward") && b->way, "last %s %s", b->op, b->pass);
    CHECK(f->in.c == 4 && f->out.c == 8 && f->weight.n == 8 && f->seconds >= 0, "shapes of the convolution");
    CHECK(!seen[1].way, "a way of tanh");
}
