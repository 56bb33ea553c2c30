/* Rows of pixels through render/kernels/shade_lanes.h. */
#include "render/kernels/shade_lanes.h"

V_INLINE void render_kind(const ts_shade_view *view, ts_shade_kind kind, const ts_shade_row *row, float limit,
                          float *image)
{
    for (int i = 0; i < row->count; i += VL) {
        int n = lanes_left(row, i);
        surface s;
        lighting e;
        angles g;
        radiance r;
        decode(view->guards, row->maps + (int64_t)i * row->channels, row->channels, n, &s);
        light(view, kind, row, i, &e);
        measure(&s, &e, kind, &g);
        if (v_any(g.seen)) shade(view, kind, &s, &e, &g, &r);
        else r = (radiance){0};
        for (int c = 0; c < 3; c++) r.value[c] = v_min(r.value[c], v_set(limit));
        v_store_pixels(image + (int64_t)i * 3, 3, n, 3, r.value);
    }
}

V_INLINE double flash_kind(const ts_shade_view *view, ts_shade_kind kind, const ts_shade_row *row, const float *image,
                           float scale, float *gradient)
{
    double sum = 0;
    for (int i = 0; i < row->count; i += VL) {
        int n = lanes_left(row, i);
        vi live = v_lanes_below(n);
        surface s;
        lighting e;
        angles g;
        radiance r;
        vf target[3], u[3], squares = {0}, out[MAP_CHANNELS] = {0};
        vi moves = {0};
        decode(view->guards, row->maps + (int64_t)i * row->channels, row->channels, n, &s);
        light(view, kind, row, i, &e);
        measure(&s, &e, kind, &g);
        shade(view, kind, &s, &e, &g, &r);
        v_load_pixels(image + (int64_t)i * 3, 3, n, 3, target);
        for (int c = 0; c < 3; c++) {
            const vf error = v_min(r.value[c], v_set(1)) - target[c];
            const vi below = r.value[c] <= v_set(1);
            squares += error * error;
            u[c] = v_select(below, error * scale, v_set(0));
            moves |= below;
        }
        sum += (double)v_sum(v_select(live, squares, v_set(0)));
        if (!gradient) continue;
        if (v_any(moves & g.seen)) {
            slopes d = {0};
            derive(kind, &s, &e, &g, &r, u, &d);
            encode(&s, &d, out);
        }
        v_store_pixels(gradient + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, out);
    }
    return sum;
}

/* The loops once for each kind of view, so that what a kind has in common for all pixels is not computed for each. */
static void render(const ts_shade_view *view, const ts_shade_row *row, float limit, float *image)
{
    switch (view->kind) {
    case TS_SHADE_PUBLISHED: render_kind(view, TS_SHADE_PUBLISHED, row, limit, image); return;
    case TS_SHADE_COLLOCATED: render_kind(view, TS_SHADE_COLLOCATED, row, limit, image); return;
    case TS_SHADE_DIRECTIONS: render_kind(view, TS_SHADE_DIRECTIONS, row, limit, image); return;
    default: render_kind(view, TS_SHADE_POSITIONS, row, limit, image); return;
    }
}

static double flash(const ts_shade_view *view, const ts_shade_row *row, const float *image, float scale,
                    float *gradient)
{
    switch (view->kind) {
    case TS_SHADE_PUBLISHED: return flash_kind(view, TS_SHADE_PUBLISHED, row, image, scale, gradient);
    case TS_SHADE_COLLOCATED: return flash_kind(view, TS_SHADE_COLLOCATED, row, image, scale, gradient);
    case TS_SHADE_DIRECTIONS: return flash_kind(view, TS_SHADE_DIRECTIONS, row, image, scale, gradient);
    default: return flash_kind(view, TS_SHADE_POSITIONS, row, image, scale, gradient);
    }
}

V_INLINE vf log_view(const ts_shade_view *view, ts_shade_kind kind, const ts_shade_row *row, int first,
                     const surface *s, const surface *target, float scale, bool wanted, slopes *d)
{
    lighting e;
    angles g, gt;
    radiance r, rt;
    vf u[3], total = {0};
    light(view, kind, row, first, &e);
    measure(s, &e, kind, &g);
    measure(target, &e, kind, &gt);
    if (!v_any(g.seen | gt.seen)) return total; /* both black */
    shade(view, kind, s, &e, &g, &r);
    shade(view, kind, target, &e, &gt, &rt);
    for (int c = 0; c < 3; c++) {
        vf a = r.value[c] + 0.01f, b = rt.value[c] + 0.01f, inverse = 1.0f / a;
        total += v_abs(v_log(v_select(a == b, v_set(1), b * inverse))); /* exactly 0 for equal values */
        u[c] = v_select(a > b, v_set(scale), v_select(a < b, v_set(-scale), v_set(0))) * inverse;
    }
    if (wanted) derive(kind, s, &e, &g, &r, u, d);
    return total;
}

static double log_loss(const ts_shade_view *views, int count, const ts_shade_row *row, const ts_shade_row *target,
                       float scale, float *gradient)
{
    double sum = 0;
    for (int i = 0; i < row->count; i += VL) {
        int n = lanes_left(row, i);
        vi live = v_lanes_below(n);
        surface s, st;
        vf total = {0}, out[MAP_CHANNELS];
        slopes d = {0};
        decode(views->guards, row->maps + (int64_t)i * row->channels, row->channels, n, &s);
        decode(views->guards, target->maps + (int64_t)i * target->channels, target->channels, n, &st);
        for (int j = 0; j < count; j++) {
            if (views[j].kind == TS_SHADE_DIRECTIONS)
                total += log_view(&views[j], TS_SHADE_DIRECTIONS, row, i, &s, &st, scale, gradient != NULL, &d);
            else total += log_view(&views[j], TS_SHADE_POSITIONS, row, i, &s, &st, scale, gradient != NULL, &d);
        }
        sum += (double)v_sum(v_select(live, total, v_set(0)));
        if (!gradient) continue;
        encode(&s, &d, out);
        v_store_pixels(gradient + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, out);
    }
    return sum;
}

static void log_encode(int count, const float *in, float a, float b, float *out)
{
    for (int i = 0; i < count; i += VL) {
        int n = count - i < VL ? count - i : VL;
        vf x = n == VL ? v_load(in + i) : v_load_n(in + i, n);
        x = a * v_log(v_min(v_max(x, v_set(0)), v_set(1)) + 0.01f) + b;
        if (n == VL) v_store(out + i, x);
        else v_store_n(out + i, x, n);
    }
}

const struct ts_shade_kernels TS_TABLE(shade) = {
    .render = render, .flash = flash, .log_loss = log_loss, .log_encode = log_encode};
