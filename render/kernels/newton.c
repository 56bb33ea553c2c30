/* A colour's rendering depends on five of the nine unknowns: its own diffuse and specular, and roughness and normal,
 * which the colours share. J' W J is never formed. Its factor L D L' begins as the damping and takes up one row of J
 * after the other (Gill, Golub, Murray, Saunders 1974, method C1), which loses half as many digits. */
#include "render/kernels/newton.h"
#include "render/kernels/shade_lanes.h"
#include "tensor/kernels/vmath.h"

enum { SHARED = 3 };
#define STEEPEST 1e6f   /* of a derivative: with a light at the surface products of four would overflow */
#define BRIGHTEST 1e30f /* of a radiance, which may be infinite there */
static const int shared_map[SHARED] = {MAP_ROUGHNESS, MAP_NORMAL, MAP_NORMAL + 1};

enum { ROW = 2 + SHARED };

/* A factor in the order of elimination: a colour's diffuse, its specular, what is shared. L's columns without their 1;
 * L' x = z. */
typedef struct pivot {
    vf d, z, l[ROW - 1];
} pivot;
typedef struct equations {
    pivot own[3][2], shared[SHARED];
} equations;

/* row: the derivatives by the pivot's own map and by the count after it; the pivot takes its share of them and of the
 * error, and what is left weighs less. */
V_INLINE void take_up(pivot *p, vf *row, int count, vf *error, vf *weight)
{
    const vf scaled = *weight * row[0], d = p->d + scaled * row[0], inverse = 1.0f / d, share = scaled * inverse;
    for (int i = 0; i < count; i++) {
        row[i + 1] -= row[0] * p->l[i];
        p->l[i] += share * row[i + 1];
    }
    *error -= row[0] * p->z;
    p->z += share * *error;
    *weight *= p->d * inverse;
    p->d = d;
}

/* The same of a pivot that holds its damping alone. */
V_INLINE void take_first(float damping, pivot *p, const vf *row, int count, vf error, vf *weight)
{
    const vf scaled = *weight * row[0], d = damping + scaled * row[0], inverse = 1.0f / d, share = scaled * inverse;
    for (int i = 0; i < count; i++) p->l[i] = share * row[i + 1];
    p->z = share * error;
    *weight *= damping * inverse;
    p->d = d;
}

V_INLINE vi above_one(vf value) { return ~(value <= v_set(1)); }

/* Saturated: rendering and photograph both. The photograph's true value is unknown. */
V_INLINE vi burnt_out(vf value, vf photograph) { return above_one(value) & (photograph >= v_set(TS_NEWTON_BURNT)); }

/* S10: the radiance, above 1 as 1 + log, and its slope: 0 where both are saturated. A clamp at 1 would have no slope
 * either, and no way back from an over-bright highlight. */
V_INLINE vf exposed(vf value, vf photograph, vf *slope)
{
    const vi bright = above_one(value);
    *slope = v_set(1);
    if (!v_any(bright)) return value;
    const vf above = v_max(v_min(value, v_set(BRIGHTEST)), v_set(1));
    *slope = v_select(burnt_out(value, photograph), v_set(0), 1.0f / above);
    return v_select(bright, v_log(above) + v_set(1), value);
}

/* A colour's derivatives by its own diffuse and specular and by what is shared, for encoded maps; normal[0] times its
 * diffuse, normal[1] times its mirror part. */
V_INLINE void row_of(int c, const surface *s, const lighting *e, const radiance *r, const couplings *k,
                     const vf (*normal)[2], vf slope, vf row[ROW])
{
    const vf ud = slope * diffuse_part(s, c), um = slope * r->fresnel[c];
    row[0] = slope * by_diffuse(s, r, c) * s->slope[MAP_DIFFUSE + c];
    row[1] = slope * by_specular(s, e, r, c) * s->slope[MAP_SPECULAR + c];
    row[2] = um * k->roughness * s->slope[MAP_ROUGHNESS];
    for (int i = 0; i < 2; i++) row[3 + i] = ud * normal[0][i] + um * normal[1][i];
    for (int i = 0; i < ROW; i++) row[i] = v_min(v_max(row[i], v_set(-STEEPEST)), v_set(STEEPEST));
}

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
    lighting e;
    angles g;
    radiance r;
    couplings k;
    vf target[3], normal[2][2], across[2][3];
    light(view, kind, row, first, &e);
    measure(s, &e, kind, &g);
    vi tells = g.seen;
    if (v_any(tells)) {
        shade(view, kind, s, &e, &g, &r);
        v_load_pixels(image + (int64_t)first * 3, 3, n, 3, target);
        tells &= ~(burnt_out(r.value[0], target[0]) & burnt_out(r.value[1], target[1]) &
                   burnt_out(r.value[2], target[2]));
    }
    if (!v_any(tells)) {
        if (first_view) begin(damping, q);
        return;
    }
    couple(kind, s, &e, &g, &r, &k);
    for (int i = 0; i < 3; i++) {
        across[0][i] = k.diffuse_l * g.l[i];
        across[1][i] = k.mirror_l * g.l[i] + k.mirror_v * g.v[i] + k.mirror_h * g.h[i];
    }
    for (int i = 0; i < 2; i++) encode_normal(s, across[i], &normal[i][0], &normal[i][1]);
    for (int c = 0; c < 3; c++) {
        vf by[ROW], slope;
        const vf seen = exposed(r.value[c], target[c], &slope);
        row_of(c, s, &e, &r, &k, (const vf(*)[2])normal, slope, by);
        vf error = target[c] - seen, weight = 1.0f / (v_max(target[c], v_set(0)) + TS_NEWTON_NOISE);
        if (first_view) {
            take_first(damping[MAP_DIFFUSE + c], &q->own[c][0], by, ROW - 1, error, &weight);
            take_first(damping[MAP_SPECULAR + c], &q->own[c][1], by + 1, ROW - 2, error, &weight);
        } else
            for (int i = 0; i < 2; i++) take_up(&q->own[c][i], by + i, ROW - 1 - i, &error, &weight);
        for (int i = 0; i < SHARED; i++) {
            if (first_view && c == 0)
                take_first(damping[shared_map[i]], &q->shared[i], by + 2 + i, SHARED - 1 - i, error, &weight);
            else take_up(&q->shared[i], by + 2 + i, SHARED - 1 - i, &error, &weight);
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
        vf x[MAP_CHANNELS], now[MAP_CHANNELS];
        decode(views->guards, maps, row->channels, n, &s);
        add(views, true, damping, row, i, n, images[0], &s, &q);
        for (int v = 1; v < count; v++) add(views + v, false, damping, row, i, n, images[v], &s, &q);
        solve(&q, x);
        v_load_pixels(maps, row->channels, n, MAP_CHANNELS, now);
        for (int c = 0; c < MAP_CHANNELS; c++) x[c] = v_min(v_max(now[c] + x[c], v_set(-1)), v_set(1)) - now[c];
        v_store_pixels(to + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, x);
    }
}

const struct ts_newton_kernels TS_TABLE(newton) = {.step = step};
