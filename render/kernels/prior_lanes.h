/* A prior on the maps of VL pixels, and what a photograph tells of them in its terms. The unknowns are white: maps =
 * mean + A z with A A' = Sigma and z of variance 1, so that a prior of any width, 0 included, begins as the identity.
 * A couples a pixel's three colours: colour c's row of J A has 5 + 2 c values. */
#ifndef TS_PRIOR_LANES_H
#define TS_PRIOR_LANES_H
#include "render/kernels/observe_lanes.h"
#include "render/kernels/posterior.h"

/* z in the order blue, green, red, what they share: a colour's diffuse and F0, then as in shared_map. */
enum { OWN = 6 };
#define own_at(c) (2 * (2 - (c)))

/* A: the prior's deviations, W of both colours, and the lower triangular factor of (1 - q) 1 1' + q I. */
typedef struct spread {
    vf deviation[MAP_GROUPS], tint[2][3];
    float hue[2][3][3];
} spread;

static void set_hue(const ts_prior *prior, spread *a)
{
    for (int k = 0; k < 2; k++) {
        const double r = 1 - fmin(fmax((double)prior->hue[k], 0), 1);
        const double d1 = sqrt((1 - r) * (1 + r)), d2 = sqrt((1 - r) / (1 + r));
        const double rows[3][3] = {{1}, {r, d1}, {r, r * d2, d2 * sqrt(1 + 2 * r)}};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) a->hue[k][i][j] = (float)rows[i][j];
    }
}

V_INLINE void load_deviation(const float *deviation, int n, spread *a)
{
    v_load_pixels(deviation, MAP_GROUPS, n, MAP_GROUPS, a->deviation);
    for (int g = 0; g < MAP_GROUPS; g++)
        a->deviation[g] = v_min(v_max(a->deviation[g], v_set(0)), v_set(TS_PRIOR_WIDEST));
}

/* W of the mean's colours, values in [0, 1], and their deviations, which have been loaded, cut to a share of them. */
V_INLINE void set_colours(const vf diffuse[3], const vf specular[3], float share, spread *a)
{
    for (int k = 0; k < 2; k++) {
        vf squares = {0};
        for (int c = 0; c < 3; c++) {
            a->tint[k][c] = (k ? specular : diffuse)[c] + TS_PRIOR_BLACK;
            squares += a->tint[k][c] * a->tint[k][c];
        }
        const vf level = v_sqrt(squares * (1.0f / 3)), inverse = 1.0f / level;
        vf *deviation = &a->deviation[k ? GROUP_SPECULAR : GROUP_DIFFUSE];
        if (share > 0) *deviation = v_min(*deviation, level * (2 * share));
        for (int c = 0; c < 3; c++) a->tint[k][c] *= inverse;
    }
}

/* A colour's row of J A from its row of J: h[own_at(c) ..], of MAP_CHANNELS values. */
V_INLINE void whiten(int c, const spread *a, const vf by[ROW], vf h[MAP_CHANNELS])
{
    const vf own[2] = {by[0] * a->deviation[GROUP_DIFFUSE] * a->tint[0][c],
                       by[1] * a->deviation[GROUP_SPECULAR] * a->tint[1][c]};
    for (int j = 0; j <= c; j++)
        for (int k = 0; k < 2; k++) h[own_at(j) + k] = own[k] * a->hue[k][c][j];
    h[OWN] = by[2] * a->deviation[GROUP_ROUGHNESS];
    for (int i = 1; i < SHARED; i++) h[OWN + i] = by[2 + i] * a->deviation[GROUP_NORMAL];
}

V_INLINE vf variance_of(vf target, const ts_prior *prior)
{
    const vf value = v_max(target, v_set(0));
    return v_max(value * (prior->noise + prior->gain * prior->gain * value) + prior->model * prior->model,
                 v_set(TS_PRIOR_FINEST));
}

/* J Sigma J' + S = L D L' of a photograph's three values, by Gram and Schmidt's method on the rows of (J A, S^1/2),
 * which keeps twice the digits that the sums of products would. L without its 1: below[0] in the second row, below[1]
 * and [2] in the third. u: L^-1 J A. */
typedef struct gram {
    vf u[3][MAP_CHANNELS], below[3], inverse[3]; /* 1 / D */
} gram;

V_INLINE vf product(int first, const vf *a, const vf *b)
{
    vf sum = a[first] * b[first];
    for (int i = first + 1; i < MAP_CHANNELS; i++) sum += a[i] * b[i];
    return sum;
}

/* g->u holds J A. */
V_INLINE void orthogonalise(const vf variance[3], gram *g)
{
    vf(*u)[MAP_CHANNELS] = g->u;
    const int first[3] = {own_at(0), own_at(1), own_at(2)};
    g->inverse[0] = 1.0f / (product(first[0], u[0], u[0]) + variance[0]);
    const vf b10 = product(first[0], u[1], u[0]) * g->inverse[0], b20 = product(first[0], u[2], u[0]) * g->inverse[0];
    for (int i = first[0]; i < MAP_CHANNELS; i++) u[1][i] -= b10 * u[0][i], u[2][i] -= b20 * u[0][i];
    g->inverse[1] = 1.0f / (product(first[1], u[1], u[1]) + (variance[1] + b10 * b10 * variance[0]));
    const vf b21 = (product(first[1], u[2], u[1]) + b20 * b10 * variance[0]) * g->inverse[1], rest = b21 * b10 - b20;
    for (int i = first[1]; i < MAP_CHANNELS; i++) u[2][i] -= b21 * u[1][i];
    g->inverse[2] = 1.0f /
        (product(first[2], u[2], u[2]) + (variance[2] + b21 * b21 * variance[1] + rest * rest * variance[0]));
    g->below[0] = b10, g->below[1] = b20, g->below[2] = b21;
}

/* r becomes L^-1 r. */
V_INLINE void forward(const gram *g, vf r[3])
{
    r[1] -= g->below[0] * r[0];
    r[2] -= g->below[1] * r[0] + g->below[2] * r[1];
}
#endif
