#include "render/kernels/scene.h"
#include "render/kernels/prior_lanes.h"

enum { DISTANCE, LIGHT, CAMERA = LIGHT + 2, EXPOSURE = CAMERA + 2, AMBIENT, TONE, PLACES = EXPOSURE };
#define LN2 0.693147181f

V_INLINE void join3(const direction d[2], vf out[3])
{
    const vd x[2] = {d[0].x, d[1].x}, y[2] = {d[0].y, d[1].y}, z[2] = {d[0].z, d[1].z};
    out[0] = d_join(x), out[1] = d_join(y), out[2] = d_join(z);
}

V_INLINE vf dot_of(const vf a[3], const vf b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

V_INLINE void cross_of(const vf a[3], const vf b[3], vf out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* What of a moves a unit vector u: a - (a.u) u. */
V_INLINE void across(const vf a[3], const vf u[3], vf out[3])
{
    const vf along = dot_of(a, u);
    for (int i = 0; i < 3; i++) out[i] = a[i] - along * u[i];
}

/* How a radiance's parts move with the places of light and camera. Of a colour, with the coefficients of its
 * derivatives by n.l, n.v, n.h and by Fresnel's term and its flash's radiance itself, the derivative is their sum. */
typedef struct motion {
    vf l[PLACES], v[PLACES], h[PLACES], fresnel[PLACES], value[PLACES];
} motion;

/* Vectors from u x (n x u) keep the digits of n x u, which 1 - (n.u)^2 has lost. */
V_INLINE void move(const ts_scene *scene, const lighting *e, const angles *g, motion *m)
{
    vf u[2][3], h[3], n[2][3], nh[3], half[2][3], tangent[2][3], inverse[2];
    const float height = (float)scene->view.light[2];
    join3(e->l, u[0]), join3(e->v, u[1]), join3(e->h, h);
    cross_of(u[0], g->l, n[0]), cross_of(u[1], g->v, n[1]), cross_of(h, g->h, nh);
    const vf vh = v_max(dot_of(u[1], h), v_set(1e-6f)), twice = 0.5f / vh;
    const vf slope = e->fresnel * (LN2 * 0.5f) * (-2 * 5.55473f * vh - 6.98316f);
    for (int k = 0; k < 2; k++) {
        across(h, u[k], half[k]), across(nh, u[k], tangent[k]);
        inverse[k] = u[k][2] * (1 / height); /* 1 / distance */
    }
    for (int j = 0; j < PLACES; j++) {
        const int axis = j == DISTANCE ? 2 : (j - LIGHT) % 2;
        const bool both = j == DISTANCE || j >= CAMERA;
        const float by = j == DISTANCE ? height : scene->offset;
        const vf a = inverse[0] * by, b = both ? inverse[1] * by : v_set(0);
        m->l[j] = a * n[0][axis];
        m->v[j] = b * n[1][axis];
        m->h[j] = (a * tangent[0][axis] + b * tangent[1][axis]) * twice;
        m->fresnel[j] = (a * half[0][axis] + b * half[1][axis]) * slope;
        m->value[j] = -2.0f * a * u[0][axis] + (j == DISTANCE ? 2.0f : 0.0f);
    }
}

/* A colour's derivatives of the radiance by all numbers but the tone curve's. */
V_INLINE void by_numbers(int c, const ts_scene *scene, const surface *s, const radiance *r, const couplings *k,
                         const motion *m, vf by[TS_SCENE_NUMBERS])
{
    const vf ud = diffuse_part(s, c), um = r->fresnel[c];
    const vf white = s->specular[c] + (1.0f - s->specular[c]) * s->diffuse[c];
    const vf flash = v_fma(r->lobe, um, ud) * r->scale, mirror = r->lobe * r->scale * (1.0f - s->specular[c]);
    const vf l = ud * k->diffuse_l + um * k->mirror_l, v = um * k->mirror_v, h = um * k->mirror_h;
    for (int j = 0; j < PLACES; j++)
        by[j] = l * m->l[j] + v * m->v[j] + h * m->h[j] + mirror * m->fresnel[j] + flash * m->value[j];
    by[EXPOSURE] = LN2 * r->value[c];
    by[AMBIENT] = scene->ambient * white;
}

/* The tone curve, its slope, and its derivative by the strength. */
V_INLINE vf toned(float tone, vf value, vf *slope, vf *by)
{
    const vf y = v_sqrt(v_min(v_max(value, v_set(0)), v_set(1))), q = (1.0f - y) * (y - 0.5f), f = 1.0f + tone * q;
    const vi bright = value > v_set(1);
    *slope = v_select(bright, v_set(1), f * (f + tone * y * (1.5f - 2.0f * y)));
    *by = v_select(bright, v_set(0), 2.0f * value * f * q);
    return v_select(bright, value, value * f * f);
}

V_INLINE void see(const ts_scene *scene, const ts_shade_row *row, int first, int n, surface *s, sight *t)
{
    decode(scene->view.guards, row->maps + (int64_t)first * row->channels, row->channels, n, s);
    light(&scene->view, TS_SHADE_POSITIONS, row, first, &t->e);
    measure(s, &t->e, TS_SHADE_POSITIONS, &t->g);
    shade(&scene->view, TS_SHADE_POSITIONS, true, s, &t->e, &t->g, &t->r);
}

static void render(const ts_scene *scene, const ts_shade_row *row, float limit, float *image)
{
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        surface s;
        sight t;
        vf slope, by, value[3];
        see(scene, row, i, n, &s, &t);
        for (int c = 0; c < 3; c++) value[c] = v_min(toned(scene->tone, t.r.value[c], &slope, &by), v_set(limit));
        v_store_pixels(image + (int64_t)i * 3, 3, n, 3, value);
    }
}

static void backward(const ts_scene *scene, const ts_shade_row *row, float limit, const float *up, double *sums,
                     float *gradient)
{
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        const vi live = v_lanes_below(n);
        surface s;
        sight t;
        motion m;
        slopes d = {0};
        vf u[3], total[TS_SCENE_NUMBERS] = {{0}}, out[MAP_CHANNELS];
        see(scene, row, i, n, &s, &t);
        couple(TS_SHADE_POSITIONS, &s, &t.e, &t.g, &t.r, &t.k);
        move(scene, &t.e, &t.g, &m);
        v_load_pixels(up + (int64_t)i * 3, 3, n, 3, u);
        for (int c = 0; c < 3; c++) {
            vf by[TS_SCENE_NUMBERS], slope;
            by_numbers(c, scene, &s, &t.r, &t.k, &m, by);
            const vf value = toned(scene->tone, t.r.value[c], &slope, &by[TONE]);
            u[c] = v_select(live & (value <= v_set(limit)), u[c], v_set(0));
            total[TONE] += u[c] * by[TONE];
            u[c] *= slope;
            for (int j = 0; j < TONE; j++) total[j] += u[c] * by[j];
        }
        for (int j = 0; j < TS_SCENE_NUMBERS; j++) sums[j] += (double)v_sum(total[j]);
        if (!gradient) continue;
        derive(TS_SHADE_POSITIONS, &s, &t.e, &t.g, &t.r, u, &d);
        encode(&s, &d, out);
        v_store_pixels(gradient + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, out);
    }
}

static void normal(const ts_scene *scene, const ts_shade_row *row, const float *image, const ts_prior *prior,
                   const float *deviation, ts_scene_sums *sums)
{
    spread a;
    vf matrix[TS_SCENE_PAIRS] = {{0}}, right[TS_SCENE_UNKNOWNS] = {{0}};
    set_hue(prior, &a);
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        const vi live = v_lanes_below(n);
        surface s;
        sight t;
        motion m;
        gram g;
        vf by[3][TS_SCENE_UNKNOWNS], error[3], variance[3];
        decode(scene->view.guards, row->maps + (int64_t)i * row->channels, row->channels, n, &s);
        if (!look(&scene->view, TS_SHADE_POSITIONS, row, i, n, true, 0, image, &s, &t)) continue;
        load_deviation(deviation + (int64_t)i * MAP_GROUPS, n, &a);
        set_colours(s.diffuse, s.specular, prior->share, &a);
        move(scene, &t.e, &t.g, &m);
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) {
            vf maps[ROW], curve, above, tone;
            const vf value = toned(scene->tone, t.r.value[c], &curve, &tone),
                     seen = exposed(value, t.target[c], 0, &above), slope = curve * above;
            row_of(c, &s, &t.e, &t.r, &t.k, (const vf(*)[2])t.normal, slope, maps);
            whiten(c, &a, maps, g.u[c]);
            by_numbers(c, scene, &s, &t.r, &t.k, &m, by[c]);
            for (int j = 0; j < TONE; j++) by[c][j] = v_min(v_max(slope * by[c][j], v_set(-STEEPEST)), v_set(STEEPEST));
            by[c][TONE] = above * tone;
            by[c][TS_SCENE_NUMBERS] = maps[2] * (2.0f * s.roughness);
            error[c] = v_select(burnt_out(value, t.target[c]), v_set(0), t.target[c] - seen);
            variance[c] = variance_of(v_min(value, v_set(1)), prior);
            if (scene->least) continue;
            const vf keep = v_select(t.target[c] >= v_set(TS_NEWTON_BURNT), v_set(0), v_set(1));
            error[c] *= keep;
            for (int j = own_at(c); j < MAP_CHANNELS; j++) g.u[c][j] *= keep;
            for (int j = 0; j < TS_SCENE_UNKNOWNS; j++) by[c][j] *= keep;
        }
        orthogonalise(variance, &g);
        forward(&g, error);
        for (int j = 0; j < TS_SCENE_UNKNOWNS; j++) {
            vf column[3] = {by[0][j], by[1][j], by[2][j]};
            forward(&g, column);
            for (int c = 0; c < 3; c++) by[c][j] = column[c];
        }
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) {
            const vf weight = v_select(live, g.inverse[c], v_set(0));
#pragma GCC unroll 9
            for (int j = 0, at = 0; j < TS_SCENE_UNKNOWNS; j++) {
                const vf weighted = weight * by[c][j];
                right[j] += weighted * error[c];
                for (int k = j; k < TS_SCENE_UNKNOWNS; k++, at++) matrix[at] += weighted * by[c][k];
            }
        }
    }
    for (int j = 0; j < TS_SCENE_PAIRS; j++) sums->matrix[j] += (double)v_sum(matrix[j]);
    for (int j = 0; j < TS_SCENE_UNKNOWNS; j++) sums->right[j] += (double)v_sum(right[j]);
}

const struct ts_scene_kernels TS_TABLE(scene) = {.render = render, .backward = backward, .normal = normal};
