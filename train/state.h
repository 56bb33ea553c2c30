/* The state of a run, and what the files of the trainer do with it. */
#ifndef TR_STATE_H
#define TR_STATE_H
#include "cli/camera.h"
#include "data/camera.h"
#include "data/loader.h"
#include "nn/adam.h"
#include "nn/revise.h"
#include "train/config.h"
#include "train/listener.h"
#include "train/ranks.h"
#include "train/reduce.h"

enum { TR_HASH = 17 };   /* as text */
enum { TR_PATH = 1200 }; /* a folder and one of our names */

/* A photograph, what is true of it, and what the model is given. */
typedef struct tr_shot {
    cl_shot is;
    rd_view thought;            /* is.view, but of a printed sheet where its tags put camera and light */
    bool told_view, told_power; /* whether the model is given them */
} tr_shot;

/* Of a material: of its renderings under R_0 ... R_T, then of the last maps. */
enum { TR_ERRORS = TR_MOST_ITERATIONS + 5 };

/* What the ranks' losses are summed as, each with its rank's share of the batch as weight, and how many ranks were
 * asked to stop. */
typedef struct tr_losses {
    double loss, render_start, map_start, render_end, map_end, spread, scene, stop;
} tr_losses;

/* The fixed materials of validation: this rank's share of them. */
typedef struct tr_validator {
    int first, count;
    float *maps;          /* [count][size][size][9], owned */
    float *images;        /* [count][given][size][size][3], owned */
    rd_view *captures;    /* [count][given], owned */
    tr_shot *shots;       /* [count][given], owned */
    unsigned char *known; /* [count][given] of nn_known, where h is trained, or where all is known */
    rd_view *views;       /* [count][RD_EVAL_VIEWS], owned */
    double *errors;       /* [validate.count][TR_ERRORS] of all, owned */
    nn_model *model;      /* holds what is validated: the moving average, or a copy of the weights */
    ag_tape *tape;        /* without gradients */
} tr_validator;

typedef struct tr_trainer {
    tr_config config;
    char folder[1024];
    tr_listener listener;
    tr_ranks ranks;
    tr_reducer reducer; /* of several ranks */
    tr_losses losses;   /* of this step, summed while backward goes on */
    bool posted;        /* sums over the ranks may still write to losses and the model's gradients */
    int first, batch;   /* this rank's share of train.batch */
    bool stop;          /* a rank was asked to stop when the last step's losses were summed */
    double waited;      /* seconds, of all steps here */
    double busy;        /* seconds of all steps here */
    int lock;           /* descriptor, -1: none */
    bool new_lock;      /* no run was here before */
    nn_model *model;
    nn_adam adam;
    ag_tape *tape;
    nn_model *teacher; /* train.teacher, or NULL */
    ag_tape *quiet;    /* of a fixed g, without gradients, whose packed weights are kept; NULL where none is read */
    io_collection *collection;                            /* data.collection, or NULL */
    char collection_hash[TR_HASH], teacher_hash[TR_HASH]; /* of these, or of those that the checkpoint was made with;
                                                            empty: there is none */
    io_loader *loader;
    float *images;     /* [batch][given][patch][patch][3], given <= tr_most_given; batch: the share's, here and below */
    rd_view *captures; /* [batch][given] */
    tr_shot *shots;    /* [batch][given] */
    float *scenes;     /* [batch][given][RD_SCENE_NUMBERS] */
    unsigned char *known; /* [batch][given] of nn_known */
    rd_view *views;       /* [batch][RD_LOSS_VIEWS] */
    tr_validator validator;
    FILE *log, *validation_log;
    bool saved;       /* the folder's checkpoint is the state of now */
    int64_t step;     /* steps made */
    int64_t skipped;  /* of them without an update */
    int in_a_row;     /* of those, the latest without one that worked */
    double mean_norm; /* of the gradient, a moving average */
    double best;      /* least validated error in this phase; infinity: none yet */
} tr_trainer;

/* state.c */
void tr_path(const tr_trainer *t, const char *name, char path[TR_PATH]);
void tr_note(const tr_trainer *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
int64_t tr_total(const tr_config *c);
static inline bool tr_leads(const tr_trainer *t) { return t->ranks.rank == 0; }
bool tr_pretraining(const tr_config *c, int64_t step); /* whether the step after that many belongs to the first phase */
double tr_seconds(void);
const float *tr_weights(const tr_trainer *t); /* what is validated and saved */

/* The network of the configuration, or its auto-encoder: parameters are zero. The caller frees. NULL and st on failure.
 */
nn_model *tr_model_create(const tr_config *c, ts_status *st);

/* photograph.c: the materials and the camera of [data]. */
io_procedural tr_materials_of(const tr_config *c);
io_camera tr_camera_of(const tr_config *c);
/* Reads data.collection; TS_INVALID where the checkpoint was made with another. */
ts_code tr_read_collection(tr_trainer *t, ts_status *st);
/* known: the hash that the checkpoint has, or empty: it becomes hash. TS_INVALID where it is another; what: of whom. */
ts_code tr_same_source(uint64_t hash, const char *path, const char *what, char known[TR_HASH], ts_status *st);

/* Number photographs of each material [count][size][size][9], with the faults of [data]; images
 * [count][number][size][size][3], under views [count][number] as tr_capture_views draws them (NULL: the flash for
 * all); index: of the first material, for the camera's faults, of which every photograph has its own.
 * shots [count][number]: the truth of each; NULL: not wanted. */
void tr_photographs(const tr_config *c, uint64_t seed, uint64_t index, int count, int size, const float *maps,
                    const rd_view *views, int number, float *images, tr_shot *shots);
/* Of photographs that h revises light and camera are known, as well as they are: views and known [photographs], of
 * nn_known, say so. */
void tr_describe_several(const tr_shot *shots, int photographs, rd_view *views, unsigned char *known);
/* Whether the photographs of material number index are those of a printed sheet, of which there is this share. */
bool tr_under_sheet(double share, uint64_t seed, uint64_t index);
/* The views of number photographs of each of count materials, [count][number], drawn for each material
 * (rd_capture_draw, one being the flash, or rd_sheet_draw for the share `sheet` of the materials). */
void tr_capture_views(double sheet, uint64_t seed, uint64_t index, int count, int number, rd_view *views);

/* step.c. One step; t->step counts it. Returns an error only where the run cannot go on (a skipped step is none). */
ts_code tr_step(tr_trainer *t, tr_row *row, ts_status *st);

/* Adds weight * (rendering loss + map_weight * map loss) of maps to sum (NULL: none yet); the losses of these maps
 * alone go to *render and *map. NULL after an error, which the tape has. */
ag_value *tr_add_loss(tr_trainer *t, ag_value *sum, ag_value *maps, ag_value *target, double weight, double *render,
                      double *map);

/* Adds the errors of the maps' normals by train.normal_rmse and train.normal_mse to loss. NULL after an error, which
 * the tape has. */
ag_value *tr_add_normal_errors(tr_trainer *t, ag_value *loss, ag_value *maps, ag_value *target);

/* The loss of all that g says of in's photographs: R_0, how far that may be off (which moves R_0 nowhere), and the
 * scene. target [batch, patch, patch, 9]; its parts go to *row. NULL after an error, which the tape has. */
ag_value *tr_guess_loss(tr_trainer *t, const nn_input *in, ag_value *target, tr_row *row);

/* revision.c. The first guesses of several photographs of each material, of nn_arch_side, on a tape without gradients:
 * what revisions begin with. disturbed: NULL, or whose train.disturb makes this step's maps worse. False after an
 * error, which the tape has. */
bool tr_first_guesses(ag_tape *tape, const nn_model *model, const nn_input *in, const struct tr_trainer *disturbed,
                      nn_revision *r);
/* The mean loss of all revisions: of their maps, and of how far they say that these may be off. NULL after an error. */
ag_value *tr_revision_loss(tr_trainer *t, const nn_input *in, ag_value *target, tr_row *row);

/* teach.c. train.teacher, in t. TS_FORMAT, TS_INVALID with st where it is none that the model can learn from. */
ts_code tr_teacher_load(tr_trainer *t, ts_status *st);
/* What a teacher says of in's photographs, one of each material, with known not NULL: its first answer, but for the
 * diffuse albedo where the camera is not known: that is what it says of one above the centre, at the distance that it
 * guesses. False after an error, which the tape has. */
bool tr_taught(ag_tape *tape, const nn_model *teacher, const nn_input *in, nn_guess *said);
/* Whether this step is one of data.measured: of pictures under a light and a camera that are measured and given, which
 * the materials teach, whoever else teaches. */
bool tr_measured(const tr_config *c, int64_t step);
/* Whose data photographs of this step are taken with: c, or in measured steps measured, which becomes c
 * without what cannot be measured, in half of them under the default flash. */
const tr_config *tr_taken_with(const tr_config *c, int64_t step, tr_config *measured);
/* c without what cannot be measured, all told. */
tr_config tr_measured_camera(const tr_config *c);
/* How far the model is from what the teacher says, or with train.lesson = normals of the normals from target [batch,
 * patch, patch, 9], by train.normal_rmse and normal_mse too: of maps in the teacher's own deviations, of their
 * logarithms and the scene as they are. NULL after an error. */
ag_value *tr_taught_loss(tr_trainer *t, const nn_input *in, ag_value *target, tr_row *row);

/* validate.c */
ts_code tr_validator_create(tr_trainer *t, ts_status *st);
void tr_validator_free(tr_validator *v);
ts_code tr_validate(tr_trainer *t, tr_validation *out, ts_status *st);

/* The configuration without neutral keys, so that weights do not differ with the folder or the threads. Freed by the
 * caller. NULL and st on failure. */
char *tr_config_text(const tr_config *c, ts_status *st);

/* checkpoint.c: the trainer's state in the folder. tr_resume fails with TS_INVALID naming the key when the
 * configuration differs. */
ts_code tr_save_checkpoint(tr_trainer *t, ts_status *st);
ts_code tr_save_weights(tr_trainer *t, const char *name, ts_status *st);
ts_code tr_resume(tr_trainer *t, ts_status *st);

/* log.c: opens both logs, without the rows after t->step. */
ts_code tr_log_open(tr_trainer *t, ts_status *st);
ts_code tr_log_row(tr_trainer *t, const tr_row *row, ts_status *st);
ts_code tr_log_validation(tr_trainer *t, const tr_validation *v, ts_status *st);
ts_code tr_log_flush(tr_trainer *t, ts_status *st);
void tr_log_close(tr_trainer *t);

/* curve.c: curve.svg in the folder, from the two logs as they are. One that cannot be drawn is a note; an error is one
 * of the logs. */
ts_code tr_curve_write(tr_trainer *t, ts_status *st);
#endif
