/* One photograph's three values are taken as they are. The values of several are taken up one after the other by a
 * factor L D L' of the equations, as in newton.c. */
#include "render/kernels/posterior.h"
#include "render/kernels/prior_lanes.h"

/* Row i of the factor has MAP_CHANNELS - 1 - i values beside its 1. */
typedef struct equations {
    vf d[MAP_CHANNELS], z[MAP_CHANNELS], l[MAP_CHANNELS][MAP_CHANNELS - 1];
} equations;

/* Of a pixel's white unknowns: the mean, and of each group of A z the mean variance as a share of the prior's. misfit:
 * of the maps as they are, sum r^2 / S of several photographs. */
typedef struct estimate {
    vf z[MAP_CHANNELS], share[MAP_GROUPS], misfit;
} estimate;

static const int shared_group[SHARED] = {GROUP_ROUGHNESS, GROUP_NORMAL, GROUP_NORMAL};

/* A colour's row of J A, and its residual at the prior's mean, which is m from the maps; plain: at the maps. */
V_INLINE vf observe(int c, const surface *s, const sight *t, const spread *a, const vf m[MAP_CHANNELS],
                    vf h[MAP_CHANNELS], vf *plain)
{
    vf by[ROW], slope, error = residual(c, s, t, TS_PRIOR_FADE, by, &slope);
    error *= confidence(t->r.value[c], t->target[c], TS_PRIOR_FADE);
    *plain = error;
    error -= by[0] * m[MAP_DIFFUSE + c] + by[1] * m[MAP_SPECULAR + c];
    for (int i = 0; i < SHARED; i++) error -= by[2 + i] * m[shared_map[i]];
    whiten(c, a, by, h);
    return error;
}

/* By one photograph. doubts: share is wanted. */
V_INLINE void settle(const surface *s, const sight *t, const ts_prior *prior, const spread *a, const vf m[MAP_CHANNELS],
                     bool doubts, estimate *e)
{
    gram g;
    vf error[3], variance[3], plain, sum[2][3] = {{{0}}};
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        error[c] = observe(c, s, t, a, m, g.u[c], &plain);
        variance[c] = variance_of(t->target[c], prior);
    }
    orthogonalise(variance, &g);
    forward(&g, error);
    for (int i = 0; i < MAP_CHANNELS; i++) e->z[i] = v_set(0);
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        const vf share = error[c] * g.inverse[c];
        for (int i = own_at(c); i < MAP_CHANNELS; i++) e->z[i] += g.u[c][i] * share;
    }
    if (!doubts) return;
    e->share[GROUP_NORMAL] = e->share[GROUP_ROUGHNESS] = v_set(1);
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) { /* what u[c] tells of each value */
        for (int i = 0; i < SHARED; i++)
            e->share[shared_group[i]] -= g.u[c][OWN + i] * g.u[c][OWN + i] * g.inverse[c] * (i ? 0.5f : 1);
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < 3; i++) {
                vf along = {0};
                for (int j = 0; j <= (i < c ? i : c); j++) along += a->hue[k][i][j] * g.u[c][own_at(j) + k];
                sum[k][i] += along * along * g.inverse[c] * a->tint[k][i] * a->tint[k][i];
            }
    }
    e->share[GROUP_DIFFUSE] = 1.0f - (sum[0][0] + sum[0][1] + sum[0][2]) * (1.0f / 3);
    e->share[GROUP_SPECULAR] = 1.0f - (sum[1][0] + sum[1][1] + sum[1][2]) * (1.0f / 3);
}

/* Adds a photograph; first_view: q is unset. */
V_INLINE void take(const surface *s, const sight *t, bool first_view, const ts_prior *prior, const spread *a,
                   const vf m[MAP_CHANNELS], equations *q, vf *misfit)
{
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        vf h[MAP_CHANNELS], plain, error = observe(c, s, t, a, m, h, &plain),
                                   weight = 1.0f / variance_of(t->target[c], prior);
        *misfit += plain * plain * weight;
#pragma GCC unroll 9
        for (int i = own_at(c); i < MAP_CHANNELS; i++) {
            if (first_view && (c == 0 || i < own_at(c) + 2))
                take_first(1, &q->d[i], &q->z[i], q->l[i], h + i, MAP_CHANNELS - 1 - i, error, &weight);
            else take_up(&q->d[i], &q->z[i], q->l[i], h + i, MAP_CHANNELS - 1 - i, &error, &weight);
        }
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

/* L' z = q->z, and the variances. */
V_INLINE void solve(const equations *q, const spread *a, bool doubts, estimate *e)
{
#pragma GCC unroll 9
    for (int i = MAP_CHANNELS - 1; i >= 0; i--) {
        e->z[i] = q->z[i];
        for (int k = i + 1; k < MAP_CHANNELS; k++) e->z[i] -= q->l[i][k - i - 1] * e->z[k];
    }
    if (!doubts) return;
    for (int g = 0; g < MAP_GROUPS; g++) e->share[g] = v_set(0);
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++) {
            vf u[MAP_CHANNELS] = {0};
            for (int j = 0; j <= c; j++) u[own_at(j) + k] = v_set(a->hue[k][c][j]);
            e->share[k ? GROUP_SPECULAR : GROUP_DIFFUSE] += variance(q, own_at(c), u) * a->tint[k][c] * a->tint[k][c] *
                (1.0f / 3);
        }
    for (int i = 0; i < SHARED; i++) {
        vf u[MAP_CHANNELS] = {0};
        u[OWN + i] = v_set(1);
        e->share[shared_group[i]] += variance(q, OWN + i, u) * (i ? 0.5f : 1);
    }
}

/* A z */
V_INLINE void widen(const spread *a, const vf z[MAP_CHANNELS], vf x[MAP_CHANNELS])
{
    for (int c = 0; c < 3; c++) {
        vf sum[2] = {{0}, {0}};
        for (int j = 0; j <= c; j++)
            for (int k = 0; k < 2; k++) sum[k] += a->hue[k][c][j] * z[own_at(j) + k];
        x[MAP_DIFFUSE + c] = sum[0] * a->deviation[GROUP_DIFFUSE] * a->tint[0][c];
        x[MAP_SPECULAR + c] = sum[1] * a->deviation[GROUP_SPECULAR] * a->tint[1][c];
    }
    for (int i = 0; i < SHARED; i++) x[shared_map[i]] = z[OWN + i] * a->deviation[shared_group[i]];
}

V_INLINE bool look_at(const ts_shade_view *view, const ts_shade_row *row, int first, int n, bool dark,
                      const float *image, const surface *s, sight *t)
{
    return view->kind == TS_SHADE_COLLOCATED
        ? look(view, TS_SHADE_COLLOCATED, row, first, n, dark, TS_PRIOR_FADE, image, s, t)
        : look(view, TS_SHADE_POSITIONS, row, first, n, dark, TS_PRIOR_FADE, image, s, t);
}

/* False where no photograph tells anything. Of several, maps without light that a photograph shows bright misfit. */
V_INLINE bool learn(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row,
                    int first, int n, const surface *s, const ts_prior *prior, const spread *a,
                    const vf m[MAP_CHANNELS], bool doubts, estimate *e)
{
    equations q;
    sight t;
    bool informed = false;
    e->misfit = v_set(0);
    if (count == 1) {
        if (!look_at(views, row, first, n, false, images[0], s, &t)) return false;
        settle(s, &t, prior, a, m, doubts, e);
        return true;
    }
    for (int v = 0; v < count; v++) {
        if (!look_at(views + v, row, first, n, true, images[v], s, &t)) continue;
        if (informed) take(s, &t, false, prior, a, m, &q, &e->misfit);
        else take(s, &t, true, prior, a, m, &q, &e->misfit);
        informed = true;
    }
    if (informed) solve(&q, a, doubts, e);
    return informed;
}

/* m' Sigma^-1 m: |z|^2 of m = A z. */
V_INLINE vf improbability(const spread *a, const vf m[MAP_CHANNELS])
{
    const vf least = v_set(TS_PRIOR_NARROWEST);
    vf sum = {0};
    for (int k = 0; k < 2; k++) {
        const int map = k ? MAP_SPECULAR : MAP_DIFFUSE;
        const vf deviation = v_max(a->deviation[k ? GROUP_SPECULAR : GROUP_DIFFUSE], least);
        vf z[3];
        for (int i = 0; i < 3; i++) {
            z[i] = m[map + i] / (deviation * a->tint[k][i]);
            for (int j = 0; j < i; j++) z[i] -= z[j] * a->hue[k][i][j];
            z[i] /= fmaxf(a->hue[k][i][i], TS_PRIOR_NARROWEST);
            sum += z[i] * z[i];
        }
    }
    for (int i = 0; i < SHARED; i++) {
        const vf z = m[shared_map[i]] / v_max(a->deviation[shared_group[i]], least);
        sum += z * z;
    }
    return sum;
}

/* From where the maps are now, of the given misfit, x or back. */
V_INLINE void choose(const ts_search *search, int i, int n, vf misfit, const vf now[MAP_CHANNELS], vf x[MAP_CHANNELS])
{
    vf best[MAP_CHANNELS], least = misfit;
    float *from = search->best + (int64_t)i * MAP_CHANNELS;
    if (search->begun) {
        v_load_pixels(from, MAP_CHANNELS, n, MAP_CHANNELS, best);
        v_load_pixels(search->misfit + i, 1, n, 1, &least);
    }
    const vi better = search->begun ? misfit <= least : v_seti(-1);
    for (int c = 0; c < MAP_CHANNELS; c++) {
        const vf back = search->begun ? (best[c] - now[c]) * (1 - TS_SEARCH_BACK) : x[c];
        x[c] = v_select(better, x[c], back);
        best[c] = search->begun ? v_select(better, now[c], best[c]) : now[c];
    }
    least = v_select(better, misfit, least);
    v_store_pixels(from, MAP_CHANNELS, n, MAP_CHANNELS, best);
    v_store_pixels(search->misfit + i, 1, n, 1, &least);
}

static void step(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row,
                 const ts_prior *prior, const float *mean, const float *deviation, float length,
                 const ts_search *search, float *to, float *after)
{
    spread a;
    set_hue(prior, &a);
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        const int64_t first = (int64_t)i * row->channels;
        const float *maps = row->maps + first;
        surface s;
        estimate e;
        vf x[MAP_CHANNELS] = {0}, now[MAP_CHANNELS], at[MAP_CHANNELS], m[MAP_CHANNELS], left[MAP_GROUPS], colour[6];
        v_load_pixels(maps, row->channels, n, MAP_CHANNELS, now);
        within(now, at);
        decode_values(views->guards, at, &s);
        v_load_pixels(mean + first, row->channels, n, MAP_CHANNELS, m);
        load_deviation(deviation + (int64_t)i * MAP_GROUPS, n, &a);
        for (int c = 0; c < 6; c++) {
            const vf value = m[(c < 3 ? MAP_DIFFUSE : MAP_SPECULAR - 3) + c];
            colour[c] = (v_min(v_max(value, v_set(-1)), v_set(1)) + 1.0f) * 0.5f;
        }
        set_colours(colour, colour + 3, prior->share, &a);
        for (int c = 0; c < MAP_CHANNELS; c++) m[c] -= at[c];
        const bool informed = learn(views, images, count, row, i, n, &s, prior, &a, m, after != NULL, &e);
        if (informed) widen(&a, e.z, x);
        for (int c = 0; c < MAP_CHANNELS; c++)
            x[c] = (v_min(v_max(at[c] + (m[c] + x[c]), v_set(-1)), v_set(1)) - now[c]) * length;
        if (search) choose(search, i, n, (informed ? e.misfit : v_set(0)) + improbability(&a, m), now, x);
        v_store_pixels(to + first, row->channels, n, MAP_CHANNELS, x);
        if (!after) continue;
        for (int g = 0; g < MAP_GROUPS; g++) {
            left[g] = a.deviation[g];
            if (informed) left[g] *= v_sqrt(v_min(v_max(e.share[g], v_set(0)), v_set(1)));
        }
        v_store_pixels(after + (int64_t)i * MAP_GROUPS, MAP_GROUPS, n, MAP_GROUPS, left);
    }
}

const struct ts_posterior_kernels TS_TABLE(posterior) = {.step = step};
