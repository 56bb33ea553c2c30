/* A colour's rendering depends on five of the nine unknowns: its own diffuse and specular, and roughness and normal,
 * which the colours share. J' W J is never formed. Its factor L D L' begins as the damping and takes up one row of J
 * after the other (Gill, Golub, Murray, Saunders 1974, method C1), which loses half as many digits. */
#include "render/kernels/observe_lanes.h"

/* A factor in the order of elimination: a colour's diffuse, its specular, what is shared. L's columns without their 1;
 * L' x = z. */
typedef struct pivot {
    vf d, z, l[ROW - 1];
} pivot;
typedef struct equations {
    pivot own[3][2], shared[SHARED];
} equations;

V_INLINE void none(pivot *p, float damping)
{
    p->d = v_set(damping);
    p->z = v_set(0);
    for (int i = 0; i < ROW - 1; i++) p->l[i] = v_set(0);
}

V_INLINE void begin(const float *damping, equations *q)
{
    for (int c = 0; c < 3; c++) {
        none(&q->own[c][0], damping[MAP_DIFFUSE + c]);
        none(&q->own[c][1], damping[MAP_SPECULAR + c]);
    }
    for (int i = 0; i < SHARED; i++) none(&q->shared[i], damping[shared_map[i]]);
}

/* first_view: q is unset. */
V_INLINE void add_view(const ts_shade_view *view, ts_shade_kind kind, bool first_view, const float *damping,
                       const ts_shade_row *row, int first, int n, const float *image, const surface *s, equations *q)
{
    sight t;
    if (!look(view, kind, row, first, n, false, 0, image, s, &t)) {
        if (first_view) begin(damping, q);
        return;
    }
    for (int c = 0; c < 3; c++) {
        vf by[ROW], slope, error = residual(c, s, &t, 0, by, &slope),
                           weight = 1.0f / (v_max(t.target[c], v_set(0)) + TS_NEWTON_NOISE);
        pivot *own = q->own[c], *shared = q->shared;
        if (first_view) {
            take_first(damping[MAP_DIFFUSE + c], &own->d, &own->z, own->l, by, ROW - 1, error, &weight);
            own++;
            take_first(damping[MAP_SPECULAR + c], &own->d, &own->z, own->l, by + 1, ROW - 2, error, &weight);
        } else
            for (int i = 0; i < 2; i++) take_up(&own[i].d, &own[i].z, own[i].l, by + i, ROW - 1 - i, &error, &weight);
        for (int i = 0; i < SHARED; i++) {
            pivot *p = &shared[i];
            if (first_view && c == 0)
                take_first(damping[shared_map[i]], &p->d, &p->z, p->l, by + 2 + i, SHARED - 1 - i, error, &weight);
            else take_up(&p->d, &p->z, p->l, by + 2 + i, SHARED - 1 - i, &error, &weight);
        }
    }
}

V_INLINE void add(const ts_shade_view *view, bool first_view, const float *damping, const ts_shade_row *row, int first,
                  int n, const float *image, const surface *s, equations *q)
{
    if (view->kind == TS_SHADE_COLLOCATED)
        add_view(view, TS_SHADE_COLLOCATED, first_view, damping, row, first, n, image, s, q);
    else add_view(view, TS_SHADE_POSITIONS, first_view, damping, row, first, n, image, s, q);
}

V_INLINE void solve(const equations *q, vf x[MAP_CHANNELS])
{
    vf y[SHARED];
    for (int i = SHARED - 1; i >= 0; i--) {
        y[i] = q->shared[i].z;
        for (int k = i + 1; k < SHARED; k++) y[i] -= q->shared[i].l[k - i - 1] * y[k];
        x[shared_map[i]] = y[i];
    }
    for (int c = 0; c < 3; c++) {
        vf s = q->own[c][1].z, d = q->own[c][0].z;
        for (int k = 0; k < SHARED; k++) s -= q->own[c][1].l[k] * y[k];
        d -= q->own[c][0].l[0] * s;
        for (int k = 0; k < SHARED; k++) d -= q->own[c][0].l[1 + k] * y[k];
        x[MAP_SPECULAR + c] = s;
        x[MAP_DIFFUSE + c] = d;
    }
}

static void step(const ts_shade_view *views, const float *const *images, int count, const ts_shade_row *row,
                 const float *damping, float *to)
{
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        const float *maps = row->maps + (int64_t)i * row->channels;
        surface s;
        equations q;
        vf x[MAP_CHANNELS], now[MAP_CHANNELS], at[MAP_CHANNELS];
        v_load_pixels(maps, row->channels, n, MAP_CHANNELS, now);
        within(now, at);
        decode_values(views->guards, at, &s);
        add(views, true, damping, row, i, n, images[0], &s, &q);
        for (int v = 1; v < count; v++) add(views + v, false, damping, row, i, n, images[v], &s, &q);
        solve(&q, x);
        for (int c = 0; c < MAP_CHANNELS; c++) x[c] = v_min(v_max(at[c] + x[c], v_set(-1)), v_set(1)) - now[c];
        v_store_pixels(to + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, x);
    }
}

const struct ts_newton_kernels TS_TABLE(newton) = {.step = step};
