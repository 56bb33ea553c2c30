/* R_0 as the mean over the photograph's orientations. */
#include "tensor/maps.h"
#include "tests/support/networks.h"

static float *turned(const float *from, int channels, int quarter, bool mirrored)
{
    float *to = malloc((size_t)SIDE * SIDE * (size_t)channels * sizeof *to);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            int a = x, b = y; /* of from: mirrored, then turned counter-clockwise */
            for (int q = 0; q < quarter; q++) {
                const int t = a;
                a = SIDE - 1 - b;
                b = t;
            }
            if (mirrored) a = SIDE - 1 - a;
            memcpy(to + (size_t)(y * SIDE + x) * (size_t)channels, from + (size_t)(b * SIDE + a) * (size_t)channels,
                   (size_t)channels * sizeof *to);
        }
    return to;
}

/* Maps whose pixels were turned have normals that turn too. */
static void turn_normals(float *maps, int quarter, bool mirrored)
{
    for (int i = 0; i < SIDE * SIDE; i++) {
        float *n = maps + (size_t)i * MAP_CHANNELS + MAP_NORMAL;
        if (mirrored) n[0] = -n[0];
        for (int q = 0; q < quarter; q++) {
            const float x = n[0];
            n[0] = -n[1];
            n[1] = x;
        }
    }
}

/* R_0 of count orientations turns with the photograph by what is a way of theirs. */
static void turn(const nn_model *m, const nn_input *photographed, int count)
{
    nn_input in = *photographed;
    in.orientations = count;
    ag_tape *tape = tape_create(false);
    const ag_value *first = nn_predict(tape, m, &in);
    check_tape(tape);
    CHECK(nn_orients(m, &in), "the flash photograph is not alike in all of its orientations");
    for (int way = 1; way < 8; way++) {
        const bool within = count == 8 || (!(way & 4) && count == 4);
        nn_input other = in;
        float *photo = turned(in.image.data, 3, way & 3, way & 4),
              *want = turned(first->t.data, MAP_CHANNELS, way & 3, way & 4);
        turn_normals(want, way & 3, way & 4);
        other.image.data = photo;
        const ag_value *maps = nn_predict(tape, m, &other);
        check_tape(tape);
        double worst = 0;
        for (int i = 0; i < SIDE * SIDE * MAP_CHANNELS; i++)
            worst = farther(worst, fabs((double)maps->t.data[i] - want[i]));
        CHECK(!within || worst < 1e-5, "%d orientations, turned by %d quarters, mirrored %d: R_0 is another one by %g",
              count, way & 3, way >> 2, worst);
        CHECK(within || worst > 1e-3, "%d orientations, turned by %d quarters, mirrored %d: R_0 is the same", count,
              way & 3, way >> 2);
        free(photo), free(want);
    }
    in.orientations = 1;
    const ag_value *plain = nn_predict(tape, m, &in);
    double most = 0;
    for (int i = 0; i < SIDE * SIDE * MAP_CHANNELS; i++)
        most = farther(most, fabs((double)plain->t.data[i] - first->t.data[i]));
    CHECK(count == 1 ? most == 0 : most > 1e-3, "%d orientations are %g from the one", count, most);
    ag_tape_destroy(&tape);
}

TEST(nn_orientations_make_no_difference)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 3);
    nn_input in = photographs(1, SIDE, 5, NULL);
    for (int count = 1; count <= 8; count *= 2) turn(m, &in, count);
    nn_model_free(&m);
    free(in.image.data);
}

TEST(nn_two_orientations_are_the_photograph_and_a_quarter_turn)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 3);
    nn_input in = photographs(1, SIDE, 5, NULL), other = in;
    ag_tape *tape = tape_create(false);
    const ag_value *plain = nn_predict(tape, m, &in);
    other.image.data = turned(in.image.data, 3, 3, false);
    const ag_value *beside = nn_predict(tape, m, &other);
    in.orientations = 2;
    const ag_value *both = nn_predict(tape, m, &in);
    check_tape(tape);
    float *back = turned(beside->t.data, MAP_CHANNELS, 1, false);
    turn_normals(back, 1, false);
    double worst = 0;
    for (int i = 0; i < SIDE * SIDE * MAP_CHANNELS; i++)
        worst = farther(worst, fabs(both->t.data[i] - 0.5 * ((double)plain->t.data[i] + back[i])));
    CHECK(worst < 1e-6, "two orientations are %g from the mean of their maps", worst);
    ag_tape_destroy(&tape);
    nn_model_free(&m);
    free(back), free(other.image.data), free(in.image.data);
}

TEST(nn_orientations_need_a_light_above_the_centre)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 3);
    nn_input in = photographs(1, SIDE, 5, NULL);
    in.view.light[0] = 0.1f;
    ag_tape *tape = tape_create(false);
    ag_value *plain = nn_predict(tape, m, &in);
    in.orientations = 8;
    CHECK(!nn_orients(m, &in) && same(plain, nn_predict(tape, m, &in)),
          "a light from the side is taken for one from above");
    ag_tape_destroy(&tape);
    nn_model_free(&m);
    free(in.image.data);
}
