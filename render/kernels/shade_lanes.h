/* Shading of VL pixels in the lanes and its derivatives, for the kernels that include it. See render/brdf.h for the
 * equations, render/kernels/shade.h for what is double and why. */
#ifndef TS_SHADE_LANES_H
#define TS_SHADE_LANES_H
#include "render/kernels/pixels.h"
#include "render/kernels/view.h"
#include "tensor/kernels/vmath.h"
#include "tensor/maps.h"

#define INV_PI 0.318309886f

/* A vector in space, for VL / 2 pixels. */
typedef struct direction {
    vd x, y, z;
} direction;

V_INLINE vd dot(direction a, direction b) { return d_fma(a.x, b.x, d_fma(a.y, b.y, a.z * b.z)); }

V_INLINE direction cross(direction a, direction b)
{
    return (direction){d_fma(a.y, b.z, -(a.z * b.y)), d_fma(a.z, b.x, -(a.x * b.z)), d_fma(a.x, b.y, -(a.y * b.x))};
}

/* The zero vector stays zero. *inverse: 1 / length. */
V_INLINE direction unit(direction a, vd *inverse)
{
    *inverse = d_rsqrt(d_max(dot(a, a), d_set(1e-200)));
    return (direction){a.x * *inverse, a.y * *inverse, a.z * *inverse};
}

/* Decoded maps of VL pixels. */
typedef struct surface {
    vf diffuse[3], specular[3], roughness, slope[MAP_CHANNELS];
    direction n[2];
    vf nx, ny, nz, inverse; /* n again, and 1 / n_z, or in the guard 1 / length */
    vi guard;
    bool guarded; /* in any lane */
} surface;

/* x: encoded maps; they become what is in [-1, 1], which NaN is not. */
V_INLINE void decode_values(const ts_shade_guards *guards, vf x[MAP_CHANNELS], surface *s)
{
    for (int i = 0; i < MAP_CHANNELS; i++) {
        vi inside = (x[i] >= v_set(-1)) & (x[i] <= v_set(1));
        x[i] = v_min(v_max(x[i], v_set(-1)), v_set(1)); /* NaN becomes -1 */
        s->slope[i] = v_select(inside, v_set(i == MAP_NORMAL || i == MAP_NORMAL + 1 ? 1.0f : 0.5f), v_set(0));
    }
    for (int c = 0; c < 3; c++) {
        s->diffuse[c] = x[MAP_DIFFUSE + c] * 0.5f + 0.5f;
        s->specular[c] = x[MAP_SPECULAR + c] * 0.5f + 0.5f;
    }
    vf least = v_set((float)guards->roughness), r = x[MAP_ROUGHNESS] * 0.5f + 0.5f;
    s->slope[MAP_ROUGHNESS] = v_select(r < least, v_set(0), s->slope[MAP_ROUGHNESS]);
    s->roughness = v_max(r, least);

    vd nx[2], ny[2], nz[2], inverse[2], low[2];
    d_split(x[MAP_NORMAL], nx);
    d_split(x[MAP_NORMAL + 1], ny);
    for (int h = 0; h < 2; h++) {
        vd z2 = 1.0 - nx[h] * nx[h] - ny[h] * ny[h];
        low[h] = d_select(z2 < d_set(guards->nz2), d_set(1), d_set(0));
        z2 = d_max(z2, d_set(guards->nz2));
        inverse[h] = d_rsqrt(z2);
        nz[h] = z2 * inverse[h];
    }
    s->guard = d_join(low) > v_set(0);
    s->guarded = v_any(s->guard);
    for (int h = 0; h < 2; h++) {
        if (s->guarded) { /* elsewhere the length is 1 */
            vq here = low[h] > d_set(0);
            vd i;
            direction m = unit((direction){nx[h], ny[h], nz[h]}, &i);
            nx[h] = d_select(here, m.x, nx[h]);
            ny[h] = d_select(here, m.y, ny[h]);
            nz[h] = d_select(here, m.z, nz[h]);
            inverse[h] = d_select(here, i, inverse[h]);
        }
        s->n[h] = (direction){nx[h], ny[h], nz[h]};
    }
    s->nx = d_join(nx), s->ny = d_join(ny), s->nz = d_join(nz), s->inverse = d_join(inverse);
}

V_INLINE void decode(const ts_shade_guards *guards, const float *maps, int channels, int n, surface *s)
{
    vf x[MAP_CHANNELS];
    v_load_pixels(maps, channels, n, MAP_CHANNELS, x);
    decode_values(guards, x, s);
}

/* One view at VL pixels, for any material. */
typedef struct lighting {
    direction l[2], v[2], h[2];
    vf strength, fresnel; /* F = s + (1 - s) fresnel */
} lighting;

V_INLINE bool one_place(ts_shade_kind kind) { return kind == TS_SHADE_COLLOCATED || kind == TS_SHADE_PUBLISHED; }

V_INLINE void light(const ts_shade_view *view, ts_shade_kind kind, const ts_shade_row *row, int first, lighting *e)
{
    vd inverse[2], lz[2], vdoth[2];
    for (int h = 0; h < 2; h++) {
        direction l = {d_set(view->light[0]), d_set(view->light[1]), d_set(view->light[2])};
        direction v = {d_set(view->camera[0]), d_set(view->camera[1]), d_set(view->camera[2])};
        if (kind == TS_SHADE_DIRECTIONS) {
            e->l[h] = l;
            e->v[h] = v;
            e->h[h] = (direction){d_set(view->half[0]), d_set(view->half[1]), d_set(view->half[2])};
            continue;
        }
        vd x = d_count(row->column + first + h * VL / 2 + 0.5) * row->step - 0.5, y = d_set(row->y), i;
        e->l[h] = l = unit((direction){l.x - x, l.y - y, l.z}, &inverse[h]);
        lz[h] = l.z;
        if (one_place(kind)) {
            e->v[h] = e->h[h] = l;
            continue;
        }
        e->v[h] = v = unit((direction){v.x - x, v.y - y, v.z}, &i);
        direction sum = {l.x + v.x, l.y + v.y, l.z + v.z};
        e->h[h] = unit(sum, &i);
        vdoth[h] = dot(sum, sum) * i * 0.5; /* |l + v|^2 = 2 v.(l + v) */
    }
    if (kind == TS_SHADE_DIRECTIONS) {
        e->strength = v_set(view->power);
    } else if (view->falloff) {
        vf i = d_join(inverse);
        e->strength = v_min(i * i, v_set((float)(1 / view->guards->distance2))) * view->power;
    } else {
        e->strength = view->power / v_max(d_join(lz), v_set((float)view->guards->lz));
    }
    if (kind == TS_SHADE_POSITIONS) {
        vf c = d_join(vdoth);
        e->fresnel = v_exp2((-5.55473f * c - 6.98316f) * c);
    } else {
        e->fresnel = v_set(view->fresnel);
    }
}

/* The angles between a surface and a view's directions. n x a gives the derivatives of n.a, too. */
typedef struct angles {
    vf nl, nv, nh, sine2;
    vf l[3], v[3], h[3]; /* n x l, n x v, n x h */
    vi seen;
} angles;

V_INLINE void cross_lanes(const surface *s, const direction a[2], vf out[3])
{
    vd x[2], y[2], z[2];
    for (int h = 0; h < 2; h++) {
        direction c = cross(s->n[h], a[h]);
        x[h] = c.x, y[h] = c.y, z[h] = c.z;
    }
    out[0] = d_join(x), out[1] = d_join(y), out[2] = d_join(z);
}

V_INLINE vf dot_lanes(const surface *s, const direction a[2])
{
    vd d[2] = {dot(s->n[0], a[0]), dot(s->n[1], a[1])};
    return d_join(d);
}

V_INLINE void measure(const surface *s, const lighting *e, ts_shade_kind kind, angles *a)
{
    a->nl = a->nv = v_max(dot_lanes(s, e->l), v_set(0));
    cross_lanes(s, e->h, a->h);
    a->sine2 = v_fma(a->h[0], a->h[0], v_fma(a->h[1], a->h[1], a->h[2] * a->h[2]));
    if (one_place(kind)) {
        a->seen = a->nl > v_set(0);
        a->nh = v_select(a->seen, a->nl, v_set(1));
        for (int i = 0; i < 3; i++) a->l[i] = a->v[i] = a->h[i];
        return;
    }
    a->nv = v_max(dot_lanes(s, e->v), v_set(0));
    /* Above the horizon of both n.h > 0, unless l and v are opposite and h is what rounding left, 0 at worst: D would
     * be 0 / 0. */
    vf nh = dot_lanes(s, e->h);
    a->seen = (a->nl > v_set(0)) & (a->nv > v_set(0)) & (nh > v_set(0));
    a->nh = v_select(a->seen, nh, v_set(1));
    cross_lanes(s, e->l, a->l);
    cross_lanes(s, e->v, a->v);
}

/* Where there is radiance. surrounded, here and below: view->ambient is not 0. Where it is a constant, what it does not
 * need is not compiled. */
V_INLINE vi lit(bool surrounded, const angles *g) { return surrounded ? v_seti(-1) : g->seen; }

/* Radiance, and what its derivatives are made of. */
typedef struct radiance {
    vf value[3], fresnel[3], scale; /* value = f scale, and what ambient light adds */
    vf lobe, a, k, i, il, iv; /* lobe = D G / 4; alpha; G's k; 1 / (alpha^2 (n.h)^2 + |n x h|^2); 1 / G's factors */
    bool surrounded;
    float ambient;
    vf guarded,
        cosine; /* what TS_SHADE_PUBLISHED adds to the derivatives of log lobe by log alpha / 2 and by each cosine */
} radiance;

V_INLINE void shade(const ts_shade_view *view, ts_shade_kind kind, bool surrounded, const surface *s, const lighting *e,
                    const angles *g, radiance *r)
{
    const bool published = kind == TS_SHADE_PUBLISHED;
    r->a = TS_ALPHA(s->roughness);
    vf a2 = r->a * r->a, k = r->k = published ? r->a * 0.5f + (float)view->guards->k : r->a * 0.5f;
    vf inner = a2 * (g->nh * g->nh) + g->sine2;
    r->il = 1.0f /
        v_fma(g->nl, 1.0f - k, k); /* v_fma: the same bytes in every loop, so that a perfect fit has an error of 0 */
    r->iv = 1.0f / v_fma(g->nv, 1.0f - k, k);
    if (published) { /* the oracle in render/brdf.c has the same terms by the same names */
        const float guard = (float)view->guards->distribution, least = (float)view->guards->cosines;
        vf below = 1.0f / (inner * inner * (1 / INV_PI) + guard), cosines = 1.0f / (4.0f * (g->nl * g->nv) + least);
        r->i = inner * below * (1 / INV_PI);
        r->lobe = a2 * below * (r->il * r->iv) * (g->nl * g->nv * cosines);
        r->guarded = guard * below;
        r->cosine = least * cosines / v_max(g->nl, v_set(1e-20f)); /* unseen where n.l = 0 */
    } else {
        r->i = 1.0f / inner;
        r->lobe = (a2 * r->i) * r->i * (r->il * r->iv) * (0.25f * INV_PI);
    }
    r->scale = v_select(g->seen, e->strength * g->nl, v_set(0));
    r->surrounded = surrounded;
    r->ambient = view->ambient;
    for (int c = 0; c < 3; c++) {
        r->fresnel[c] = s->specular[c] + (1.0f - s->specular[c]) * e->fresnel;
        r->value[c] = v_fma(r->lobe, r->fresnel[c], (1.0f - s->specular[c]) * s->diffuse[c] * INV_PI) * r->scale;
        if (surrounded) r->value[c] += view->ambient * (s->specular[c] + (1.0f - s->specular[c]) * s->diffuse[c]);
    }
}

/* Common factors of the colours' derivatives. Of a colour with the diffuse part ud = (1 - s) diffuse / pi and
 * the mirror part um = F, the one by roughness is um roughness, and by n, as n x (d / d n), ud diffuse_l n x l + um
 * (mirror_l n x l + mirror_v n x v + mirror_h n x h). */
typedef struct couplings {
    vf roughness, diffuse_l, mirror_l, mirror_v, mirror_h;
} couplings;

V_INLINE void couple(ts_shade_kind kind, const surface *s, const lighting *e, const angles *g, const radiance *r,
                     couplings *c)
{
    const bool published = kind == TS_SHADE_PUBLISHED;
    const vf k = r->k, an = r->a * g->nh, log_d = (g->sine2 - an * an) * r->i,
             mirror = r->lobe * r->scale; /* times d log lobe */
    const vf log_alpha = 2.0f * (published ? log_d + r->guarded : log_d) / r->a -
        0.5f * ((1.0f - g->nl) * r->il + (1.0f - g->nv) * r->iv);
    c->roughness = mirror * log_alpha * (2.0f * s->roughness);
    /* n.l / (n.l (1 - k) + k) by n.l, and not the difference of the product's two terms, which nearly cancel at a
     * grazing light. */
    c->diffuse_l = v_select(g->seen, e->strength, v_set(0));
    c->mirror_l = c->diffuse_l * (r->lobe * k * r->il);
    c->mirror_v = -mirror * (1.0f - k) * r->iv;
    c->mirror_h = mirror * (4.0f * (1.0f - r->a) * (1.0f + r->a)) * g->nh * r->i;
    if (published) c->mirror_l += mirror * r->cosine, c->mirror_v += mirror * r->cosine;
}

V_INLINE vf by_diffuse(const surface *s, const radiance *r, int c)
{
    const vf by = r->scale * (1.0f - s->specular[c]) * INV_PI;
    return r->surrounded ? by + r->ambient * (1.0f - s->specular[c]) : by;
}
V_INLINE vf by_specular(const surface *s, const lighting *e, const radiance *r, int c)
{
    const vf by = r->scale * (r->lobe * (1.0f - e->fresnel) - s->diffuse[c] * INV_PI);
    return r->surrounded ? by + r->ambient * (1.0f - s->diffuse[c]) : by;
}
V_INLINE vf diffuse_part(const surface *s, int c) { return (1.0f - s->specular[c]) * s->diffuse[c] * INV_PI; }

/* Derivatives by what was decoded; n is kept as n x (d / d n) until the end. */
typedef struct slopes {
    vf diffuse[3], specular[3], roughness, n[3];
} slopes;

/* Adds the derivatives of sum over c of u[c] value[c]. */
V_INLINE void derive(ts_shade_kind kind, const surface *s, const lighting *e, const angles *g, const radiance *r,
                     const vf u[3], slopes *d)
{
    couplings k;
    vf ud = {0}, um = {0};
    couple(kind, s, e, g, r, &k);
    for (int c = 0; c < 3; c++) {
        d->diffuse[c] += u[c] * by_diffuse(s, r, c);
        d->specular[c] += u[c] * by_specular(s, e, r, c);
        ud += u[c] * diffuse_part(s, c);
        um += u[c] * r->fresnel[c];
    }
    d->roughness += um * k.roughness;
    const vf by_l = ud * k.diffuse_l + um * k.mirror_l, by_v = um * k.mirror_v, by_h = um * k.mirror_h;
    for (int i = 0; i < 3; i++) d->n[i] += by_l * g->l[i] + by_v * g->v[i] + by_h * g->h[i];
}

/* To derivatives by the encoded maps. By n_x: n_z follows, (1, 0, -n_x/n_z), which is (n x a)_y / n_z for n.a; in the
 * guard n_z stays and the normalisation leaves the part of (1, 0, 0) / length across n, which is ((n x a) x n)_x /
 * length. */
V_INLINE void encode_normal(const surface *s, const vf n[3], vf *x, vf *y)
{
    *x = n[1];
    *y = -n[0];
    if (s->guarded) {
        *x = v_select(s->guard, n[1] * s->nz - n[2] * s->ny, *x);
        *y = v_select(s->guard, n[2] * s->nx - n[0] * s->nz, *y);
    }
    *x = *x * (s->inverse * s->slope[MAP_NORMAL]) + 0.0f; /* not -0, as where a vector is skipped */
    *y = *y * (s->inverse * s->slope[MAP_NORMAL + 1]) + 0.0f;
}

V_INLINE void encode(const surface *s, const slopes *d, vf out[MAP_CHANNELS])
{
    for (int c = 0; c < 3; c++) {
        out[MAP_DIFFUSE + c] = d->diffuse[c] * s->slope[MAP_DIFFUSE + c];
        out[MAP_SPECULAR + c] = d->specular[c] * s->slope[MAP_SPECULAR + c];
    }
    out[MAP_ROUGHNESS] = d->roughness * s->slope[MAP_ROUGHNESS];
    encode_normal(s, d->n, &out[MAP_NORMAL], &out[MAP_NORMAL + 1]);
}

V_INLINE int lanes_left(const ts_shade_row *row, int first)
{
    return row->count - first < VL ? row->count - first : VL;
}
#endif
