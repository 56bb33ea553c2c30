/* The architecture as metadata of a weights file. */
#include "nn/arch_fields.h"
#include "nn/weights/published.h"
#include "nn/weights/weights.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(NN_ARCH_FIELDS + 1 <= NN_ARCH_META, "there is metadata for every field and the format");
static const char prefix[] = "arch.";

static const char *value_text(const nn_arch *a, const nn_arch_field *f, char *text, size_t size)
{
    int v = nn_arch_get(a, f);
    if (f->kind == FIELD_BOOL) snprintf(text, size, "%s", v ? "true" : "false");
    else if (f->kind == FIELD_WORD) snprintf(text, size, "%s", f->words[v]);
    else snprintf(text, size, "%d", v);
    return text;
}

int nn_arch_to_meta(const nn_arch *arch, nn_meta *meta, int capacity, char *text, size_t text_size)
{
    size_t used = 0;
    int n = 0;
    if (capacity < 1) return -1;
    meta[n++] = (nn_meta){"format", "lgd"};
    for (int i = 0; i < NN_ARCH_FIELDS; i++) {
        if (nn_arch_fields[i].late && nn_arch_get(arch, &nn_arch_fields[i]) == nn_arch_fields[i].start) continue;
        char value[16], both[64];
        value_text(arch, &nn_arch_fields[i], value, sizeof value);
        int key = snprintf(both, sizeof both, "%s%s", prefix, nn_arch_fields[i].key) + 1;
        int all = key + snprintf(both + key, sizeof both - (size_t)key, "%s", value) + 1;
        if (n == capacity || used + (size_t)all > text_size) return -1;
        memcpy(text + used, both, (size_t)all);
        meta[n++] = (nn_meta){text + used, text + used + key};
        used += (size_t)all;
    }
    return n;
}

static bool parse(const nn_arch_field *f, const char *text, int *v)
{
    if (f->kind == FIELD_BOOL) {
        *v = !strcmp(text, "true");
        return *v || !strcmp(text, "false");
    }
    if (f->kind == FIELD_WORD) {
        for (*v = f->lo; *v <= f->hi; ++*v)
            if (!strcmp(text, f->words[*v])) return true;
        return false;
    }
    size_t n = strlen(text);
    if (n < 1 || n > 9 || strspn(text, "0123456789") != n) return false; /* nine digits fit an int */
    *v = atoi(text);
    return true;
}

ts_code nn_arch_from_file(const nn_file *file, nn_arch *arch, ts_status *st)
{
    const char *format = nn_file_meta(file, "format"), *key;
    memset(arch, 0, sizeof *arch);
    if (format && strcmp(format, NN_CODER_FORMAT) == 0)
        return ts_fail(st, TS_UNSUPPORTED, "%s: is an auto-encoder of maps, not a network that reads a photograph",
                       nn_file_path(file));
    if (!format || strcmp(format, "lgd") != 0) {
        if (nn_published_file(file)) return nn_published_arch(file, arch, st);
        return ts_fail(st, TS_FORMAT,
                       "%s: metadata key \"format\" is %.40s, not \"lgd\", and the tensors are not the published "
                       "network's: these are not weights of this program",
                       nn_file_path(file), format ? format : "missing");
    }
    for (int i = 0; (key = nn_file_meta_key(file, i)) != NULL; i++) {
        bool known = strncmp(key, prefix, sizeof prefix - 1) != 0;
        for (int j = 0; j < NN_ARCH_FIELDS && !known; j++)
            known = !strcmp(key + sizeof prefix - 1, nn_arch_fields[j].key);
        if (!known)
            return ts_fail(st, TS_UNSUPPORTED,
                           "%s: metadata key \"%.80s\" is not known: the file needs another version of this program",
                           nn_file_path(file), key);
    }
    for (int i = 0; i < NN_ARCH_FIELDS; i++) {
        char name[64];
        int v;
        snprintf(name, sizeof name, "%s%s", prefix, nn_arch_fields[i].key);
        const char *text = nn_file_meta(file, name);
        if (!text && nn_arch_fields[i].late) {
            nn_arch_set(arch, &nn_arch_fields[i], nn_arch_fields[i].start);
            continue;
        }
        if (!text) return ts_fail(st, TS_FORMAT, "%s: metadata key \"%s\" is missing", nn_file_path(file), name);
        if (!parse(&nn_arch_fields[i], text, &v))
            return ts_fail(st, TS_FORMAT, "%s: metadata key \"%s\" is \"%.40s\": not a value of it", nn_file_path(file),
                           name, text);
        nn_arch_set(arch, &nn_arch_fields[i], v);
    }
    const ts_code code = nn_arch_check(arch, st);
    if (code) ts_context(st, "%s: architecture", nn_file_path(file));
    return code;
}
