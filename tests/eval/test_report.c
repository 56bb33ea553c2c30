/* The report's files: what they say and that they are what they claim to be. */
#include "cli/plot.h"
#include "data/html.h"
#include "data/json.h"
#include "eval/html.h"
#include "eval/text.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static char *written(void (*write_to)(const ev_report *, FILE *), const ev_report *r)
{
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    CHECK(f, "open_memstream");
    write_to(r, f);
    CHECK(fclose(f) == 0 && strlen(text) == size, "a zero byte in the text");
    return text;
}

static char *printed(const ev_report *r)
{
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    CHECK(f, "open_memstream");
    ev_report_print(r, f);
    fclose(f);
    return text;
}

static int count(const char *text, const char *what)
{
    int n = 0;
    for (const char *p = text; (p = strstr(p, what)); p += strlen(what)) n++;
    return n;
}

/* Two sets, three materials, hostile names, and numbers that were not measured. One method with two steps, or two
 * methods with one each. */
static void make(ev_report *r, int methods)
{
    static const char *const sets[] = {"maps:<a> & \"b\"", "procedural:1,1"},
                             *const materials[] = {"</article><script>x</script>", "back\\slash\"quote", "tab\there"};
    static const char png[] = "any bytes"; /* the page does not look into them */
    static ev_subject method[2];
    static int step[2];
    ts_status st = {0};
    step[0] = 0, step[1] = methods == 1;
    method[0] = (ev_subject){.label = "lgd<1>", .points = 3 - methods, .bytes = 2000000};
    method[1] = (ev_subject){.label = "descent:steps=2", .first = 1, .points = 1};
    *r = (ev_report){.sets = 2,
                     .size = 8,
                     .threads = 1,
                     .repeat = 1,
                     .set_name = sets,
                     .model = "m<1>.safetensors",
                     .isa = "base",
                     .method = method,
                     .methods = methods,
                     .step = step,
                     .columns = 2};
    for (int i = 0; i < 3; i++) {
        CHECK(ev_report_add(r, i / 2, materials[i], &st) == i, "%s", st.message);
        ev_result *to = &r->result[i];
        for (int k = 0; k < EV_METRICS; k++) {
            to->row[0].value[k] = k == EV_EXPOSURE || (k == EV_SSIM && i == 0) ? NAN : 0.25 * (i + 1);
            to->row[1].value[k] = to->row[0].value[k] / 2;
        }
        to->seconds[0] = 0.5;
        to->seconds[1] = 1.5;
        to->peak[0] = 5e11;
        if (i != 1) continue;
        to->png[0] = (unsigned char *)strdup(png);
        to->png_size[0] = strlen(png);
        to->sheet = (ev_sheet_shape){EV_SHEET_MAPS, 8, 3, 1};
    }
}

TEST(report_html)
{
    ev_report r;
    make(&r, 1);
    char *text = written(ev_html_write, &r);
    CHECK(count(text, "<article ") == 3 && count(text, "</article>") == 3, "%d materials", count(text, "<article "));
    CHECK(count(text, "<script>") == 1 && strstr(text, "&lt;script&gt;x"), "a name is markup");
    CHECK(strstr(text, "maps:&lt;a&gt; &amp; &quot;b&quot;") && strstr(text, "m&lt;1&gt;"), "names are not escaped");
    CHECK(strstr(text, "data:image/png;base64,YW55IGJ5dGVz\""), "the picture is not there");
    CHECK(count(text, "http://") == 1 && count(text, "https://") == 0, "something is loaded"); /* SVG's namespace */
    CHECK(!strstr(text, "nan") && !strstr(text, "inf"), "a number is none");
    CHECK(!strstr(text, "{{") && count(text, "<span>") == 8 + 3 && strstr(text, "<span>rendering 3</span></div>"),
          "the names of the picture's columns and rows");
    CHECK(count(text, "data-ssim=\"\"") == 1 && count(text, "data-exposure=\"\"") == 3 &&
              strstr(text, "data-render=\"0.250000\""),
          "the sort keys");
    CHECK(count(text, "<circle") == 2 * 2 + 2, "%d points in the plot", count(text, "<circle"));
    free(text);
    ev_report_free(&r);
}

/* A reader of JSON that knows no more than the grammar (RFC 8259). */
static const char *value(const char *p);
static const char *blank(const char *p) { return p + strspn(p, " \n\t\r"); }
static const char *string(const char *p)
{
    CHECK(*p == '"', "no string: %.20s", p);
    for (p++; *p != '"'; p++) {
        CHECK((unsigned char)*p >= 0x20, "a control character in a string");
        if (*p == '\\') p++;
    }
    return p + 1;
}
static const char *list(const char *p, char end)
{
    for (p = blank(p + 1); *p != end; p = blank(p)) {
        if (end == '}') {
            p = blank(string(p));
            CHECK(*p == ':', "no colon: %.20s", p);
            p++;
        }
        p = blank(value(blank(p)));
        CHECK(*p == ',' || *p == end, "neither a comma nor an end: %.20s", p);
        if (*p == ',') {
            p = blank(p + 1);
            CHECK(*p != end, "a comma before the end");
        }
    }
    return p + 1;
}
static const char *value(const char *p)
{
    char *end;
    if (*p == '{') return list(p, '}');
    if (*p == '[') return list(p, ']');
    if (*p == '"') return string(p);
    if (!strncmp(p, "null", 4) || !strncmp(p, "true", 4)) return p + 4;
    if (!strncmp(p, "false", 5)) return p + 5;
    CHECK(*p == '-' || (*p >= '0' && *p <= '9'), "no value: %.20s", p);
    strtod(p, &end);
    return end;
}

TEST(report_json)
{
    ev_report r;
    make(&r, 1);
    char *text = written(ev_json_write, &r);
    CHECK(*blank(value(blank(text))) == 0, "something after the end");
    CHECK(count(text, "\"name\"") == 5 && count(text, "\"seconds\": 1.5") == 5, "%d names", count(text, "\"name\""));
    CHECK(strstr(text, "{\"label\": \"lgd<1>\", \"bytes\": 2000000, \"peak_flops\": 5e+11}"), "the method");
    CHECK(count(text, "\"ssim\": null") == 2 && strstr(text, "\"ssim\": 0.25"), "what was not measured");
    CHECK(strstr(text, "back\\\\slash\\\"quote") && strstr(text, "tab\\u0009here"), "names are not escaped");
    free(text);
    ev_report_free(&r);
}

TEST(report_of_several_methods)
{
    ev_report r;
    make(&r, 2);
    char *text = written(ev_html_write, &r), *json = written(ev_json_write, &r), *table = printed(&r);
    static const char columns[] = "<th scope=\"col\">lgd&lt;1&gt;</th><th scope=\"col\">descent:steps=2</th>";
    CHECK(count(text, columns) == 3, "a column for each method");
    CHECK(count(text, "<option ") == 2 && count(text, "data-render-1=\"0.125000\"") == 1 &&
              count(text, "data-render=\"0.250000\"") == 1,
          "the sort keys");
    CHECK(count(text, "<circle") == 2 + 2, "%d points in the plot", count(text, "<circle"));
    CHECK(!strstr(text, "nan") && !strstr(text, "inf") && *blank(value(blank(json))) == 0, "a number is none");
    CHECK(count(table, "\nlgd<1>  ") == 3 && count(table, "\ndescent:steps=2  ") == 3 && count(table, "-50.0%") == 3,
          "%s", table);
    free(text);
    free(json);
    free(table);
    ev_report_free(&r);
}

/* A line that is not of all materials says of how many it is, and is not compared with one that is of others. */
TEST(report_says_of_how_many_materials_a_line_is)
{
    ev_report r;
    ts_status st = {0};
    ev_row mean, deviation;
    make(&r, 2);
    char *table = printed(&r);
    CHECK(!strstr(table, "  materials"), "all lines are of all materials: %s", table);
    free(table);
    for (int i = 1; i < 3; i++) { /* the second method estimates one of the first set's two, and not the second set's */
        r.result[i].seconds[1] = NAN;
        for (int k = 0; k < EV_METRICS; k++) r.result[i].row[1].value[k] = NAN;
    }
    CHECK(ev_report_materials(&r, 0) == 2 && ev_report_materials(&r, -1) == 3, "materials");
    CHECK(ev_report_summary(&r, 0, 1, &mean, &deviation) == 1 && ev_report_summary(&r, 1, 1, &mean, &deviation) == 0 &&
              ev_report_summary(&r, -1, 0, &mean, &deviation) == 3,
          "materials of a column");
    table = printed(&r);
    char *html = written(ev_html_write, &r), *json = written(ev_json_write, &r);
    CHECK(strstr(table, ": 2 materials") && strstr(table, "all sets: 3 materials") &&
              count(table, "  materials  diffuse") == 3 && count(table, "\ndescent:steps=2          1  ") == 2 &&
              count(table, "\ndescent:steps=2          0  -  ") == 1 &&
              count(table, "\nlgd<1>                   3  ") == 1,
          "%s", table);
    CHECK(!strstr(table, "nan") && !strstr(table, "-50.0%") && count(table, "+0.0%") == 3, "unlike means: %s", table);
    CHECK(strstr(html, "descent:steps=2 <small>1 of 2</small>") &&
              strstr(html, "descent:steps=2 <small>0 of 1</small>") &&
              strstr(html, "descent:steps=2 <small>1 of 3</small>") && !strstr(html, "lgd&lt;1&gt; <small>"),
          "the page does not say it");
    CHECK(count(json, "\"materials\": 1, ") == 2 && count(json, "\"materials\": 0, ") == 1, "results.json: %s", json);
    CHECK(ev_report_write(&r, test_folder(), &st) == TS_OK, "%s", st.message);
    char path[400], summary[8192] = "";
    snprintf(path, sizeof path, "%s/summary.csv", test_folder());
    FILE *f = fopen(path, "r");
    CHECK(f && fread(summary, 1, sizeof summary - 1, f) > 0, "%s", path);
    fclose(f);
    CHECK(strstr(summary, "\",2,lgd<1>,0,") && strstr(summary, "\",1,descent:steps=2,0,") &&
              strstr(summary, "\",0,descent:steps=2,0,,") && strstr(summary, "\nall,3,lgd<1>,0,") &&
              strstr(summary, "\nall,1,descent:steps=2,0,"),
          "%s", summary);
    free(table);
    free(html);
    free(json);
    ev_report_free(&r);
}

TEST(report_has_no_quotient_of_nothing)
{
    for (int nothing = 0; nothing < 2; nothing++) { /* a flat map of eight bits, and no relief at all */
        ev_report r;
        make(&r, 1);
        for (int i = 0; i < 3; i++)
            for (int c = 0; c < 2; c++) {
                r.result[i].row[c].value[EV_FLAT] = nothing ? 0 : 0.004;
                r.result[i].row[c].value[EV_OVER_FLAT] = i == 2 ? 0.5 : NAN;
                if (i == 2) r.result[i].row[c].value[EV_FLAT] = 0.25;
            }
        ev_row mean, deviation;
        ev_report_summary(&r, 0, 0, &mean, &deviation);
        CHECK(isnan(mean.value[EV_OVER_FLAT]) && isnan(deviation.value[EV_OVER_FLAT]), "%g over nothing",
              mean.value[EV_OVER_FLAT]);
        ev_report_summary(&r, 1, 0, &mean, &deviation);
        CHECK(fabs(mean.value[EV_OVER_FLAT] - 3) < 1e-12, "%g of one with relief", mean.value[EV_OVER_FLAT]);
        char *table = printed(&r), *html = written(ev_html_write, &r);
        CHECK(!strstr(table, "nan") && !strstr(table, "inf"), "%s", table);
        CHECK(count(table, "over_flat") == 2, "a column of the set that has it, and of all: %s", table);
        CHECK(!strstr(html, "nan") && !strstr(html, "inf"), "the page has a number that is none");
        free(table);
        free(html);
        ev_report_free(&r);
    }
}

/* The heading says what renderings are compared with. */
TEST(report_says_what_is_compared)
{
    static const char *const one = "each picture of a capture but the input, the nearest to the sample's axis;",
                             *const two = "each picture of a capture but the 2 of the input: the nearest to the "
                                          "sample's axis and the first others;";
    for (int inputs = 1; inputs <= 2; inputs++) {
        ev_report r;
        make(&r, 1);
        for (int i = 0; i < 3; i++) r.result[i].sheet = (ev_sheet_shape){EV_SHEET_ALONE, 6, 1, 1};
        char *table = printed(&r);
        CHECK(!strstr(table, "each"), "photographs alone: %s", table);
        free(table);
        r.result[0].sheet = r.result[1].sheet = (ev_sheet_shape){EV_SHEET_CAPTURE, 8, 3, inputs};
        r.result[2].sheet = (ev_sheet_shape){EV_SHEET_MAPS, 8, 3, 1};
        table = printed(&r);
        CHECK(count(table, inputs == 1 ? one : two) == 2 && count(table, ", 20 renderings each;") == 1 &&
                  count(table, ", 20 renderings each of known maps, each picture") == 1,
              "%s", table);
        free(table);
        ev_report_free(&r);
    }
}

TEST(report_plot)
{
    const cl_point some[] = {
        {0.1, 0.2, 0, "a"}, {1, 0.1, 0, ""}, {0, 0.1, 0, "zero"}, {1, NAN, 0, "none"}, {INFINITY, 1, 0, ""}};
    const cl_series series[] = {{"s", some, 5, false}, {"one", some, 1, false}, {"none", some + 3, 1, false}};
    for (int n = 0; n <= 3; n++) {
        char *text = NULL;
        size_t size;
        FILE *f = open_memstream(&text, &size);
        CHECK(f, "open_memstream");
        cl_plot_write(f, &(cl_axes){"x <", "y", true}, n == 3 ? series + 1 : series, n == 3 ? 1 : n);
        fclose(f);
        CHECK(!strstr(text, "nan") && !strstr(text, "inf") && !strstr(text, "zero"), "%s", text);
        CHECK(strstr(text, "nothing was measured") ? n == 0
                                                   : count(text, "<circle") ==
                      (n == 3       ? 2
                           : n == 2 ? 5
                                    : 3),
              "%d series: %d circles", n, count(text, "<circle"));
        free(text);
    }
}

TEST(report_plot_has_a_linear_axis_too)
{
    const cl_point some[] = {{-1, 0.2, 0, ""}, {0, 0.1, 0, "zero"}, {24, 0.3, 0, ""}};
    const cl_series series[] = {{"s", some, 3, false}, {"level", some, 1, true}};
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    CHECK(f, "open_memstream");
    cl_plot_write(f, &(cl_axes){"T", "y", false}, series, 2);
    fclose(f);
    CHECK(strstr(text, " 70,195.0 550,195.0"), "a level goes from side to side: %s", text);
    CHECK(count(text, "<circle") == 6 && strstr(text, "zero") && strstr(text, ">10</text>") &&
              strstr(text, ">20</text>"),
          "%s", text);
    free(text);
}

TEST(report_plot_labels_keep_apart)
{
    const cl_point near[] = {{0.2, 0.2, 0, "label 0"},  {0.2, 0.2, 0, "label 1"}, {0.2, 0.2, 0, "label 2"},
                             {0.21, 0.2, 0, "label 3"}, {0.2, 0.2, 0, "label 4"}, {0.9, 0.9, 0, ""},
                             {-0.9, 0, 0, ""}};
    const cl_series series[] = {{"s", near, 7, false}};
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    CHECK(f, "open_memstream");
    cl_plot_write(f, &(cl_axes){"x", "y", false}, series, 1);
    fclose(f);
    double x[6], y[6];
    int labels = 0;
    for (const char *p = text; (p = strstr(p, "font-size=\"10\">label")); p++) {
        const char *begin = p;
        while (strncmp(begin, "<text", 5)) begin--;
        CHECK(sscanf(begin, "<text x=\"%lf\" y=\"%lf\"", &x[labels], &y[labels]) == 2, "%.60s", begin);
        for (int i = 0; i < labels; i++)
            CHECK(fabs(x[i] - x[labels]) >= 42 || fabs(y[i] - y[labels]) >= 11, "labels %d and %d are on one another",
                  i, labels);
        labels++;
    }
    CHECK(strstr(text, ">0</text>") && !strstr(text, ">-0<"), "an axis from below 0 has a zero, without a sign");
    CHECK(labels == 4, "%d of 5 labels, for which there are four places", labels);
    free(text);
}

static void put_json(const char *text, FILE *f) { io_put_json(f, text); }
static void put_csv(const char *text, FILE *f) { ev_csv_field(f, text); }
static void put_html(const char *text, FILE *f) { io_put_text(f, text); }

/* File names are bytes: what is no UTF-8 is written as hexadecimal digits, the rest as it is. */
TEST(report_names_are_utf8)
{
    static const struct {
        const char *name, *json, *csv, *html;
    } cases[] = {{"caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80", "\"caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80\"",
                  "caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80", "caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80"},
                 {"caf\xe9", "\"caf\\\\xE9\"", "caf\\xE9", "caf\\xE9"},
                 {"a\xe2\x82", "\"a\\\\xE2\\\\x82\"", "a\\xE2\\x82", "a\\xE2\\x82"}, /* cut off */
                 {"\xc0\xaf", "\"\\\\xC0\\\\xAF\"", "\\xC0\\xAF", "\\xC0\\xAF"},     /* overlong */
                 {"\xed\xa0\x80", "\"\\\\xED\\\\xA0\\\\x80\"", "\\xED\\xA0\\x80", "\\xED\\xA0\\x80"},
                 {"\xff,\"<", "\"\\\\xFF,\\\"<\"", "\"\\xFF,\"\"<\"", "\\xFF,&quot;&lt;"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        void (*const put[])(const char *, FILE *) = {put_json, put_csv, put_html};
        const char *const want[] = {cases[i].json, cases[i].csv, cases[i].html};
        for (int k = 0; k < 3; k++) {
            char *text = NULL;
            size_t size;
            FILE *f = open_memstream(&text, &size);
            CHECK(f, "open_memstream");
            put[k](cases[i].name, f);
            CHECK(fclose(f) == 0 && strcmp(text, want[k]) == 0, "name %zu, writer %d: %s, not %s", i, k, text, want[k]);
            free(text);
        }
    }
}
