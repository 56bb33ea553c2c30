#include "data/materials/compare.h"
#include "data/materials/joint.h"
#include "data/materials/statistics.h"

static void print_features(const io_feature_set *ours, const io_feature_set *theirs, const char *folder, FILE *f)
{
    double each[IO_FEATURES];
    const double distance = io_feature_distance(ours, theirs, each), halves = io_feature_halves(theirs, 200, 1);
    fprintf(f, "%-20s %15s %20s %10s\n", "", "testdata", "procedural", "distance");
    for (int i = 0; i < IO_FEATURES; i++) {
        double m, s, n, t;
        io_feature_summary(theirs, i, &m, &s);
        io_feature_summary(ours, i, &n, &t);
        fprintf(f, "%-20s %8.3f +- %5.3f %10.3f +- %5.3f %10.2f\n", io_feature_name(i), m, s, n, t, each[i]);
    }
    fprintf(f, "distance of %d procedural materials from %d in %s: %.3f\n", ours->count, theirs->count, folder,
            distance);
    fprintf(f, "distance between two halves of the latter, mean of 200 halvings: %.3f (ratio %.2f)\n", halves,
            distance / halves);
}

static void print_joint(const io_joint_set *ours, const io_joint_set *theirs, FILE *f)
{
    static const double share[] = {0.1, 0.25, 0.5, 0.75, 0.9};
    enum { SHARES = sizeof share / sizeof *share };
    fprintf(f, "\n%-23s", "quantiles, bands in");
    for (int side = 0; side < 2; side++) fprintf(f, "  %s%*s", side ? "procedural" : "testdata", side ? 26 : 28, "");
    fprintf(f, "\n%-23s", "cycles a patch");
    for (int side = 0; side < 2; side++)
        for (int k = 0; k < SHARES; k++) fprintf(f, "%s%6.0f%%", k ? "" : "  ", 100 * share[k]);
    fprintf(f, "\n");
    for (int i = 0; i < IO_JOINTS; i++) {
        fprintf(f, "%-23s", io_joint_name(i));
        for (int side = 0; side < 2; side++)
            for (int k = 0; k < SHARES; k++)
                fprintf(f, "%s%7.3f", k ? "" : "  ", io_joint_quantile(side ? ours : theirs, i, share[k]));
        fprintf(f, "\n");
    }
}

ts_code io_compare(const io_procedural *p, uint64_t first, int count, const char *folder, int size, FILE *f,
                   ts_status *st)
{
    io_feature_set ours = {0}, theirs = {0};
    io_joint_set our_joint = {0}, their_joint = {0};
    io_material m = {0};
    ts_code code = io_features_folder(folder, size, &theirs, st);
    if (!code) code = io_joint_folder(folder, size, &their_joint, st);
    if (!code) code = io_features_procedural(p, first, count, size, &ours, st);
    if (!code) code = io_material_create(&m, size, st);
    for (int i = 0; !code && i < count; i++) {
        io_procedural_make(p, first + (uint64_t)i, &m);
        code = io_joint_add(&our_joint, &m, st);
    }
    if (!code) {
        print_features(&ours, &theirs, folder, f);
        print_joint(&our_joint, &their_joint, f);
    }
    io_material_free(&m);
    io_feature_set_free(&ours);
    io_feature_set_free(&theirs);
    io_joint_set_free(&our_joint);
    io_joint_set_free(&their_joint);
    return code;
}
