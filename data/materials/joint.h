/* How relief, colour and gloss of materials belong together, band by band, and which levels they have. */
#ifndef IO_JOINT_H
#define IO_JOINT_H
#include "data/materials/statistics.h"

/* Of one material: relief, the root mean square of |n_xy|, in all and at 2 .. 8, 8 .. 32 and 32 .. 64 cycles a patch;
 * in these bands the correlation of the height (data/height.h) with diffuse luminance (gamma 1/2.2) and with roughness,
 * 0 where one of the two does not vary; the means of F0 (linear) and roughness. */
enum { IO_JOINTS = 12 };
const char *io_joint_name(int joint);
/* TS_NOMEM. */
ts_code io_joint(const io_material *m, double out[IO_JOINTS], ts_status *st);

typedef struct io_joint_set {
    int count;
    double (*values)[IO_JOINTS]; /* owned */
} io_joint_set;
void io_joint_set_free(io_joint_set *set);
/* Adds one material. */
ts_code io_joint_add(io_joint_set *set, const io_material *m, ts_status *st);
/* Adds what io_visit_materials finds in the folder. */
ts_code io_joint_folder(const char *folder, int size, io_joint_set *set, ts_status *st);
/* The value that a share of the materials lies below, linear between neighbours. */
double io_joint_quantile(const io_joint_set *set, int joint, double share);
#endif
