/* PyTorch's files: those of tests/corpus/torch (tests/nn/make_torch_files.py makes them) give what expected.tsv says,
 * and what is written comes back. */
#include "nn/weights/weights.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char corpus[] = "tests/corpus/torch";

/* tensors: NAME DTYPE 2x3 0,1,2,3,4,5;… */
static void check_good(const char *path, char *tensors)
{
    ts_status st = {0};
    nn_file *f = nn_file_open(path, &st);
    CHECK(f, "%s", st.message);
    CHECK(nn_file_form(f) == (strstr(path, "/old") ? NN_FORM_TORCH_OLD : NN_FORM_TORCH_ZIP), "%s: form %d", path,
          nn_file_form(f));
    int n = 0;
    char *end = NULL;
    for (char *t = strtok_r(tensors, ";", &end); t; t = strtok_r(NULL, ";", &end), n++) {
        char name[64], type[16], shape[64], values[256], has[64] = "";
        CHECK(sscanf(t, "%63s %15s %63s %255s", name, type, shape, values) == 4, "%s: '%s'", path, t);
        const nn_tensor *e = nn_file_find(f, name);
        CHECK(e && nn_file_tensor(f, n) == e, "%s: tensor %s is not number %d", path, name, n);
        for (int i = 0; i < e->rank; i++) sprintf(has + strlen(has), "%s%lld", i ? "x" : "", (long long)e->dim[i]);
        CHECK(!strcmp(nn_dtype_name(e->dtype), type) && !strcmp(*has ? has : "-", shape), "%s: %s is %s %s", path, name,
              nn_dtype_name(e->dtype), has);
        if (!strcmp(values, "-")) continue;
        float out[64];
        CHECK(!nn_file_read(f, name, e->rank, e->dim, out, &st), "%s", st.message);
        char *v = values;
        for (int i = 0; i < e->count; i++, v++) {
            float wanted = strtof(v, &v);
            CHECK(fabsf(out[i] - wanted) <= 1e-5f * fabsf(wanted), "%s: %s[%d] = %g, not %g", path, name, i, out[i],
                  wanted);
        }
    }
    CHECK(n == nn_file_count(f), "%s: %d tensors", path, nn_file_count(f));
    nn_file_close(&f);
}

TEST(torch_files_of_every_form)
{
    char path[2048], line[1024];
    int good = 0, bad = 0;
    snprintf(path, sizeof path, "%s/expected.tsv", corpus);
    FILE *list = fopen(path, "r");
    CHECK(list, "%s cannot be read", path);
    while (fgets(line, sizeof line, list)) {
        line[strcspn(line, "\n")] = 0;
        char *what = strchr(line, '\t'), *rest = what ? strchr(what + 1, '\t') : NULL;
        CHECK(rest, "'%s'", line);
        *what++ = *rest++ = 0;
        snprintf(path, sizeof path, "%s/%s", corpus, line);
        if (!strcmp(what, "ok")) {
            check_good(path, rest);
            good++;
            continue;
        }
        ts_status st = {0};
        nn_file *f = nn_file_open(path, &st);
        CHECK(!f, "%s is taken; it should say '%s'", path, rest);
        CHECK(st.code == TS_FORMAT || st.code == TS_UNSUPPORTED, "%s: code %d", path, st.code);
        CHECK(strstr(st.message, path) == st.message && strstr(st.message, rest) && !strpbrk(st.message, "\n\033"),
              "%s: '%s' does not say '%s'", path, st.message, rest);
        bad++;
    }
    fclose(list);
    CHECK(good >= 25 && bad >= 90, "%d good and %d bad files", good, bad);
}

/* No change of a byte does any harm: the file is refused, or what is read lies inside it (the sanitizers see when not).
 */
TEST(torch_changed_bytes_do_no_harm)
{
    static const char *const name[] = {"shared.pth",    "deflated.pth", "zip64.pth",  "big.pth",
                                       "protocol4.pth", "old_view.pth", "nested.pth", "version3.pth"};
    static const unsigned char change[] = {0x01, 0x80, 0xff};
    float sum = 0;
    for (size_t k = 0; k < sizeof name / sizeof *name; k++) {
        char path[512];
        size_t size;
        snprintf(path, sizeof path, "%s/%s", corpus, name[k]);
        char *all = slurp(path, &size);
        const char *to = path_of("changed.pth");
        for (size_t i = 0; i < size; i++)
            for (int c = 0; c < 3; c++) {
                all[i] = (char)(all[i] ^ change[c]);
                spill(to, all, size);
                all[i] = (char)(all[i] ^ change[c]);
                ts_status st = {0};
                nn_file *f = nn_file_open(to, &st);
                CHECK(f || (st.code && *st.message), "no message for byte %zu of %s", i, name[k]);
                for (int j = 0; f && j < nn_file_count(f); j++) {
                    const nn_tensor *e = nn_file_tensor(f, j);
                    float out[4096];
                    if (e->count > 4096 || nn_file_read(f, e->name, e->rank, e->dim, out, NULL)) continue;
                    for (int m = 0; m < e->count; m++) sum += out[m] > 0;
                }
                nn_file_close(&f);
            }
        free(all);
    }
    CHECK(sum > 0, "nothing was ever read");
}

static bool at_once(void) { return true; }

TEST(torch_writing_is_interrupted)
{
    ts_status st = {0};
    float value[] = {1, 2};
    const nn_tensor entry = {"a", NN_F32, false, 1, {2}, {1}, 2, (unsigned char *)value};
    for (int k = 0; k < 2; k++)
        CHECK(nn_file_write(path_of("w"), k ? NN_FORM_TORCH_ZIP : NN_FORM_SAFETENSORS, &entry, 1, NN_DTYPES, NULL, 0,
                            at_once, &st) == TS_INTERRUPTED,
              "'%s'", st.message);
    DIR *folder = opendir(test_folder());
    int entries = 0;
    while (readdir(folder)) entries++;
    closedir(folder);
    CHECK(entries == 2, "%d entries are left", entries - 2);
}

TEST(torch_writing_and_reading_is_exact)
{
    ts_status st = {0};
    float value[] = {1, -0.0f, 1e-42f, 65504, 3.1415927f, -2};
    int64_t whole = -7;
    nn_tensor entry[] = {{"g.a \"b\" \xc3\xa9", NN_F32, false, 2, {3, 2}, {1, 3}, 6, (unsigned char *)value},
                         {"n", NN_I64, false, 0, {0}, {0}, 1, (unsigned char *)&whole},
                         {"none", NN_F32, false, 2, {0, 4}, {4, 1}, 0, (unsigned char *)value},
                         {"rows", NN_F32, false, 2, {2, 3}, {3, 1}, 6, (unsigned char *)value}};
    nn_meta meta[] = {{"format", "lgd"}, {"note", "two\nlines \xf0\x9f\xaa\xa8"}};
    for (int k = 0; k < 2; k++) {
        const char *path = path_of(k ? "w.pth" : "w.safetensors");
        CHECK(
            !nn_file_write(path, k ? NN_FORM_TORCH_ZIP : NN_FORM_SAFETENSORS, entry, 4, NN_DTYPES, meta, 2, NULL, &st),
            "%s", st.message);
        nn_file *f = nn_file_open(path, &st);
        CHECK(f && nn_file_count(f) == 4, "%s", st.message);
        CHECK(!strcmp(nn_file_meta(f, "format"), "lgd") && !strcmp(nn_file_meta(f, "note"), meta[1].value) &&
                  !nn_file_meta_key(f, 2),
              "metadata");
        for (int i = 0; i < 4; i++) {
            const nn_tensor *e = nn_file_find(f, entry[i].name);
            unsigned char wanted[64], has[64];
            CHECK(e && e->dtype == entry[i].dtype && e->count == entry[i].count && nn_tensor_plain(e), "tensor %d", i);
            CHECK(nn_tensor_copy(&entry[i], e->dtype, wanted) && nn_tensor_copy(e, e->dtype, has), "an overflow");
            CHECK(!memcmp(wanted, has, (size_t)e->count * (size_t)nn_dtype_size(e->dtype)), "values of tensor %d", i);
            CHECK(!k || ((uintptr_t)e->data % 64 == 0), "tensor %d is not aligned", i);
        }
        nn_file_close(&f);
    }
    const char *path = path_of("half.pth");
    CHECK(!nn_file_write(path, NN_FORM_TORCH_ZIP, entry, 4, NN_BF16, NULL, 0, NULL, &st), "%s", st.message);
    nn_file *f = nn_file_open(path, &st);
    CHECK(f && nn_file_find(f, "rows")->dtype == NN_BF16 && nn_file_find(f, "n")->dtype == NN_I64,
          "types of a converted file");
    nn_file_close(&f);
    value[0] = 1e6f;
    size_t before, after;
    free(slurp(path, &before));
    CHECK(nn_file_write(path, NN_FORM_TORCH_ZIP, entry, 4, NN_F16, NULL, 0, NULL, &st) == TS_NUMERIC &&
              strstr(st.message, "F16"),
          "'%s'", st.message);
    free(slurp(path, &after));
    CHECK(before == after, "the old file is gone");
}

/* A model that went through PyTorch's form knows its architecture. */
TEST(torch_model_round_trip)
{
    ts_status st = {0};
    nn_arch a = nn_arch_default();
    a.g_width = 3, a.g_width_max = 5, a.g_levels = 2, a.g_size = 8, a.h_width = 6, a.h_gru = 2;
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 1);
    CHECK(!nn_model_save(m, m->value, path_of("m.safetensors"), NULL, 0, &st), "%s", st.message);
    nn_file *f = nn_file_open(path_of("m.safetensors"), &st);
    nn_meta meta[NN_ARCH_META];
    int metas = 0;
    for (const char *key; (key = nn_file_meta_key(f, metas)); metas++)
        meta[metas] = (nn_meta){key, nn_file_meta(f, key)};
    CHECK(!nn_file_write(path_of("m.pth"), NN_FORM_TORCH_ZIP, nn_file_tensor(f, 0), nn_file_count(f), NN_DTYPES, meta,
                         metas, NULL, &st),
          "%s", st.message);
    nn_file_close(&f);
    nn_model *back = nn_model_load(path_of("m.pth"), &st);
    CHECK(back, "%s", st.message);
    CHECK(!memcmp(&back->arch, &m->arch, sizeof a) && !memcmp(back->value, m->value, m->count * sizeof(float)),
          "another model");
    int taken, left;
    nn_model_init(back, 2);
    CHECK(!nn_model_init_from(back, path_of("m.pth"), NULL, &taken, &left, &st) && left == 0, "%s", st.message);
    CHECK(!memcmp(back->value, m->value, m->count * sizeof(float)), "other values");
    nn_model_free(&m);
    nn_model_free(&back);
}
