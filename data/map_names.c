/* What is in a map folder: files are recognised by their names, conventions by meta.txt.
 *
 * meta.txt holds lines "key: text" (or "key = text"); '#' begins a comment, unknown keys are ignored:
 *   workflow: metallic | specular ...        needed when both a metallic and a specular map exist
 *   basecolor, diffuse, specular: sRGB | linear ...
 *   normal: ... OpenGL ... | ... DirectX ...  (y up or y down)
 *   file.MAP: NAME                           when its name does not say so, or several do; MAP as in io_map_kind_name
 */
#include "data/file.h"
#include "data/image/oiio.h"
#include "data/map_folder.h"
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

const char *const io_map_kind_name[IO_MAP_KINDS] = {"basecolor", "diffuse",  "normal",  "roughness",
                                                    "gloss",     "metallic", "specular"};

static const struct {
    const char *word;
    int kind;
} words[] = {
    {"basecolor", IO_BASECOLOR},   {"basecolour", IO_BASECOLOR},   {"albedo", IO_BASECOLOR},
    {"color", IO_BASECOLOR},       {"colour", IO_BASECOLOR},       {"col", IO_BASECOLOR},
    {"diffuse", IO_DIFFUSE_MAP},   {"diff", IO_DIFFUSE_MAP},       {"normal", IO_NORMAL_MAP},
    {"normals", IO_NORMAL_MAP},    {"normalgl", IO_NORMAL_MAP},    {"normaldx", IO_NORMAL_MAP},
    {"nor", IO_NORMAL_MAP},        {"nrm", IO_NORMAL_MAP},         {"roughness", IO_ROUGHNESS_MAP},
    {"rough", IO_ROUGHNESS_MAP},   {"gloss", IO_GLOSS_MAP},        {"glossiness", IO_GLOSS_MAP},
    {"metallic", IO_METALLIC_MAP}, {"metalness", IO_METALLIC_MAP}, {"metal", IO_METALLIC_MAP},
    {"specular", IO_SPECULAR_MAP}, {"spec", IO_SPECULAR_MAP},
};

/* Words of maps and pictures that are not read, with a number behind them or without: rusty_metal_disp_1k is no
 * metalness. specularlevel is a scale, of which .5 is an F0 of .04. */
static const char *const others[] = {
    "ao",         "occlusion",    "ambientocclusion", "height",    "heightmap",    "disp",      "displacement",
    "bump",       "cavity",       "curvature",        "thickness", "emission",     "emissive",  "arm",
    "orm",        "ior",          "anisotropy",       "aniso",     "translucency", "sss",       "subsurface",
    "scattering", "transmission", "clearcoat",        "coat",      "sheen",        "speclevel", "specularlevel",
    "nrm16",      "preview",      "sphere",           "thumbnail", "thumb",        "render",    "alphamasked",
    "idmap",      "overlay",      "direction",
};
/* Behind the name of a map they are in its channels: BaseColor_Alpha. */
static const char *const parts[] = {"alpha", "opacity", "transparency", "mask"};

enum { NONE = -1, OTHER = IO_MAP_KINDS, PART, REFLECTION };

/* The words of a file name, cut at everything that is no letter or digit and where a capital follows a small letter. */
enum { WORDS = 16, WORD = 32 };
typedef struct split {
    char word[WORDS][WORD];
    int count;
} split;

/* False: the name is not that of an image. */
static bool split_name(const char *name, split *s)
{
    const char *dot = strrchr(name, '.');
    if (!dot || dot == name || name[0] == '.' || !oi_knows_extension(dot + 1)) return false;
    const size_t length = (size_t)(dot - name);
    size_t n = 0;
    s->count = 0;
    for (size_t i = 0; i <= length && s->count < WORDS; i++) {
        unsigned char c = i < length ? (unsigned char)name[i] : 0, before = i ? (unsigned char)name[i - 1] : 0;
        bool end = !isalnum(c), camel = isupper(c) && islower(before);
        if ((end || camel) && n) s->word[s->count++][n] = 0, n = 0;
        if (!end && s->count < WORDS && n < WORD - 1) s->word[s->count][n++] = (char)tolower(c);
    }
    return true;
}

static int kind_of_word(const char *word)
{
    for (size_t w = 0; w < sizeof words / sizeof words[0]; w++)
        if (!strcmp(word, words[w].word)) return words[w].kind;
    if (!strcmp(word, "refl") || !strcmp(word, "reflection")) return REFLECTION;
    size_t n = strlen(word);
    while (n && isdigit((unsigned char)word[n - 1])) n--;
    for (size_t w = 0; w < sizeof others / sizeof others[0]; w++)
        if (!strcmp(word, others[w]) || (n && strlen(others[w]) == n && !strncmp(word, others[w], n))) return OTHER;
    for (size_t w = 0; w < sizeof parts / sizeof parts[0]; w++)
        if (!strcmp(word, parts[w])) return PART;
    return NONE;
}

/* Words of maps that are as often part of an asset's own name. */
static bool is_noun(const char *word) { return !strcmp(word, "metal") || !strcmp(word, "rough"); }

/* Whether a word behind a map's says nothing of the asset: a size, a number, a version. */
static bool is_detail(const char *word)
{
    static const char *const details[] = {"map", "tex", "texture", "linear", "raw", "srgb"};
    bool found = strpbrk(word, "0123456789") != NULL;
    for (size_t w = 0; w < sizeof details / sizeof details[0]; w++) found = found || !strcmp(word, details[w]);
    return found;
}

/* The map that the first count words mean, by the last that says something: a kind, OTHER or NONE. *at: its number. A
 * noun that is not the last is the asset's: metal_plate_02. */
static int kind_of_words(const split *s, int count, int *at)
{
    bool last = true;
    for (int i = count - 1; i >= 0; last = last && is_detail(s->word[i]), i--) {
        const int kind = kind_of_word(s->word[i]), before = i ? kind_of_word(s->word[i - 1]) : NONE;
        const bool named = before >= 0 && before < IO_MAP_KINDS && !is_noun(s->word[i - 1]);
        *at = i;
        if ((kind == PART && named) || (is_noun(s->word[i]) && !last)) continue;
        if (kind == PART || (before == IO_SPECULAR_MAP && !strcmp(s->word[i], "level"))) return OTHER;
        if (kind != NONE) return kind;
    }
    return NONE;
}

static bool is_scalar(int kind) { return kind == IO_ROUGHNESS_MAP || kind == IO_GLOSS_MAP || kind == IO_METALLIC_MAP; }

typedef enum side { UNKNOWN, GL, DX, BOTH } side;

typedef struct meaning {
    int kind; /* -1: no map that is read; REFLECTION: F0 beside gloss, where no other map says it */
    side y;   /* OpenGL or DirectX if the name says so */
    bool packed;
} meaning;

/* suffix: the last word is the workflow of all, and not the map, where one stands before it. */
static meaning meaning_of(const split *s, bool suffix)
{
    int at = 0, last = s->count - 1, kind = suffix ? kind_of_words(s, last, &at) : NONE;
    if (kind == NONE) kind = kind_of_words(s, s->count, &at);
    meaning m = {.kind = kind == OTHER ? NONE : kind};
    if (is_scalar(m.kind) && at > 0) {
        const int before = kind_of_word(s->word[at - 1]);
        m.packed = (is_scalar(before) && before != m.kind) || (before == IO_SPECULAR_MAP && m.kind == IO_GLOSS_MAP) ||
            !strcmp(s->word[at - 1], "ao") || !strcmp(s->word[at - 1], "occlusion");
    }
    for (int i = 0; i < s->count && m.kind == IO_NORMAL_MAP; i++) {
        const char *word = s->word[i];
        if (!strcmp(word, "gl") || !strcmp(word, "opengl") || !strcmp(word, "ogl") || !strcmp(word, "normalgl"))
            m.y = GL;
        if (!strcmp(word, "dx") || !strcmp(word, "directx") || !strcmp(word, "normaldx")) m.y = DX;
    }
    return m;
}

/* Finds "key" at the beginning of a line, followed by ':' or '='; value is the rest, trimmed. */
static bool find_key(const char *text, const char *key, char *value, size_t capacity)
{
    size_t length = strlen(key);
    for (const char *line = text; line; line = strchr(line, '\n')) {
        while (*line == '\n' || *line == '\r' || *line == ' ' || *line == '\t') line++;
        if (!strncmp(line, "\xef\xbb\xbf", 3)) line += 3; /* a byte-order mark */
        if (strncasecmp(line, key, length)) continue;
        const char *p = line + length;
        while (*p == ' ' || *p == '\t') p++;
        if (*p != ':' && *p != '=') continue;
        for (p++; *p == ' ' || *p == '\t';) p++;
        size_t n = strcspn(p, "\r\n#");
        while (n && (p[n - 1] == ' ' || p[n - 1] == '\t')) n--;
        if (n >= capacity) n = capacity - 1;
        memcpy(value, p, n);
        value[n] = 0;
        return true;
    }
    return false;
}

static bool says(const char *text, const char *word) { return strcasestr(text, word) != NULL; }

static side normal_side(const char *text)
{
    bool gl = says(text, "opengl") || !strcasecmp(text, "gl"), dx = says(text, "directx") || !strcasecmp(text, "dx");
    return gl && dx ? BOTH : gl ? GL : dx ? DX : UNKNOWN;
}

/* Of two normal maps whose names give their y the wanted one is taken (OpenGL if both will do). */
static bool choose_normal(io_map_set *set, side *have, const char *name, side y, side wanted)
{
    if (*have == UNKNOWN || y == UNKNOWN || *have == y) return false;
    side better = wanted == DX ? DX : GL;
    if (y == better) {
        *have = y;
        snprintf(set->file[IO_NORMAL_MAP], sizeof set->file[0], "%s", name);
    }
    return true;
}

/* This map and the one that would stand in its place, bits 1 << kind. */
static unsigned alternatives(int kind)
{
    const unsigned colours = 1u << IO_BASECOLOR | 1u << IO_DIFFUSE_MAP,
                   gloss = 1u << IO_ROUGHNESS_MAP | 1u << IO_GLOSS_MAP;
    return colours >> kind & 1 ? colours : gloss >> kind & 1 ? gloss : 1u << kind;
}

static bool is_named(const io_map_set *set, unsigned named, const char *file)
{
    for (int k = 0; k < IO_MAP_KINDS; k++)
        if (named >> k & 1 && !strcmp(set->file[k], file)) return true;
    return false;
}

/* Poliigon ends all names of a set in its workflow: Metal01_COL_2K_METALNESS. */
static bool all_end_alike(DIR *folder, const io_map_set *set, unsigned named)
{
    char end[WORD] = "";
    int count = 0;
    rewinddir(folder);
    for (struct dirent *entry; (entry = readdir(folder));) {
        split s;
        if (!split_name(entry->d_name, &s) || meaning_of(&s, false).kind == NONE || is_named(set, named, entry->d_name))
            continue;
        const char *last = s.word[s.count - 1];
        if (count == 0 && (!strcmp(last, "metalness") || !strcmp(last, "metallic") || !strcmp(last, "specular")))
            strcpy(end, last);
        if (strcmp(last, end)) return false;
        count++;
    }
    return count > 1;
}

/* named: the maps that meta.txt has named, bits 1 << kind. For those and their alternatives
 * no other name counts. */
static ts_code scan(const char *path, io_map_set *set, unsigned named, side wanted, side *file_side, ts_status *st)
{
    DIR *folder = opendir(path);
    if (!folder) return ts_fail(st, TS_IO, "%s: %s", path, errno == ENOTDIR ? "not a folder of maps" : strerror(errno));
    ts_code code = TS_OK;
    const bool suffix = all_end_alike(folder, set, named);
    char reflection[sizeof set->file[0]] = "";
    rewinddir(folder);
    for (struct dirent *entry; code == TS_OK && (entry = readdir(folder));) {
        split s;
        if (!split_name(entry->d_name, &s) || strlen(entry->d_name) >= sizeof set->file[0]) continue;
        const meaning m = meaning_of(&s, suffix);
        if (m.kind == REFLECTION) strcpy(reflection, entry->d_name);
        if (m.kind < 0 || m.kind >= IO_MAP_KINDS || named & alternatives(m.kind) || is_named(set, named, entry->d_name))
            continue;
        char *file = set->file[m.kind];
        if (!file[0]) {
            strcpy(file, entry->d_name);
            set->packed[m.kind] = m.packed;
            if (m.kind == IO_NORMAL_MAP) *file_side = m.y;
        } else if (m.kind != IO_NORMAL_MAP || !choose_normal(set, file_side, entry->d_name, m.y, wanted)) {
            bool swap = strcmp(file, entry->d_name) > 0; /* the same message whatever order the system lists them in */
            code = ts_fail(st, TS_INVALID,
                           "%s: both %s and %s could be the %s map; remove one, or name it in meta.txt (file.%s: ...)",
                           path, swap ? entry->d_name : file, swap ? file : entry->d_name, io_map_kind_name[m.kind],
                           io_map_kind_name[m.kind]);
        }
    }
    closedir(folder);
    if (*reflection && set->file[IO_GLOSS_MAP][0] && !set->file[IO_METALLIC_MAP][0] && !set->file[IO_SPECULAR_MAP][0])
        strcpy(set->file[IO_SPECULAR_MAP], reflection);
    return code;
}

/* Files named in meta.txt come first: they decide where names are ambiguous. Bits 1 << kind. */
static unsigned named_files(const char *meta, io_map_set *set)
{
    unsigned named = 0;
    for (int k = 0; k < IO_MAP_KINDS; k++) {
        char key[32];
        snprintf(key, sizeof key, "file.%s", io_map_kind_name[k]);
        if (find_key(meta, key, set->file[k], sizeof set->file[k])) named |= 1u << k;
    }
    return named;
}

static ts_code settle_normal(const char *path, const char *meta, io_normal convention, side file_side, io_map_set *set,
                             ts_status *st)
{
    char text[512] = "";
    side y = file_side;
    if (y == UNKNOWN && find_key(meta, "normal", text, sizeof text)) y = normal_side(text);
    if (convention != IO_NORMAL_FROM_FILE) y = convention == IO_NORMAL_DX ? DX : GL;
    if (y == GL || y == DX) {
        set->directx = y == DX;
        return TS_OK;
    }
    return ts_fail(st, TS_INVALID,
                   "%s: %s; put \"normal: OpenGL y\" or \"normal: DirectX y\" into meta.txt (of "
                   "lgd-eval's sets also: --normal, or a set.ini)",
                   path,
                   y == BOTH ? "meta.txt names both conventions for the normal's y"
                             : "nothing says whether the normal's y is OpenGL or DirectX");
}

static ts_code settle_workflow(const char *path, const char *meta, io_workflow given, io_map_set *set, ts_status *st)
{
    char text[512] = "";
    bool base = set->file[IO_BASECOLOR][0], diffuse = set->file[IO_DIFFUSE_MAP][0],
         metallic = set->file[IO_METALLIC_MAP][0];
    bool specular = set->file[IO_SPECULAR_MAP][0], said_specular = false, said_metallic = false;
    if (given != IO_WORKFLOW_FROM_FILE) {
        said_specular = given == IO_WORKFLOW_SPECULAR;
        said_metallic = !said_specular;
    } else if (find_key(meta, "workflow", text, sizeof text)) {
        said_specular = !strncasecmp(text, "specular", 8);
        said_metallic = !strncasecmp(text, "metal", 5);
    }
    if (base && diffuse)
        return ts_fail(
            st, TS_INVALID,
            "%s: both %s and %s could be the colour map; remove one, or name it in meta.txt (file.basecolor: ...)",
            path, set->file[IO_BASECOLOR], set->file[IO_DIFFUSE_MAP]);
    if (metallic && specular && !said_specular && !said_metallic)
        return ts_fail(st, TS_INVALID,
                       "%s: has both %s and %s; put \"workflow: metallic\" or \"workflow: specular\" into meta.txt "
                       "(of lgd-eval's sets also: --workflow, or a set.ini)",
                       path, set->file[IO_METALLIC_MAP], set->file[IO_SPECULAR_MAP]);
    set->specular = said_specular || (specular && !said_metallic);
    if (set->specular && !specular)
        return ts_fail(st, TS_INVALID, "%s: should be of the specular workflow, but there is no specular map", path);
    if (set->file[IO_ROUGHNESS_MAP][0] && set->file[IO_GLOSS_MAP][0])
        return ts_fail(st, TS_INVALID,
                       "%s: has both %s and %s; remove one, or name it in meta.txt (file.roughness: ...)", path,
                       set->file[IO_ROUGHNESS_MAP], set->file[IO_GLOSS_MAP]);
    if (!base && !diffuse)
        return ts_fail(st, TS_INVALID, "%s: no colour map (basecolor, albedo, diffuse or color in its file name)",
                       path);
    if (!set->file[IO_NORMAL_MAP][0])
        return ts_fail(st, TS_INVALID, "%s: no normal map (normal in its file name)", path);
    if (!set->file[IO_ROUGHNESS_MAP][0] && !set->file[IO_GLOSS_MAP][0])
        return ts_fail(st, TS_INVALID,
                       "%s: no roughness map (roughness in its file name; a packed map must be taken apart)", path);
    return TS_OK;
}

ts_code io_describe_map_folder(const char *path, const io_map_convention *given, io_map_set *set, ts_status *st)
{
    const io_map_convention say = given ? *given : (io_map_convention){0};
    memset(set, 0, sizeof *set);
    char meta_path[PATH_MAX], *meta = NULL, text[512];
    size_t size;
    side file_side = UNKNOWN;
    ts_code code = TS_OK;
    if (snprintf(meta_path, sizeof meta_path, "%s/meta.txt", path) >= (int)sizeof meta_path)
        return ts_fail(st, TS_INVALID, "%s: name too long", path);
    FILE *exists = fopen(meta_path, "re");
    if (exists) {
        fclose(exists);
        code = io_read_bytes(meta_path, 1 << 20, &meta, &size, st);
    }
    const char *words_of = meta ? meta : "";
    if (code == TS_OK)
        code = scan(path, set, named_files(words_of, set),
                    say.normal == IO_NORMAL_DX       ? DX
                        : say.normal == IO_NORMAL_GL ? GL
                                                     : UNKNOWN,
                    &file_side, st);
    if (code == TS_OK) code = settle_workflow(path, words_of, say.workflow, set, st);
    if (code == TS_OK) code = settle_normal(path, words_of, say.normal, file_side, set, st);
    for (int k = 0; k < IO_MAP_KINDS && code == TS_OK; k++)
        set->linear[k] = say.colour
            ? say.colour == IO_ENCODING_LINEAR
            : find_key(words_of, io_map_kind_name[k], text, sizeof text) && says(text, "linear") && !says(text, "srgb");
    free(meta);
    return code;
}
