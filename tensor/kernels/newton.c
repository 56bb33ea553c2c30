/* Of nine unknowns a colour's rendering sees five: its own diffuse and specular, and roughness and normal, which the colours share. So the normal
 * equations are three blocks of 2 x 2 and one of 3 x 3 with what couples them: the blocks are eliminated, then 3 x 3 are left. */
#include "tensor/kernels/newton.h"
#include "tensor/kernels/shade_lanes.h"

enum { SHARED = 3 };
#define STEEPEST 1e6f /* of a derivative: with a light at the surface products of four would overflow */
static const int shared_map[SHARED] = {MAP_ROUGHNESS, MAP_NORMAL, MAP_NORMAL + 1};

typedef struct equations {
    vf dd[3], ds[3], ss[3];          /* of a colour's diffuse and specular */
    vf d[3][SHARED], s[3][SHARED];   /* theirs with the shared ones */
    vf own[SHARED][SHARED];          /* lower half */
    vf right_d[3], right_s[3], right[SHARED];
} equations;

V_INLINE void add_view(const ts_shade_view *view, ts_shade_kind kind, const ts_shade_row *row, int first, int n, const float *image, const surface *s, equations *q)
{
    lighting e;
    angles g;
    radiance r;
    vf target[3];
    light(view, kind, row, first, &e);
    measure(s, &e, kind, &g);
    if (!v_any(g.seen)) return;
    shade(view, kind, s, &e, &g, &r);
    v_load_pixels(image + (int64_t)first * 3, 3, n, 3, target);
    for (int c = 0; c < 3; c++) {
        vf u[3] = {0}, j[MAP_CHANNELS];
        slopes d = {0};
        u[c] = v_select(r.value[c] <= v_set(1), v_set(1), v_set(0));
        derive(kind, s, &e, &g, &r, u, &d);
        encode(s, &d, j);
        for (int i = 0; i < MAP_CHANNELS; i++) j[i] = v_min(v_max(j[i], v_set(-STEEPEST)), v_set(STEEPEST));
        const vf w = 1.0f / (v_max(target[c], v_set(0)) + TS_NEWTON_NOISE), error = w * (v_min(r.value[c], v_set(1)) - target[c]);
        const vf jd = j[MAP_DIFFUSE + c], js = j[MAP_SPECULAR + c], wd = w * jd, ws = w * js;
        q->dd[c] += wd * jd;
        q->ds[c] += wd * js;
        q->ss[c] += ws * js;
        q->right_d[c] -= jd * error;
        q->right_s[c] -= js * error;
        for (int a = 0; a < SHARED; a++) {
            const vf ja = j[shared_map[a]];
            q->d[c][a] += wd * ja;
            q->s[c][a] += ws * ja;
            q->right[a] -= ja * error;
            for (int b = 0; b <= a; b++) q->own[a][b] += w * ja * j[shared_map[b]];
        }
    }
}

/* The damping is a lower bound of every pivot; rounding is kept above it. */
V_INLINE void solve(equations *q, const float *damping, vf x[MAP_CHANNELS])
{
    vf inverse[3], dd[3], ss[3], to_d[3][SHARED], to_s[3][SHARED];
    for (int a = 0; a < SHARED; a++) q->own[a][a] += damping[shared_map[a]];
    for (int c = 0; c < 3; c++) {
        const float least_d = damping[MAP_DIFFUSE + c], least_s = damping[MAP_SPECULAR + c];
        dd[c] = q->dd[c] + least_d;
        ss[c] = q->ss[c] + least_s;
        inverse[c] = 1.0f / v_max(dd[c] * ss[c] - q->ds[c] * q->ds[c], v_max(dd[c] * least_s, ss[c] * least_d));
        for (int a = 0; a < SHARED; a++) { /* block^-1 times what couples it */
            to_d[c][a] = (ss[c] * q->d[c][a] - q->ds[c] * q->s[c][a]) * inverse[c];
            to_s[c][a] = (dd[c] * q->s[c][a] - q->ds[c] * q->d[c][a]) * inverse[c];
        }
        for (int a = 0; a < SHARED; a++) {
            for (int b = 0; b <= a; b++) q->own[a][b] -= q->d[c][a] * to_d[c][b] + q->s[c][a] * to_s[c][b];
            q->right[a] -= to_d[c][a] * q->right_d[c] + to_s[c][a] * q->right_s[c];
        }
    }
    vf y[SHARED];
    for (int a = 0; a < SHARED; a++) { /* own = L D L', L below the diagonal */
        y[a] = q->right[a];
        for (int b = 0; b < a; b++) {
            vf l = q->own[a][b];
            for (int k = 0; k < b; k++) l -= q->own[a][k] * q->own[b][k] * q->own[k][k];
            q->own[a][b] = l / q->own[b][b];
            y[a] -= q->own[a][b] * y[b];
        }
        for (int k = 0; k < a; k++) q->own[a][a] -= q->own[a][k] * q->own[a][k] * q->own[k][k];
        q->own[a][a] = v_max(q->own[a][a], v_set(damping[shared_map[a]]));
    }
    for (int a = SHARED - 1; a >= 0; a--) {
        y[a] /= q->own[a][a];
        for (int b = a + 1; b < SHARED; b++) y[a] -= q->own[b][a] * y[b];
        x[shared_map[a]] = y[a];
    }
    for (int c = 0; c < 3; c++) {
        vf d = (ss[c] * q->right_d[c] - q->ds[c] * q->right_s[c]) * inverse[c], s = (dd[c] * q->right_s[c] - q->ds[c] * q->right_d[c]) * inverse[c];
        for (int a = 0; a < SHARED; a++) {
            d -= to_d[c][a] * y[a];
            s -= to_s[c][a] * y[a];
        }
        x[MAP_DIFFUSE + c] = d;
        x[MAP_SPECULAR + c] = s;
    }
}

static void step(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row, const float *damping, float *to)
{
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        const float *maps = row->maps + (int64_t)i * row->channels;
        surface s;
        equations q = {0};
        vf x[MAP_CHANNELS], now[MAP_CHANNELS];
        decode(views->guards, maps, row->channels, n, &s);
        for (int v = 0; v < count; v++) {
            if (views[v].kind == TS_SHADE_COLLOCATED) add_view(&views[v], TS_SHADE_COLLOCATED, row, i, n, images[v], &s, &q);
            else add_view(&views[v], TS_SHADE_POSITIONS, row, i, n, images[v], &s, &q);
        }
        solve(&q, damping, x);
        v_load_pixels(maps, row->channels, n, MAP_CHANNELS, now);
        for (int c = 0; c < MAP_CHANNELS; c++) x[c] = v_min(v_max(now[c] + x[c], v_set(-1)), v_set(1)) - now[c];
        v_store_pixels(to + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, x);
    }
}

const struct ts_newton_kernels TS_TABLE(newton) = {.step = step};
