/* The configuration of a training run, and the table of keys (train/keys.c) that parses, prints and documents it. */
#ifndef TR_CONFIG_H
#define TR_CONFIG_H
#include "data/materials/procedural.h"
#include "nn/model.h"
#include "tensor/conv/conv.h"
#include "train/mpi/mpi.h"
#include <stdio.h>

/* The camera of the validation's photographs: [data]'s, or that of its keys' defaults. */
typedef enum tr_camera { TR_CAMERA_DATA, TR_CAMERA_DEFAULT } tr_camera;

/* What is new to a student of train.teacher (train/teach.c). */
typedef enum tr_lesson { TR_LESSON_DIFFUSE, TR_LESSON_NORMALS, TR_LESSON_KNOWN } tr_lesson;

typedef struct tr_config {
    nn_arch arch;   /* [model] */
    nn_coder coder; /* [coder] */
    struct {        /* [data] */
        int64_t seed;
        uint64_t families, often; /* bits as in io_procedural; 0: all */
        double hues, darker, relief, blend, uneven, closer, homogeneous, plain, smoother, steeper, collected;
        char collection[1024];
        double noise, noise_spread, blur, exposure, vignette, white_balance, tilt, off_centre; /* as in io_camera */
        double fov_min, fov_max, meter, automatic, flash, flash_size, glare, lobes, soften, ambient, tone, sharpen;
        double told_view, told_power, measured;
        double sheet, pose, shift, bracket; /* as in io_under_sheet */
        bool quantise;
        int jpeg, patch, prefetch, threads;
    } data;
    struct {               /* [train] */
        int batch, window; /* window 0: whole patches */
        int64_t pretrain_steps, steps, warmup;
        double pretrain_rate, pretrain_floor, rate, g_rate, coarse_rate, rate_floor;
        double clip, spike, ema, start_weight, map_weight, normal_weight, normal_rmse, normal_mse, specular_weight,
            spread_weight, disturb, scene_weight;
        int iterations_min, iterations_max; /* 0: arch.iterations */
        int given_min;                      /* 0: tr_most_given */
        int given_max;                      /* 0: arch.images */
        bool checkpoint_steps;
        ts_precision precision;
        bool exact;
        int64_t seed, checkpoint_every, log_every;
        int max_skipped;
        char init[1024], init_rest[1024], teacher[1024];
        int flash_views;
        tr_lesson lesson;
        tr_reduce reduce; /* of several ranks */
        double bucket;    /* MiB */
    } train;
    struct { /* [validate] */
        int64_t every, seed;
        int count, size;
        tr_camera camera;
    } validate;
    struct { /* [output] */
        char folder[1024];
    } output;
} tr_config;

typedef enum tr_type { TR_INT, TR_INT64, TR_REAL, TR_BOOL, TR_CHOICE, TR_TEXT, TR_FAMILIES } tr_type;

typedef struct tr_key {
    const char *section, *key;
    tr_type type;
    size_t offset;
    double lo, hi;             /* numbers; TR_TEXT: hi is the size of the array */
    const char *initial;       /* the default as text; NULL: nn_arch_default()'s */
    const char *const *choice; /* TR_CHOICE: names in the order of the enum, NULL at the end */
    bool neutral; /* changes no byte of what a run still makes: free to change on resume, not kept in checkpoints */
    const char *help;
} tr_key;

extern const tr_key tr_keys[];
extern const int tr_key_count;

tr_config tr_config_default(void);

/* Sets one key from text; where ("file.ini:12" or "--set") begins the message. For an unknown section or key
 * the message suggests the nearest. */
ts_code tr_config_set(tr_config *c, const char *where, const char *section, const char *key, const char *value,
                      ts_status *st);
/* The same from "section.key=value". */
ts_code tr_config_set_assignment(tr_config *c, const char *assignment, ts_status *st);
/* Every entry of the file; other keys keep their values. */
ts_code tr_config_read(tr_config *c, const char *path, ts_status *st);

/* Photographs of a material in a training step, at most. */
int tr_most_given(const tr_config *c);

/* Conditions on several keys: the architecture as a whole, ranges against each other. */
ts_code tr_config_check(const tr_config *c, ts_status *st);

/* The text of one value as an INI file has it. */
void tr_config_format(const tr_config *c, const tr_key *key, char *text, size_t size);

/* The whole configuration as an INI file that reads back to the same values. neutral: with the keys that change no
 * weights. */
void tr_config_print(const tr_config *c, bool neutral, FILE *f);
/* Every key with type, range, default and meaning. */
void tr_config_help(FILE *f);

/* TS_INVALID naming the first key (not a neutral one) that differs; then: the older value's origin for the message. */
ts_code tr_config_same(const tr_config *then, const tr_config *now, const char *origin, ts_status *st);
#endif
