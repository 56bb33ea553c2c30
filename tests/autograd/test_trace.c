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

static void convolve(ag_tape *tape, ag_value *const *in, ag_value **out, const void *user)
{
    (void)user;
    out[0] = ag_conv(tape, in[0], in[1], NULL, 1, TS_PAD_ZERO, 1);
}

/* dx: NULL where the input needs no gradient; part: the convolution is one. */
static void run(float *y, float *dx, bool part)
{
    static float x[SIDE * SIDE * 4], weight[8 * 4], dweight[8 * 4];
    ts_status st = {0};
    for (int i = 0; i < SIDE * SIDE * 4; i++) x[i] = (float)(i % 7) - 3;
    for (int i = 0; i < 8 * 4; i++) weight[i] = (float)(i % 5) - 2;
    ag_tape *tape = ag_tape_create(true, &st);
    CHECK(tape, "%s", st.message);
    const ts_tensor image = ts_view(x, (ts_shape){1, SIDE, SIDE, 4}), kernel = ts_view(weight, (ts_shape){8, 4, 1, 1});
    if (dx) memset(dx, 0, sizeof x);
    ag_value *in[] = {dx ? ag_parameter(tape, image, dx) : ag_constant(tape, image),
                      dx ? ag_constant(tape, kernel) : ag_parameter(tape, kernel, dweight)};
    ag_value *out;
    if (part) ag_checkpoint(tape, convolve, "", 1, 2, in, (float *[2]){NULL}, 1, &out);
    else convolve(tape, in, &out, NULL);
    ag_value *sum = ag_channel_mean(tape, ag_tanh(tape, out));
    float ones[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    ag_value *loss = ag_linear(tape, sum, ag_constant(tape, ts_view(ones, (ts_shape){1, 1, 1, 8})), NULL);
    CHECK(ag_backward(tape, loss) == TS_OK, "%s", ag_status(tape)->message);
    memcpy(y, out->t.data, (size_t)SIDE * SIDE * 8 * sizeof *y);
    ag_tape_destroy(&tape);
}

TEST(trace_says_what_ran)
{
    static float y[2][SIDE * SIDE * 8], dx[2][SIDE * SIDE * 4];
    run(y[0], dx[0], false);
    CHECK(count == 0, "traced without being asked");
    ag_trace_set(note);
    run(y[1], dx[1], false);
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

TEST(trace_of_a_part_has_no_way)
{
    static float y[SIDE * SIDE * 8], dx[SIDE * SIDE * 4];
    int parts = 0, ways = 0;
    ag_trace_set(note);
    run(y, dx, true);
    ag_trace_set(NULL);
    for (int i = 0; i < count; i++) {
        CHECK(!strcmp(seen[i].op, "conv") == (seen[i].way != NULL), "%s of a %s: a way is %s", seen[i].pass, seen[i].op,
              seen[i].way ? seen[i].way : "missing");
        parts += !strcmp(seen[i].op, "part"), ways += seen[i].way != NULL;
    }
    CHECK(parts == 1 && ways == 3, "%d parts, %d ways", parts, ways);
}

TEST(trace_of_a_gradient_that_is_not_computed_has_no_way)
{
    static float y[SIDE * SIDE * 8];
    ag_trace_set(note);
    run(y, NULL, false);
    ag_trace_set(NULL);
    for (int i = 0; i < count; i++)
        CHECK(strcmp(seen[i].pass, "backward") || !seen[i].way, "%s went %s", seen[i].op, seen[i].way);
    CHECK(count == 8 && seen[0].way, "%d records", count);
}
