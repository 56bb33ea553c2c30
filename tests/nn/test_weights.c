/* Weights files: what is written comes back, and no file that is something else does any harm. */
#include "nn/weights/weights.h"
#include "tensor/hash.h"
#include "tensor/maps.h"
#include "tensor/rng.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static nn_arch small(void)
{
    nn_arch a = nn_arch_default();
    a.g_width = 3, a.g_width_max = 5, a.g_levels = 2, a.g_size = 8, a.h_width = 6, a.h_gru = 2;
    return a;
}

TEST(weights_round_trip_is_exact)
{
    ts_status st = {0};
    nn_arch a = small();
    a.coarse_steps = 2, a.coarse_size = 20, a.coarse_width = 5, a.coarse_gru = 3;
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 1);
    m->value[3] = -0.0f;
    m->value[4] = 1e-42f;
    char path[512], again[512];
    snprintf(path, sizeof path, "%s", path_of("a.safetensors"));
    snprintf(again, sizeof again, "%s", path_of("b.safetensors"));
    nn_meta extra[] = {{"run", "stone \"and\" brick \\ \t \xc3\xa9 \xf0\x9f\xaa\xa8"}, {"empty", ""}};
    CHECK(!nn_model_save(m, m->value, path, extra, 2, &st), "%s", st.message);
    nn_model *back = nn_model_load(path, &st);
    CHECK(back, "%s", st.message);
    CHECK(!memcmp(&back->arch, &m->arch, sizeof a), "another architecture");
    CHECK(back->count == m->count && !memcmp(back->value, m->value, m->count * sizeof(float)), "other values");
    CHECK(!nn_model_save(back, back->value, again, extra, 2, &st), "%s", st.message);
    size_t n, k;
    char *x = slurp(path, &n), *y = slurp(again, &k);
    CHECK(n == k && !memcmp(x, y, n), "other bytes the second time");
    uint64_t header;
    memcpy(&header, x, 8);
    CHECK((header + 8) % 64 == 0 && x[8] == '{', "the values begin at byte %llu", (unsigned long long)header + 8);
    nn_file *f = nn_safetensors_open(path, &st);
    CHECK(f && nn_file_count(f) == m->params, "%s", st.message);
    uint64_t hash;
    CHECK(!ts_hash_file(path, &hash, &st) && nn_file_hash(f) == hash, "another hash than the file's");
    CHECK(!strcmp(nn_file_meta(f, "run"), extra[0].value), "metadata '%s'", nn_file_meta(f, "run"));
    CHECK(!*nn_file_meta(f, "empty") && !nn_file_meta(f, "none"), "empty and missing metadata");
    for (int i = 0; i < m->params; i++)
        CHECK(!strcmp(nn_file_name(f, i), m->param[i].name), "tensor %d is %s", i, nn_file_name(f, i));
    nn_file_close(&f);
    CHECK(!f, "close leaves the pointer");
    nn_model_free(&m);
    nn_model_free(&back);
}

TEST(weights_architecture_round_trip)
{
    nn_arch a = small();
    a.channels = 10, a.g_kernel_first = 5, a.g_kernel = 7, a.iterations = 11, a.recurrent = false, a.gradient = false,
    a.mean_before_norm = false, a.descent = NN_DESCENT_GRADIENT;
    a.rmse = NN_RMSE_BATCH, a.encoding = NN_GRADIENT_RAW;
    ts_status st = {0};
    char text[NN_ARCH_TEXT];
    nn_meta meta[NN_ARCH_META];
    int metas = nn_arch_to_meta(&a, meta, NN_ARCH_META, text, sizeof text);
    CHECK(metas == 17, "%d entries, not format and 16 fields", metas);
    CHECK(nn_arch_to_meta(&a, meta, metas - 1, text, sizeof text) < 0 && nn_arch_to_meta(&a, meta, metas, text, 20) < 0,
          "too little room is taken");
    nn_arch_to_meta(&a, meta, NN_ARCH_META, text, sizeof text);
    const char *path = path_of("arch.safetensors");
    CHECK(!nn_safetensors_write(path, NULL, 0, meta, metas, &st), "%s", st.message);
    nn_file *f = nn_safetensors_open(path, &st);
    nn_arch b;
    CHECK(f && !nn_arch_from_file(f, &b, &st), "%s", st.message);
    CHECK(!memcmp(&a, &b, sizeof a), "another architecture");
    nn_file_close(&f);
    for (int i = 0; i < metas; i++) { /* each key in turn missing, and then nonsense */
        for (int nonsense = 0; nonsense < 2; nonsense++) {
            nn_meta other[NN_ARCH_META];
            int n = 0;
            for (int j = 0; j < metas; j++)
                if (j != i) other[n++] = meta[j];
                else if (nonsense) other[n++] = (nn_meta){meta[j].key, "07x"};
            st = (ts_status){0};
            CHECK(!nn_safetensors_write(path, NULL, 0, other, n, &st), "%s", st.message);
            f = nn_safetensors_open(path, &st);
            CHECK(f && nn_arch_from_file(f, &b, &st) == TS_FORMAT && strstr(st.message, meta[i].key), "key %s: '%s'",
                  meta[i].key, st.message);
            nn_file_close(&f);
        }
    }
    nn_meta more[NN_ARCH_META];
    memcpy(more, meta, sizeof more);
    more[metas] = (nn_meta){"arch.attention", "true"};
    st = (ts_status){0};
    CHECK(!nn_safetensors_write(path, NULL, 0, more, metas + 1, &st), "%s", st.message);
    f = nn_safetensors_open(path, &st);
    CHECK(f && nn_arch_from_file(f, &b, &st) == TS_UNSUPPORTED && strstr(st.message, "arch.attention"), "'%s'",
          st.message);
    nn_file_close(&f);
}

TEST(weights_every_truncation_is_refused)
{
    ts_status st = {0};
    nn_arch a = small();
    nn_model *m = nn_model_create(&a, &st);
    const char *path = path_of("t.safetensors");
    CHECK(m && !nn_model_save(m, m->value, path, NULL, 0, &st), "%s", st.message);
    size_t size;
    char *all = slurp(path, &size);
    for (size_t n = 0; n < size; n += n < 200 ? 1 : 97) {
        spill(path, all, n);
        st = (ts_status){0};
        nn_model *bad = nn_model_load(path, &st);
        CHECK(!bad && st.code == TS_FORMAT && strstr(st.message, "t.safetensors"), "%zu of %zu bytes: code %d '%s'", n,
              size, st.code, st.message);
    }
    char *longer = calloc(1, size + 4);
    memcpy(longer, all, size);
    spill(path, longer, size + 4);
    st = (ts_status){0};
    CHECK(!nn_model_load(path, &st) && strstr(st.message, "4 bytes follow the last tensor"), "'%s'", st.message);
}

/* Each byte of the header changed: an error or a model, never a crash. */
TEST(weights_changed_headers_do_no_harm)
{
    ts_status st = {0};
    nn_arch a = small();
    nn_model *m = nn_model_create(&a, &st);
    const char *path = path_of("c.safetensors");
    CHECK(m && !nn_model_save(m, m->value, path, NULL, 0, &st), "%s", st.message);
    size_t size, refusals = 0;
    char *all = slurp(path, &size);
    uint64_t header;
    memcpy(&header, all, 8);
    static const char to[] = {'"', '9', '}', '\0', (char)0xff};
    for (size_t i = 0; i < 8 + header; i += 7)
        for (size_t j = 0; j < sizeof to; j++) {
            char old = all[i];
            all[i] = to[j];
            spill(path, all, size);
            all[i] = old;
            st = (ts_status){0};
            nn_model *other = nn_model_load(path, &st);
            CHECK(other || (st.code && strstr(st.message, path)), "byte %zu as %d: code %d, '%s'", i, to[j], st.code,
                  st.message);
            refusals += !other;
            nn_model_free(&other);
        }
    CHECK(refusals > header / 3, "only %zu changes were noticed", refusals);
}

TEST(weights_of_another_architecture_are_refused)
{
    ts_status st = {0};
    nn_arch a = small(), b = small();
    b.h_width = 8;
    nn_model *m = nn_model_create(&a, &st), *n = nn_model_create(&b, &st);
    nn_block block[64];
    nn_meta meta[NN_ARCH_META];
    char text[NN_ARCH_TEXT];
    int metas = nn_arch_to_meta(&a, meta, NN_ARCH_META, text, sizeof text);
    static const struct {
        const char *what;
        ts_code code;
    } expected[] = {{"\"h.conv1.weight\" has the shape [8, 18, 5, 5], not [6, 18, 5, 5]", TS_FORMAT},
                    {"\"h.newton.weight\" is missing", TS_FORMAT},
                    {"\"g.extra\" does not belong", TS_FORMAT},
                    {"\"coarse.extra\" does not belong", TS_FORMAT},
                    {"\"g.down1.conv2.weight\" holds a value that is not finite", TS_NUMERIC}};
    const char *path = path_of("x.safetensors");
    for (int c = 0; c < 5; c++) {
        const nn_model *from = c ? m : n;
        int count = 0;
        for (int i = 0; i < from->params; i++) {
            const nn_param *p = &from->param[i];
            if (c == 1 && i == from->params - 1) continue;
            block[count++] = (nn_block){
                p->name, p->rank, {p->dim[0], p->dim[1], p->dim[2], p->dim[3]}, from->value + p->offset};
        }
        if (c == 2 || c == 3) block[count++] = (nn_block){c == 2 ? "g.extra" : "coarse.extra", 1, {1}, m->value};
        if (c == 4) m->value[nn_model_find(m, "g.down1.conv2.weight")->offset + 2] = NAN;
        st = (ts_status){0};
        CHECK(!nn_safetensors_write(path, block, count, meta, metas, &st), "%s", st.message);
        nn_model *bad = nn_model_load(path, &st);
        CHECK(!bad && st.code == expected[c].code && strstr(st.message, expected[c].what), "case %d: code %d, '%s'", c,
              st.code, st.message);
    }
    st = (ts_status){0};
    char never[512];
    snprintf(never, sizeof never, "%s", path_of("never"));
    CHECK(nn_model_save(m, m->value, never, NULL, 0, &st) == TS_NUMERIC && strstr(st.message, "g.down1.conv2.weight"),
          "'%s'", st.message);
    CHECK(access(never, F_OK) != 0, "a file is left");
    st = (ts_status){0};
    CHECK(!nn_safetensors_write(path, NULL, 0, NULL, 0, &st) && !nn_model_load(path, &st) &&
              strstr(st.message, "\"format\""),
          "'%s'", st.message);
}

TEST(weights_init_from_takes_what_fits)
{
    ts_status st = {0};
    nn_arch a = small(), b = small();
    b.h_gru = 3; /* everything of h but one bias has another shape */
    nn_model *m = nn_model_create(&a, &st), *n = nn_model_create(&b, &st);
    nn_model_init(m, 1);
    nn_model_init(n, 2);
    const char *path = path_of("i.safetensors");
    CHECK(!nn_model_save(m, m->value, path, NULL, 0, &st), "%s", st.message);
    int taken, left;
    float before = n->value[nn_model_find(n, "h.output.weight")->offset];
    CHECK(!nn_model_init_from(n, path, NULL, &taken, &left, &st), "%s", st.message);
    size_t first, last;
    nn_model_range(n, NN_G, &first, &last);
    CHECK(!memcmp(m->value, n->value, last * sizeof(float)), "g was not taken");
    CHECK(n->value[nn_model_find(n, "h.output.weight")->offset] == before, "h was touched");
    CHECK(taken + left == n->params && left == 10, "%d taken, %d left of %d", taken, left, n->params);
    st = (ts_status){0};
    nn_safetensors_write(path, NULL, 0, NULL, 0, &st);
    CHECK(nn_model_init_from(n, path, NULL, &taken, &left, &st) == TS_FORMAT && strstr(st.message, path), "'%s'",
          st.message);
    st = (ts_status){0};
    CHECK(nn_model_init_from(n, path_of("none"), NULL, &taken, &left, &st) == TS_IO, "'%s'", st.message);
}

/* Every width of g grows by another factor, some to more than twice theirs; h stays. */
TEST(weights_init_from_a_narrower_g_computes_the_same)
{
    enum { SIDE = 16, VALUES = SIDE * SIDE * MAP_CHANNELS };
    ts_status st = {0};
    nn_arch narrow = small(), wide = small();
    narrow.g_size = wide.g_size = 8;
    wide.g_width = 8, wide.g_width_max = 9;
    nn_model *m = nn_model_create(&narrow, &st), *n = nn_model_create(&wide, &st);
    nn_model_init(m, 3);
    nn_model_init(n, 4);
    const char *path = path_of("narrow.safetensors");
    CHECK(!nn_model_save(m, m->value, path, NULL, 0, &st), "%s", st.message);
    int taken, left;
    CHECK(!nn_model_init_from(n, path, NULL, &taken, &left, &st) && taken == n->params && left == 0,
          "%d taken, %d left: %s", taken, left, st.message);
    float image[SIDE * SIDE * 3], first[VALUES];
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, 0);
    for (int i = 0; i < SIDE * SIDE * 3; i++) image[i] = ts_rng_uniform(&rng);
    const nn_input in = {
        .image = ts_view(image, (ts_shape){1, SIDE, SIDE, 3}), .grid = rd_grid_full(SIDE), .view = rd_flash()};
    for (int k = 0; k < 2; k++) {
        ag_tape *t = ag_tape_create(false, &st);
        const ag_value *maps = nn_predict(t, k ? n : m, &in);
        CHECK(maps, "%s", ag_status(t)->message);
        for (int i = 0; i < VALUES; i++) {
            if (!k) first[i] = maps->t.data[i];
            CHECK(fabsf(maps->t.data[i] - first[i]) <= 2e-5f, "value %d: %g, of the narrow one %g", i,
                  (double)maps->t.data[i], (double)first[i]);
        }
        ag_tape_destroy(&t);
    }
    /* Copies are read with different weights, or they would stay the same for ever. */
    const nn_param *p = nn_model_find(n, "g.down1.conv1.weight");
    const float *w = n->value + p->offset;
    CHECK(p->dim[1] == 8 && w[0] != w[3 * 9] && w[3 * 9] != w[6 * 9],
          "copies of channel 0 have the weights %g, %g and %g", (double)w[0], (double)w[3 * 9], (double)w[6 * 9]);
    m->arch.g_width = 5; /* a file that states other widths than it has */
    CHECK(!nn_model_save(m, m->value, path, NULL, 0, &st) && !nn_model_init_from(n, path, NULL, &taken, &left, &st) &&
              left > 0,
          "widths that are not there were taken");
    wide.g_levels = 1;
    nn_model_free(&n);
    n = nn_model_create(&wide, &st);
    CHECK(!nn_model_init_from(n, path, NULL, &taken, &left, &st) && left > 0,
          "widths that are not there were taken of another depth");
    nn_model_free(&m), nn_model_free(&n);
}

/* g's first layer from a file whose weights of channel c are c + 1: want[c] in the model; NAN: as it was drawn. */
static void reads_as(const char *what, nn_arch from, nn_arch to, const double *want)
{
    static const char name[] = "g.input.conv.weight";
    ts_status st = {0};
    from.h_width = to.h_width = 0;
    nn_model *m = nn_model_create(&from, &st), *n = nn_model_create(&to, &st);
    CHECK(m && n, "%s: %s", what, st.message);
    nn_model_init(m, 3);
    nn_model_init(n, 4);
    const nn_param *q = nn_model_find(m, name), *p = nn_model_find(n, name);
    for (size_t i = 0; i < q->count; i++) m->value[q->offset + i] = (float)(i / 9 % (size_t)q->dim[1] + 1);
    float *drawn = malloc(p->count * sizeof *drawn);
    memcpy(drawn, n->value + p->offset, p->count * sizeof *drawn);
    const char *path = path_of("seen.safetensors");
    int taken, left;
    CHECK(!nn_model_save(m, m->value, path, NULL, 0, &st) && !nn_model_init_from(n, path, NULL, &taken, &left, &st),
          "%s: %s", what, st.message);
    for (size_t i = 0; i < p->count; i++) {
        const size_t c = i / 9 % (size_t)p->dim[1];
        const double is = (double)n->value[p->offset + i], should = isnan(want[c]) ? (double)drawn[i] : want[c];
        CHECK(fabs(is - should) < 1e-6, "%s: channel %zu has %g, not %g", what, c, is, should);
    }
    free(drawn);
    nn_model_free(&m), nn_model_free(&n);
}

/* Colours, coordinates and what is known of a photograph keep their weights, whatever else is read. */
TEST(weights_init_from_knows_what_a_channel_is)
{
    nn_arch one = small(), known = small(), squares = small(), many = small();
    known.conditions = many.conditions = squares.conditions = true;
    many.images = 2;
    squares.g_unshuffle = 2, squares.g_detail = 4;
    const double quarter[] = {.25, .5, .75};
    double want[80];
    for (int c = 0; c < 22; c++) /* of the second photograph nothing */
        want[c] = c < 3 ? c + 1 : c < 6 ? 0 : c < 14 ? c - 2 : 0;
    reads_as("a second photograph", known, many, want);
    for (int c = 0; c < 22; c++) /* the mean of four pixels, no coordinates, what is known */
        want[c] = c < 12 ? quarter[c % 3] : c < 14 ? 0 : c - 10;
    reads_as("squares", known, squares, want);
    squares.g_width = 6, squares.g_width_max = 10;
    reads_as("squares, wider", known, squares, want);
    for (int c = 12; c < 22; c++) want[c] = 0;
    reads_as("squares, wider, conditions too", one, squares, want);
    squares.conditions = false;
    for (int c = 0; c < 14; c++) want[c] = c + 1;
    nn_arch narrow = squares, larger = squares;
    narrow.g_width = 3, narrow.g_width_max = 5;
    reads_as("wider", narrow, squares, want);
    larger.g_unshuffle = 4;
    for (int c = 0; c < 80; c++) want[c] = NAN;
    reads_as("other squares", squares, larger, want);
}

/* As data/file.c: the file that the link leads to is replaced, and a device is written to. */
TEST(weights_writing_follows_links)
{
    ts_status st = {0};
    char link[512];
    float two[] = {1, 2};
    const nn_block block = {"a", 1, {2}, two};
    mkdir(path_of("far"), 0700);
    snprintf(link, sizeof link, "%s", path_of("link.safetensors"));
    spill(path_of("far/w.safetensors"), "old", 3);
    CHECK(symlink("far/w.safetensors", link) == 0, "symlink");
    CHECK(!nn_safetensors_write(link, &block, 1, NULL, 0, &st), "%s", st.message);
    struct stat info;
    CHECK(!lstat(link, &info) && S_ISLNK(info.st_mode), "the link was replaced");
    nn_file *f = nn_safetensors_open(path_of("far/w.safetensors"), &st);
    CHECK(f && nn_file_has(f, "a"), "the link was not followed: %s", st.message);
    nn_file_close(&f);
    if (access("/dev/full", W_OK) != 0) return;
    CHECK(nn_safetensors_write("/dev/full", &block, 1, NULL, 0, &st) == TS_IO && strstr(st.message, "/dev/full"),
          "'%s'", st.message);
    CHECK(!stat("/dev/full", &info) && S_ISCHR(info.st_mode), "the device was replaced");
}

TEST(weights_writing_leaves_the_old_file_or_the_new_one)
{
    ts_status st = {0};
    char path[512], inside[600];
    float two[] = {1, 2};
    nn_block block = {"a", 1, {2}, two};
    snprintf(path, sizeof path, "%s", path_of("w.safetensors"));
    CHECK(!nn_safetensors_write(path, &block, 1, NULL, 0, &st), "%s", st.message);
    nn_meta latin = {"note", "caf\xe9"};
    CHECK(nn_safetensors_write(path, &block, 1, &latin, 1, &st) == TS_INVALID && strstr(st.message, "note"), "'%s'",
          st.message);
    st = (ts_status){0};
    block.name = "\xff";
    CHECK(nn_safetensors_write(path, &block, 1, NULL, 0, &st) == TS_INVALID, "'%s'", st.message);
    st = (ts_status){0};
    nn_file *f = nn_safetensors_open(path, &st);
    CHECK(f && nn_file_has(f, "a"), "the old file is gone: %s", st.message);
    nn_file_close(&f);
    block.name = "a";
    snprintf(inside, sizeof inside, "%s/none/w.safetensors", test_folder());
    CHECK(nn_safetensors_write(inside, &block, 1, NULL, 0, &st) == TS_IO && strstr(st.message, inside), "'%s'",
          st.message);
    st = (ts_status){0};
    char folder[512];
    snprintf(folder, sizeof folder, "%s", path_of("folder"));
    mkdir(folder, 0700);
    CHECK(nn_safetensors_write(folder, &block, 1, NULL, 0, &st) == TS_IO && strstr(st.message, folder), "'%s'",
          st.message);
    char command[700];
    snprintf(command, sizeof command, "test \"$(ls '%s' | wc -l)\" = 2", test_folder());
    CHECK(system(command) == 0, "a temporary file is left");
}
