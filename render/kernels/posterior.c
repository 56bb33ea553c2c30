/* The unknowns are white: maps = mean + A z with A A' = Sigma and z of variance 1, so that a prior of any width, 0
 * included, begins as the identity. A couples a pixel's three colours, therefore colour c's row of J A has 5 + 2 c
 * values: the order of elimination is blue, green, red, what they share. The factor takes them up as in newton.c. */
#include "render/kernels/posterior.h"
#include "render/kernels/observe_lanes.h"

enum { OWN = 6 }; /* z of the colours: of colour c at own_at(c), its diffuse and its F0 */
#define own_at(c) (2 * (2 - (c)))

/* Row i of the factor has MAP_CHANNELS - 1 - i values beside its 1. */
typedef struct equations {
    vf d[MAP_CHANNELS], z[MAP_CHANNELS], l[MAP_CHANNELS][MAP_CHANNELS - 1];
} equations;

/* A: the prior's deviations, and the lower triangular factor of (1 - q) 1 1' + q I. */
typedef struct spread {
    vf deviation[MAP_GROUPS];
    float hue[2][3][3];
} spread;

static void factor_of(float q, float l[3][3])
{
    const double r = 1 - fmin(fmax((double)q, 0), 1), d1 = sqrt((1 - r) * (1 + r)), d2 = sqrt((1 - r) / (1 + r));
    const double rows[3][3] = {{1}, {r, d1}, {r, r * d2, d2 * sqrt(1 + 2 * r)}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) l[i][j] = (float)rows[i][j];
}

/* Adds a photograph; first_view: q is unset. m: mean - maps. */
V_INLINE bool add_view(const ts_shade_view *view, ts_shade_kind kind, bool first_view, const ts_prior *prior,
                       const spread *a, const vf m[MAP_CHANNELS], const ts_shade_row *row, int first, int n,
                       const float *image, const surface *s, equations *q)
{
    const vf wide[SHARED] = {a->deviation[GROUP_ROUGHNESS], a->deviation[GROUP_NORMAL], a->deviation[GROUP_NORMAL]};
    sight t;
    if (!look(view, kind, row, first, n, image, s, &t)) return false;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        const int from = own_at(c);
        vf by[ROW], slope, h[MAP_CHANNELS], error = residual(c, s, &t, by, &slope);
        vf weight = 1.0f / v_max(v_max(t.target[c], v_set(0)) * prior->noise + prior->model * prior->model,
                                 v_set(TS_PRIOR_FINEST));
        error -= by[0] * m[MAP_DIFFUSE + c] + by[1] * m[MAP_SPECULAR + c];
        by[0] *= a->deviation[GROUP_DIFFUSE];
        by[1] *= a->deviation[GROUP_SPECULAR];
        for (int j = 0; j <= c; j++) {
            h[own_at(j)] = by[0] * a->hue[0][c][j];
            h[own_at(j) + 1] = by[1] * a->hue[1][c][j];
        }
        for (int i = 0; i < SHARED; i++) {
            error -= by[2 + i] * m[shared_map[i]];
            h[OWN + i] = by[2 + i] * wide[i];
        }
#pragma GCC unroll 9
        for (int i = from; i < MAP_CHANNELS; i++) {
            if (first_view && (c == 0 || i < from + 2))
                take_first(1, &q->d[i], &q->z[i], q->l[i], h + i, MAP_CHANNELS - 1 - i, error, &weight);
            else take_up(&q->d[i], &q->z[i], q->l[i], h + i, MAP_CHANNELS - 1 - i, &error, &weight);
        }
    }
    return true;
}

V_INLINE bool add(const ts_shade_view *view, bool first_view, const ts_prior *prior, const spread *a,
                  const vf m[MAP_CHANNELS], const ts_shade_row *row, int first, int n, const float *image,
                  const surface *s, equations *q)
{
    return view->kind == TS_SHADE_COLLOCATED
        ? add_view(view, TS_SHADE_COLLOCATED, first_view, prior, a, m, row, first, n, image, s, q)
        : add_view(view, TS_SHADE_POSITIONS, first_view, prior, a, m, row, first, n, image, s, q);
}

/* A z */
V_INLINE void widen(const spread *a, const vf z[MAP_CHANNELS], vf x[MAP_CHANNELS])
{
    for (int c = 0; c < 3; c++) {
        vf sum[2] = {{0}, {0}};
        for (int j = 0; j <= c; j++)
            for (int k = 0; k < 2; k++) sum[k] += a->hue[k][c][j] * z[own_at(j) + k];
        x[MAP_DIFFUSE + c] = sum[0] * a->deviation[GROUP_DIFFUSE];
        x[MAP_SPECULAR + c] = sum[1] * a->deviation[GROUP_SPECULAR];
    }
    x[MAP_ROUGHNESS] = z[OWN] * a->deviation[GROUP_ROUGHNESS];
    for (int i = 0; i < 2; i++) x[MAP_NORMAL + i] = z[OWN + 1 + i] * a->deviation[GROUP_NORMAL];
}

/* L' z = q->z */
V_INLINE void solve(const equations *q, vf z[MAP_CHANNELS])
{
#pragma GCC unroll 9
    for (int i = MAP_CHANNELS - 1; i >= 0; i--) {
        z[i] = q->z[i];
        for (int k = i + 1; k < MAP_CHANNELS; k++) z[i] -= q->l[i][k - i - 1] * z[k];
    }
}

/* The variance of u'z, where u is 0 before first: |D^-1/2 L^-1 u|^2. */
V_INLINE vf variance(const equations *q, int first, vf u[MAP_CHANNELS])
{
    vf sum = {0};
#pragma GCC unroll 9
    for (int i = first; i < MAP_CHANNELS; i++) {
        sum += u[i] * u[i] / q->d[i];
        for (int k = i + 1; k < MAP_CHANNELS; k++) u[k] -= q->l[i][k - i - 1] * u[i];
    }
    return sum;
}

/* Of each group the root of its maps' mean variance, as a share of the prior's. */
V_INLINE void shares(const equations *q, const spread *a, vf share[MAP_GROUPS])
{
    static const int group[SHARED] = {GROUP_ROUGHNESS, GROUP_NORMAL, GROUP_NORMAL}, members[MAP_GROUPS] = {3, 2, 1, 3};
    for (int i = 0; i < MAP_GROUPS; i++) share[i] = v_set(0);
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++) {
            vf u[MAP_CHANNELS] = {0};
            for (int j = 0; j <= c; j++) u[own_at(j) + k] = v_set(a->hue[k][c][j]);
            share[k ? GROUP_SPECULAR : GROUP_DIFFUSE] += variance(q, own_at(c), u);
        }
    for (int i = 0; i < SHARED; i++) {
        vf u[MAP_CHANNELS] = {0};
        u[OWN + i] = v_set(1);
        share[group[i]] += variance(q, OWN + i, u);
    }
    for (int i = 0; i < MAP_GROUPS; i++)
        share[i] = v_sqrt(v_min(share[i] * (1.0f / (float)members[i]), v_set(1)));
}

static void step(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row,
                 const ts_prior *prior, const float *mean, const float *deviation, float *to, float *after)
{
    spread a;
    for (int k = 0; k < 2; k++) factor_of(prior->hue[k], a.hue[k]);
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        const int64_t at = (int64_t)i * row->channels;
        const float *maps = row->maps + at;
        surface s;
        equations q;
        vf z[MAP_CHANNELS], x[MAP_CHANNELS] = {0}, now[MAP_CHANNELS], m[MAP_CHANNELS], share[MAP_GROUPS];
        bool told = false;
        decode(views->guards, maps, row->channels, n, &s);
        v_load_pixels(maps, row->channels, n, MAP_CHANNELS, now);
        v_load_pixels(mean + at, row->channels, n, MAP_CHANNELS, m);
        for (int c = 0; c < MAP_CHANNELS; c++) m[c] -= now[c];
        v_load_pixels(deviation + (int64_t)i * MAP_GROUPS, MAP_GROUPS, n, MAP_GROUPS, a.deviation);
        for (int g = 0; g < MAP_GROUPS; g++)
            a.deviation[g] = v_min(v_max(a.deviation[g], v_set(0)), v_set(TS_PRIOR_WIDEST));
        for (int v = 0; v < count; v++) {
            const bool tells = told ? add(views + v, false, prior, &a, m, row, i, n, images[v], &s, &q)
                                    : add(views + v, true, prior, &a, m, row, i, n, images[v], &s, &q);
            told = told || tells;
        }
        if (told) {
            solve(&q, z);
            widen(&a, z, x);
        }
        for (int c = 0; c < MAP_CHANNELS; c++) x[c] = v_min(v_max(now[c] + (m[c] + x[c]), v_set(-1)), v_set(1)) - now[c];
        v_store_pixels(to + at, row->channels, n, MAP_CHANNELS, x);
        if (!after) continue;
        if (told) shares(&q, &a, share);
        for (int g = 0; g < MAP_GROUPS; g++) share[g] = told ? share[g] * a.deviation[g] : a.deviation[g];
        v_store_pixels(after + (int64_t)i * MAP_GROUPS, MAP_GROUPS, n, MAP_GROUPS, share);
    }
}

const struct ts_posterior_kernels TS_TABLE(posterior) = {.step = step};
