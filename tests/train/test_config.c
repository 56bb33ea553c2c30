/* The INI reader and the table of configuration keys. */
#include "data/ini.h"
#include "tests/support/comma.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include "train/config.h"
#include "train/trainer.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static ts_code parse(const char *text, io_ini *ini, ts_status *st)
{
    memset(st, 0, sizeof *st);
    return io_ini_parse("x.ini", text, strlen(text), ini, st);
}

static void expect_error(const char *text, const char *part)
{
    io_ini ini;
    ts_status st;
    CHECK(parse(text, &ini, &st) == TS_INVALID, "accepted: %s", text);
    CHECK(strstr(st.message, part), "\"%s\" is not in: %s", part, st.message);
    CHECK(!strchr(st.message, '\n'), "more than one line: %s", st.message);
    CHECK(!ini.entry && !ini.text, "the reader left memory behind");
}

TEST(ini_reads_sections_comments_and_blanks)
{
    io_ini ini;
    ts_status st;
    CHECK(parse("# head\n\n[a]\nx = 1 # one\n  y=two words  ; and a comment\nz =\n[b]\nx = c#d\n[a]\nw = last", &ini,
                &st) == TS_OK,
          "%s", st.message);
    CHECK(ini.count == 5, "%d entries", ini.count);
    const char *const want[5][3] = {
        {"a", "x", "1"}, {"a", "y", "two words"}, {"a", "z", ""}, {"b", "x", "c#d"}, {"a", "w", "last"}};
    const int line[5] = {4, 5, 6, 8, 10};
    for (int i = 0; i < 5; i++) {
        const io_ini_entry *e = &ini.entry[i];
        CHECK(!strcmp(e->section, want[i][0]) && !strcmp(e->key, want[i][1]) && !strcmp(e->value, want[i][2]),
              "entry %d is [%s] %s = \"%s\"", i, e->section, e->key, e->value);
        CHECK(e->line == line[i], "entry %d is in line %d, not %d", i, e->line, line[i]);
    }
    io_ini_free(&ini);
}

TEST(ini_accepts_crlf_and_byte_order_mark)
{
    io_ini ini;
    ts_status st;
    CHECK(parse("\xef\xbb\xbf[a]\r\nx = 1\r\n\r\n; c\r\ny = 2\r\n", &ini, &st) == TS_OK, "%s", st.message);
    CHECK(ini.count == 2 && !strcmp(ini.entry[0].value, "1") && !strcmp(ini.entry[1].value, "2"), "wrong entries");
    CHECK(ini.entry[1].line == 5, "line %d", ini.entry[1].line);
    io_ini_free(&ini);
}

TEST(ini_errors_name_file_and_line)
{
    expect_error("[a]\nx = 1\ny = 2\nx = 3\n", "x.ini:4: a.x is given twice (first in line 2)");
    expect_error("[a]\nx = 1\n[b]\n[a]\nx = 1\n", "x.ini:5: a.x is given twice");
    expect_error("x = 1\n", "x.ini:1:");
    expect_error("[a]\nnonsense\n", "x.ini:2: expected key = value");
    expect_error("\n\n[a\n", "x.ini:3: a section");
    expect_error("[a] x\n", "x.ini:1: a section");
    expect_error("[a]\n= 3\n", "x.ini:2:");
    expect_error("[]\n", "x.ini:1:");
    io_ini ini;
    ts_status st = {0};
    CHECK(!parse("[a]\nfile = \"wood #2 ; old.jpg\" # the second\nplain = 5\" ; inches\nempty = \"\"\n", &ini, &st) &&
              !strcmp(ini.entry[0].value, "wood #2 ; old.jpg") && !strcmp(ini.entry[1].value, "5\"") &&
              !*ini.entry[2].value,
          "%s", st.message);
    io_ini_free(&ini);
    CHECK(parse("[a]\nfile = \"wood #2.jpg\n", &ini, &st) == TS_INVALID && strstr(st.message, "x.ini:2: a value"), "%s",
          st.message);
    CHECK(io_ini_parse("x.ini", "[a]\0\n", 5, &ini, &st) == TS_INVALID && strstr(st.message, "zero byte"), "%s",
          st.message);
    CHECK(io_ini_read("/nonexistent/x.ini", &ini, &st) == TS_IO && strstr(st.message, "/nonexistent/x.ini"), "%s",
          st.message);
}

TEST(config_defaults_are_the_tables_and_the_architectures)
{
    const tr_config c = tr_config_default();
    const nn_arch a = nn_arch_default();
    CHECK(c.arch.g_width == a.g_width && c.arch.channels == a.channels && c.arch.iterations == a.iterations,
          "another architecture than nn's default");
    ts_status st = {0};
    CHECK(tr_config_check(&c, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < tr_key_count; i++) {
        char text[4096];
        const tr_key *k = &tr_keys[i];
        tr_config_format(&c, k, text, sizeof text);
        CHECK(!k->initial || !strcmp(text, k->initial), "%s.%s: default \"%s\" comes back as \"%s\"", k->section,
              k->key, k->initial, text);
        CHECK(k->help && *k->help, "%s.%s has no help", k->section, k->key);
        for (int j = 0; j < i; j++)
            CHECK(strcmp(k->section, tr_keys[j].section) || strcmp(k->key, tr_keys[j].key), "%s.%s is there twice",
                  k->section, k->key);
    }
}

/* Every key changes exactly its own value: a wrong offset in the table would change another's too, or none. */
TEST(config_each_key_sets_its_own_value)
{
    const tr_config start = tr_config_default();
    for (int i = 0; i < tr_key_count; i++) {
        const tr_key *k = &tr_keys[i];
        char before[4096], after[4096], value[4096];
        tr_config_format(&start, k, before, sizeof before);
        switch (k->type) {
        case TR_BOOL: strcpy(value, strcmp(before, "yes") ? "yes" : "no"); break;
        case TR_CHOICE: strcpy(value, strcmp(before, k->choice[0]) ? k->choice[0] : k->choice[1]); break;
        case TR_TEXT: strcpy(value, "some/where else"); break;
        case TR_FAMILIES: strcpy(value, io_family_name(0)); break;
        case TR_REAL: strcpy(value, k->hi < 0.125 ? "0.0625" : "0.125"); break;
        default: snprintf(value, sizeof value, "%.0f", strtod(before, NULL) == k->hi ? k->lo : k->hi); break;
        }
        tr_config c = start;
        ts_status st = {0};
        CHECK(tr_config_set(&c, "t", k->section, k->key, value, &st) == TS_OK, "%s", st.message);
        for (int j = 0; j < tr_key_count; j++) {
            tr_config_format(&start, &tr_keys[j], before, sizeof before);
            tr_config_format(&c, &tr_keys[j], after, sizeof after);
            CHECK(j == i ? !strcmp(after, value) : !strcmp(after, before), "setting %s.%s to %s made %s.%s \"%s\"",
                  k->section, k->key, value, tr_keys[j].section, tr_keys[j].key, after);
        }
        const ts_code same = tr_config_same(&start, &c, "o", &st);
        CHECK(same == (k->neutral ? TS_OK : TS_INVALID), "%s.%s: a change is%s seen", k->section, k->key,
              same ? "" : " not");
        CHECK(k->neutral || strstr(st.message, k->key), "the message does not name %s: %s", k->key, st.message);
    }
}

TEST(config_rejects_bad_values)
{
    static const char *const bad[][3] = {{"train", "batch", "0"},
                                         {"train", "batch", "8.5"},
                                         {"train", "batch", "8x"},
                                         {"train", "batch", ""},
                                         {"train", "batch", "99999999999999999999"},
                                         {"train", "rate", "fast"},
                                         {"train", "rate", "nan"},
                                         {"train", "rate", "-1"},
                                         {"train", "rate", "0,001"},
                                         {"train", "ema", "1"},
                                         {"train", "rate", "inf"},
                                         {"data", "quantise", "maybe"},
                                         {"model", "rmse", "mean"},
                                         {"model", "g_levels", "9"},
                                         {"data", "families", ""},
                                         {"data", "families", "all, -all"},
                                         {"data", "families", "granit"},
                                         {"output", "folder", "a # \"b\""},
                                         {"output", "folder", "\"b"},
                                         {"output", "folder", "a\nb"},
                                         {"train", "steps", "1e3"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        tr_config c = tr_config_default();
        ts_status st = {0};
        CHECK(tr_config_set(&c, "c.ini:7", bad[i][0], bad[i][1], bad[i][2], &st) == TS_INVALID,
              "%s.%s = %s was accepted", bad[i][0], bad[i][1], bad[i][2]);
        CHECK(!strncmp(st.message, "c.ini:7: ", 9) && strstr(st.message, bad[i][1]),
              "the message names neither place nor key: %s", st.message);
        CHECK(tr_config_same(&c, &(tr_config){0}, "x", NULL) != TS_OK, "nothing is compared");
    }
}

/* Names of files with comments' signs and blanks at their ends. */
TEST(config_text_that_needs_quotation_marks_comes_back)
{
    static const char *const names[] = {"a # b", " a", "a ", "#a", "a\t; b", "a#b", "say \"a\""};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        tr_config c = tr_config_default(), back = tr_config_default();
        ts_status st = {0};
        io_ini ini;
        CHECK(!tr_config_set(&c, "x", "output", "folder", names[i], &st), "%s", st.message);
        char *text = NULL;
        size_t size = 0;
        FILE *f = open_memstream(&text, &size);
        tr_config_print(&c, true, f);
        fclose(f);
        CHECK(!io_ini_parse("x.ini", text, size, &ini, &st), "%s", st.message);
        for (int k = 0; k < ini.count; k++)
            CHECK(!tr_config_set(&back, "x", ini.entry[k].section, ini.entry[k].key, ini.entry[k].value, &st), "%s",
                  st.message);
        CHECK(!strcmp(back.output.folder, names[i]), "'%s' comes back as '%s'", names[i], back.output.folder);
        io_ini_free(&ini);
        free(text);
    }
}

TEST(config_unknown_keys_are_answered_with_the_nearest)
{
    static const char *const asked[][3] = {
        {"train", "bach", "train.batch"},      {"train", "checkpoint_evry", "train.checkpoint_every"},
        {"trian", "batch", "train.batch"},     {"data", "pretrain_steps", "train.pretrain_steps"},
        {"model", "g_withd", "model.g_width"}, {"valid", "count", "validate.count"}};
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
        tr_config c = tr_config_default();
        ts_status st = {0};
        CHECK(tr_config_set(&c, "c.ini:3", asked[i][0], asked[i][1], "1", &st) == TS_INVALID, "%s.%s is a key",
              asked[i][0], asked[i][1]);
        CHECK(strstr(st.message, "c.ini:3: ") && strstr(st.message, asked[i][2]), "%s is not suggested: %s",
              asked[i][2], st.message);
    }
}

TEST(config_families_are_listed_and_removed)
{
    tr_config c = tr_config_default();
    ts_status st = {0};
    char text[256];
    const int last = io_family_count() - 1;
    snprintf(text, sizeof text, "%s, %s", io_family_name(0), io_family_name(last));
    CHECK(tr_config_set(&c, "t", "data", "families", text, &st) == TS_OK, "%s", st.message);
    CHECK(c.data.families == (1u | UINT64_C(1) << last), "mask %llx", (unsigned long long)c.data.families);
    snprintf(text, sizeof text, "all -%s", io_family_name(0));
    CHECK(tr_config_set(&c, "t", "data", "families", text, &st) == TS_OK, "%s", st.message);
    CHECK(c.data.families == ((UINT64_C(1) << (last + 1)) - 2), "mask %llx", (unsigned long long)c.data.families);
    CHECK(tr_config_set(&c, "t", "data", "families", "all", &st) == TS_OK && c.data.families == 0, "all is not 0");
    CHECK(tr_config_set(&c, "t", "data", "families", "classic", &st) == TS_OK && c.data.families == (1u << 17) - 1,
          "classic is not the first seventeen");
    CHECK(tr_config_set(&c, "t", "data", "families", "all, -classic", &st) == TS_OK &&
              c.data.families == ((UINT64_C(1) << (last + 1)) - (1u << 17)),
          "mask %llx", (unsigned long long)c.data.families);
}

TEST(config_assignments)
{
    tr_config c = tr_config_default();
    ts_status st = {0};
    CHECK(tr_config_set_assignment(&c, "train.rate=2.5e-4", &st) == TS_OK && c.train.rate == 2.5e-4, "%s", st.message);
    CHECK(tr_config_set_assignment(&c, "output.folder=/tmp/a=b.c", &st) == TS_OK &&
              !strcmp(c.output.folder, "/tmp/a=b.c"),
          "%s", st.message);
    CHECK(tr_config_set_assignment(&c, "output.folder=", &st) == TS_OK && !*c.output.folder, "%s", st.message);
    static const char *const bad[] = {"train.rate", "rate=1", "=1", ".=", "train.=1", "train.rate=", "a=b.c"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(tr_config_set_assignment(&c, bad[i], NULL) == TS_INVALID, "%s was accepted", bad[i]);
}

/* A printed configuration reads back to the same values, whatever they are. */
TEST(config_print_and_read_agree)
{
    tr_config c = tr_config_default(), back = tr_config_default();
    ts_status st = {0};
    c.train.rate = 1.0 / 3;
    c.train.ema = 0;
    c.data.noise = 1e-7;
    c.data.families = 5;
    c.data.seed = 123456789012345;
    c.arch.rmse = NN_RMSE_BATCH;
    c.arch.gradient = false;
    strcpy(c.output.folder, "runs/with blank");
    char path[600];
    snprintf(path, sizeof path, "%s/printed.ini", test_folder());
    FILE *f = fopen(path, "w");
    tr_config_print(&c, true, f);
    fclose(f);
    CHECK(tr_config_read(&back, path, &st) == TS_OK, "%s", st.message);
    CHECK(tr_config_same(&c, &back, path, &st) == TS_OK, "%s", st.message);
    CHECK(!strcmp(back.output.folder, c.output.folder) && back.train.rate == c.train.rate, "a value changed");
}

TEST(config_file_errors_have_the_line)
{
    tr_config c = tr_config_default();
    ts_status st = {0};
    static const char text[] = "\xef\xbb\xbf[train]\r\nbatch = 4\r\nrate = 1e-3\r\nwarmpu = 3\r\n";
    const char *path = path_of("bad.ini");
    spill(path, text, sizeof text - 1);
    char want[700];
    CHECK(tr_config_read(&c, path, &st) == TS_INVALID, "accepted");
    snprintf(want, sizeof want, "%s:4: ", path);
    CHECK(!strncmp(st.message, want, strlen(want)) && strstr(st.message, "train.warmup"), "%s", st.message);
    CHECK(c.train.batch == 4, "what came before the error was not read");
}

TEST(config_numbers_do_not_depend_on_the_locale)
{
    comma_locale();
    tr_config c = tr_config_default();
    ts_status st = {0};
    char text[64];
    CHECK(tr_config_set(&c, "t", "train", "rate", "0.25", &st) == TS_OK && c.train.rate == 0.25, "%s", st.message);
    CHECK(tr_config_set(&c, "t", "train", "rate", "0,25", &st) == TS_INVALID, "a decimal comma was accepted");
    for (int i = 0; i < tr_key_count; i++)
        if (!strcmp(tr_keys[i].key, "rate")) {
            tr_config_format(&c, &tr_keys[i], text, sizeof text);
            CHECK(!strcmp(text, "0.25"), "printed as %s", text);
        }
}

TEST(config_checks_keys_against_each_other)
{
    static const char *const bad[][2] = {{"train.iterations_min=7", "iterations_min"},
                                         {"train.steps=0", "nothing to do"},
                                         {"validate.seed=1", "data.seed"},
                                         {"data.fov_min=30", "fov_max"},
                                         {"data.fov_max=30", "fov_min"},
                                         {"data.collected=0.5", "data.collection"},
                                         {"data.collection=sets", "data.collected"},
                                         {"data.told_view=0.5", "told_view is 0.5 and data.told_power 1"},
                                         {"data.told_power=0", "told_power 0"},
                                         {"model.g_size=50", "g_size"},
                                         {"model.g_kernel=4", "g_kernel"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        tr_config c = tr_config_default();
        ts_status st = {0};
        c.arch.conditions = true;
        CHECK(tr_config_set_assignment(&c, bad[i][0], &st) == TS_OK, "%s", st.message);
        CHECK(tr_config_check(&c, &st) == TS_INVALID && strstr(st.message, bad[i][1]), "%s: %s", bad[i][0], st.message);
    }
}

TEST(config_default_folder_stays_in_runs)
{
    static const char *const cases[][2] = {{"configs/single.ini", "runs/single"},
                                           {"tiny", "runs/tiny"},
                                           {"a/b.c.ini", "runs/b.c"},
                                           {"../...ini", "runs/run"},
                                           {".ini", "runs/run"},
                                           {"x/..", "runs/run"},
                                           {"./..ini", "runs/run"},
                                           {"/a/my run.ini", "runs/my run"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char folder[256];
        tr_default_folder(cases[i][0], folder, sizeof folder);
        CHECK(!strcmp(folder, cases[i][1]), "%s gives %s, not %s", cases[i][0], folder, cases[i][1]);
    }
}

/* No key of the network is said to go further than the network does. */
TEST(config_ranges_are_within_the_architectures)
{
    for (int i = 0; i < tr_key_count; i++) {
        const tr_key *k = &tr_keys[i];
        if (strcmp(k->section, "model") != 0 || k->type != TR_INT) continue;
        for (int high = 0; high < 2; high++) {
            tr_config c = tr_config_default();
            ts_status st = {0};
            int lo, hi;
            const char *at;
            *(int *)((char *)&c + k->offset) = (int)(high ? k->hi : k->lo);
            if (nn_arch_check(&c.arch, &st) == TS_OK || !(at = strstr(st.message, ": it must be "))) continue;
            CHECK(sscanf(at, ": it must be %d to %d", &lo, &hi) != 2, "model.%s goes from %g to %g, but %s", k->key,
                  k->lo, k->hi, st.message);
        }
    }
}
