/* What a scope of a tape without gradients keeps. */
#include "tests/support/networks.h"

/* Data before its header, which would be written over it; the same twice; data that lies elsewhere; the last made
 * first.
 */
TEST(tape_scope_moves_what_it_keeps_intact)
{
    enum { COUNT = 300 };
    static float elsewhere[COUNT];
    const ts_shape s = {1, 1, COUNT, 1};
    for (int first = 0; first < 2; first++) {
        ag_tape *tape = tape_create(false);
        for (int i = 0; i < COUNT; i++) elsewhere[i] = 0.5f - (float)i;
        const ts_mark mark = ag_scope_begin(tape);
        if (!first) ag_empty(tape, (ts_shape){1, 1, 1, 5 * COUNT}); /* room, and no value is in another's way */
        const ts_tensor early = ts_new(ag_arena(tape), s);
        for (int i = 0; i < COUNT; i++) early.data[i] = (float)i;
        ag_value *a = ag_constant(tape, early), *b = ag_scale(tape, a, 2),
                 *c = ag_constant(tape, ts_view(elsewhere, s)), *keep[5] = {b, a, c, a, ag_scale(tape, b, 3)};
        ag_scope_end(tape, mark, keep, 5);
        CHECK(!ag_status(tape)->code, "%s", ag_status(tape)->message);
        for (int i = 0; i < COUNT; i++) {
            const float v = (float)i;
            CHECK(keep[0]->t.data[i] == 2 * v && keep[1]->t.data[i] == v && keep[2]->t.data[i] == elsewhere[i] &&
                      keep[3]->t.data[i] == v && keep[4]->t.data[i] == 6 * v,
                  "room %d: number %d was damaged by the move", !first, i);
        }
        CHECK(keep[2]->t.data != elsewhere && ts_same(keep[2]->t.shape, s), "what lies elsewhere was not copied");
        ag_tape_destroy(&tape);
    }
}
