/* How similar two sets of materials are: a few numbers for each material, compared over the sets. */
#ifndef IO_STATISTICS_H
#define IO_STATISTICS_H
#include "data/material.h"
#include "data/materials/procedural.h"

/* Of one pixel: diffuse luminance, roughness, specular luminance (luminances gamma 1/2.2, as eyes and errors see them),
 * slope |n_xy|, saturation of the diffuse colour. */
enum { IO_VALUES = 5 };
void io_values(const float *maps9, double out[IO_VALUES]);

/* Shows visit every map folder in folder/maps and every strip in folder/strips, in the order of their names, until it
 * returns an error. */
typedef ts_code io_visit(void *context, const io_material *m, ts_status *st);
ts_code io_visit_materials(const char *folder, int size, io_visit *visit, void *context, ts_status *st);

/* For one material, of the first four of these: mean, standard deviation, mean size of the difference to the neighbours
 * right and below per 1/64 patch width, correlations of all pairs (0 where one of the two does not vary); and the mean
 * saturation and the share of metal (F0 over 0.15). */
enum { IO_FEATURES = 20 };
const char *io_feature_name(int feature);
ts_code io_features(const float *maps, int size, double out[IO_FEATURES], ts_status *st);

typedef struct io_feature_set {
    int count;
    double (*values)[IO_FEATURES]; /* owned */
} io_feature_set;
void io_feature_set_free(io_feature_set *set);

/* Materials first .. first+count-1 of p. */
ts_code io_features_procedural(const io_procedural *p, uint64_t first, int count, int size, io_feature_set *set,
                               ts_status *st);
/* Every map folder in folder/maps and every strip in folder/strips, in the order of their names; at least two. */
ts_code io_features_folder(const char *folder, int size, io_feature_set *set, ts_status *st);

/* The mean over the features of (|difference of the sets' means| + |difference of the standard deviations over
 * materials|) / the pooled standard deviation. each (may be NULL) gets every feature's own. */
double io_feature_distance(const io_feature_set *a, const io_feature_set *b, double each[IO_FEATURES]);
/* The same between two random halves of one set, the mean of rounds halvings. */
double io_feature_halves(const io_feature_set *set, int rounds, uint64_t seed);
/* Mean and standard deviation of a feature over a set. */
void io_feature_summary(const io_feature_set *set, int feature, double *mean, double *deviation);
#endif
