/* What a photograph says of VL pixels' maps: three observations a pixel, each a residual and its derivatives by the
 * five maps that its colour depends on, and how a factor takes them up. */
#ifndef TS_OBSERVE_LANES_H
#define TS_OBSERVE_LANES_H
#include "render/kernels/newton.h"
#include "render/kernels/shade_lanes.h"
#include "tensor/kernels/vmath.h"

enum { SHARED = 3, ROW = 2 + SHARED }; /* a colour's diffuse, its specular, what the colours share */
#define STEEPEST 1e6f   /* of a derivative: with a light at the surface products of four would overflow */
#define BRIGHTEST 1e30f /* of a radiance, which may be infinite there */
static const int shared_map[SHARED] = {MAP_ROUGHNESS, MAP_NORMAL, MAP_NORMAL + 1};

/* The maps that a step starts from: those in [-1, 1]. Outside, the radiance has no slope, and what a map tells nothing
 * of is not solved for. Steps that are cut end at the edge, but for rounding, which would then decide what is solved
 * for: single values differed by 0.016 between instruction sets. */
V_INLINE void within(const vf now[MAP_CHANNELS], vf at[MAP_CHANNELS])
{
    for (int c = 0; c < MAP_CHANNELS; c++) at[c] = v_min(v_max(now[c], v_set(-1)), v_set(1));
}

/* A row of the factor L D L' without its 1, and of L D z. row: the derivatives by the row's own unknown and by the
 * count after it; the factor takes its share of them and of the error, and what is left weighs less. */
V_INLINE void take_up(vf *d, vf *z, vf *l, vf *row, int count, vf *error, vf *weight)
{
    const vf scaled = *weight * row[0], sum = *d + scaled * row[0], inverse = 1.0f / sum, share = scaled * inverse;
    for (int i = 0; i < count; i++) {
        row[i + 1] -= row[0] * l[i];
        l[i] += share * row[i + 1];
    }
    *error -= row[0] * *z;
    *z += share * *error;
    *weight *= *d * inverse;
    *d = sum;
}

/* The same of a row that holds its damping alone. */
V_INLINE void take_first(float damping, vf *d, vf *z, vf *l, const vf *row, int count, vf error, vf *weight)
{
    const vf scaled = *weight * row[0], sum = damping + scaled * row[0], inverse = 1.0f / sum, share = scaled * inverse;
    for (int i = 0; i < count; i++) l[i] = share * row[i + 1];
    *z = share * error;
    *weight *= damping * inverse;
    *d = sum;
}

V_INLINE vi above_one(vf value) { return ~(value <= v_set(1)); }

/* Where the photograph is burnt out as well, its value may stand for more: nothing follows from it. */
V_INLINE vi burnt_out(vf value, vf photograph) { return above_one(value) & (photograph >= v_set(TS_NEWTON_BURNT)); }

/* How much a value tells where both are burnt out: less from 1 on, nothing from 1 + fade on. With a fade of 0 one
 * rounding more or less decides what a pixel's step is. */
V_INLINE vf confidence(vf value, vf photograph, float fade)
{
    const vf left = fade > 0 ? v_max((1 + fade - value) * (1 / fade), v_set(0)) : v_set(0);
    return v_select(burnt_out(value, photograph), left, v_set(1));
}

/* The radiance as the equations see it, and its slope times the confidence: above 1 its logarithm, which leads back
 * from a highlight of thousands in a few steps, where the clamp has no slope. */
V_INLINE vf exposed(vf value, vf photograph, float fade, vf *slope)
{
    const vi bright = above_one(value);
    *slope = v_set(1);
    if (!v_any(bright)) return value;
    const vf above = v_max(v_min(value, v_set(BRIGHTEST)), v_set(1));
    *slope = confidence(value, photograph, fade) / above;
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

/* A view of VL pixels and the photograph of it. */
typedef struct sight {
    lighting e;
    angles g;
    radiance r;
    couplings k;
    vf target[3], normal[2][2];
} sight;

/* False where none of the pixels tells anything: then only what does not depend on the maps is set. dark: those without
 * light do. */
V_INLINE bool look(const ts_shade_view *view, ts_shade_kind kind, const ts_shade_row *row, int first, int n, bool dark,
                   float fade, const float *image, const surface *s, sight *t)
{
    const bool surrounded = view->ambient != 0;
    vf across[2][3];
    light(view, kind, row, first, &t->e);
    measure(s, &t->e, kind, &t->g);
    vi tells = dark ? v_seti(-1) : lit(surrounded, &t->g);
    if (!v_any(tells)) return false;
    shade(view, kind, surrounded, s, &t->e, &t->g, &t->r);
    v_load_pixels(image + (int64_t)first * 3, 3, n, 3, t->target);
    vf most = confidence(t->r.value[0], t->target[0], fade);
    for (int c = 1; c < 3; c++) most = v_max(most, confidence(t->r.value[c], t->target[c], fade));
    tells &= most > v_set(0);
    if (!v_any(tells)) return false;
    couple(kind, s, &t->e, &t->g, &t->r, &t->k);
    for (int i = 0; i < 3; i++) {
        across[0][i] = t->k.diffuse_l * t->g.l[i];
        across[1][i] = t->k.mirror_l * t->g.l[i] + t->k.mirror_v * t->g.v[i] + t->k.mirror_h * t->g.h[i];
    }
    for (int i = 0; i < 2; i++) encode_normal(s, across[i], &t->normal[i][0], &t->normal[i][1]);
    return true;
}

/* A colour's residual; slope: of exposed. */
V_INLINE vf residual(int c, const surface *s, const sight *t, float fade, vf row[ROW], vf *slope)
{
    const vf seen = exposed(t->r.value[c], t->target[c], fade, slope);
    row_of(c, s, &t->e, &t->r, &t->k, (const vf(*)[2])t->normal, *slope, row);
    return t->target[c] - seen;
}
#endif
