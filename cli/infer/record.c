#include "cli/infer/record.h"
#include "data/json.h"
#include "data/text.h"
#include "infer/output.h"
#include "render/scene.h"
#include "tensor/hash.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RESULT "result: {"

static void put_outputs(FILE *f, unsigned which)
{
    const char *comma = "";
    for (int k = 0; k < LGD_OUTPUTS; k++)
        if (which >> k & 1) fprintf(f, "%s%s", comma, lgd_output_names[k]), comma = ",";
}

char *cl_recipe(const cl_command *c, const char *weights, uint64_t hash, ts_status *st)
{
    uint64_t mask = 0;
    io_text t;
    const char *slash = strrchr(weights, '/');
    if (c->mask && ts_hash_file(c->mask, &mask, st) != TS_OK) return NULL;
    if (io_text_begin(&t, "the record", st) != TS_OK) return NULL;
    FILE *f = t.f;
    fputs("weights: ", f);
    io_put_json(f, slash ? slash + 1 : weights);
    fprintf(f, " %016" PRIx64 "\noptions: lgd-infer " LGD_VERSION " size %d, iterations %d, orientations ", hash,
            c->size, c->iterations);
    if (c->orientations == LGD_ORIENTATIONS_DEFAULT) fputs("auto", f);
    else fprintf(f, "%d", c->orientations);
    fprintf(f, ", tolerance %.9g, fov %.9g, light-power %.9g", c->tolerance, c->fov, c->power);
    fprintf(f, ", %s, %s, normal %s, %s, exr %s%s", c->bf16 ? "bf16" : "f32", c->exact ? "exact" : "Winograd",
            c->directx ? "dx" : "gl", c->metallic ? "metallic" : "specular", c->half ? "half" : "float",
            c->seamless ? ", seamless" : "");
    for (int k = 0; k < 4 && c->corners; k++)
        fprintf(f, "%s %.9g,%.9g", k ? "" : ", corners", c->angle.at[k][0], c->angle.at[k][1]);
    if (c->sample != LGD_SAMPLE_UNKNOWN)
        fprintf(f, ", sample %s", c->sample == LGD_SAMPLE_METAL ? "metal" : "dielectric");
    if (c->mask) fprintf(f, ", mask %016" PRIx64, mask);
    fputs(", maps ", f);
    put_outputs(f, c->outputs);
    fputc('\n', f);
    return io_text_end(&t, "the record", st) == TS_OK ? t.bytes : NULL;
}

/* What makes one way of making the files differ from another. */
static void put_key(FILE *f, bool one_file, const cl_item *item, const char *recipe)
{
    if (one_file) fprintf(f, "photograph: %016" PRIx64 "\n", item->hash); /* no one hash stands for several files */
    fputs(recipe, f);
}

static void put_warnings(FILE *f, const cl_item *item)
{
    const char *comma = "";
    fputs("\"warnings\": [", f);
    for (int i = 0; i < CL_WARNINGS; i++)
        if (item->warnings >> i & 1) {
            fputs(comma, f);
            io_put_json(f, cl_warning_names[i]);
            comma = ", ";
        }
    fputs("]}", f);
}

char *cl_record(const cl_command *c, const cl_item *item, const char *recipe)
{
    io_text t;
    if (io_text_begin(&t, "", NULL) != TS_OK) return NULL;
    FILE *f = t.f;
    const bool one_file = cl_command_one_file(c);
    put_key(f, one_file, item, recipe);
    fputs(RESULT "\"hash\": ", f);
    if (one_file) fprintf(f, "\"%016" PRIx64 "\"", item->hash);
    else fputs("null", f);
    fprintf(f, ", \"steps\": %d, \"rmse_first\": ", item->steps);
    io_put_json_number(f, item->first);
    fputs(", \"rmse\": ", f);
    io_put_json_number(f, item->last);
    fputs(", \"fov\": ", f);
    io_put_json_number(f, rd_fov_of((double)item->photo[0].camera[2]));
    fprintf(f, ", \"fov_is\": \"%s\", \"power\": ", cl_item_fov_is(item));
    io_put_json_number(f, item->power);
    fputs(", ", f);
    put_warnings(f, item);
    fputc('\n', f);
    return io_text_end(&t, "", NULL) == TS_OK ? t.bytes : NULL;
}

char *cl_record_result(const char *text)
{
    const char *at = text ? strstr(text, "\n" RESULT) : NULL;
    if (!at) return NULL;
    at += sizeof RESULT;
    return strndup(at, strcspn(at, "\n"));
}

bool cl_record_is_done(const cl_command *c, const cl_item *item, const char *recipe, char **result)
{
    char *meta = NULL;
    io_text key;
    *result = NULL;
    if (io_text_begin(&key, "", NULL) != TS_OK) return false;
    put_key(key.f, true, item, recipe);
    if (io_text_end(&key, "", NULL) == TS_OK && lgd_output_is(item->job->folder, c->outputs, key.bytes, &meta))
        *result = cl_record_result(meta);
    free(meta);
    free(key.bytes);
    return *result != NULL;
}
