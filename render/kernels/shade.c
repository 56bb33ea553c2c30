/* Rows of pixels through render/kernels/shade_lanes.h. */
#include "render/kernels/shade.h"
#include "render/kernels/shade_lanes.h"

V_INLINE void render_kind(const ts_shade_view *view, ts_shade_kind kind, bool surrounded, const ts_shade_row *row,
                          float limit, float *image)
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
        if (v_any(lit(surrounded, &g))) shade(view, kind, surrounded, &s, &e, &g, &r);
        else r = (radiance){0};
        for (int c = 0; c < 3; c++) r.value[c] = v_min(r.value[c], v_set(limit));
        v_store_pixels(image + (int64_t)i * 3, 3, n, 3, r.value);
    }
}

V_INLINE double flash_kind(const ts_shade_view *view, ts_shade_kind kind, bool surrounded, const ts_shade_row *row,
                           const float *image, float scale, float *gradient)
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
        shade(view, kind, surrounded, &s, &e, &g, &r);
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
        if (v_any(moves & lit(surrounded, &g))) {
            slopes d = {0};
            derive(kind, &s, &e, &g, &r, u, &d);
            encode(&s, &d, out);
        }
        v_store_pixels(gradient + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, out);
    }
    return sum;
}

/* The loops once for each kind of view, and for views with and without ambient light, so that what a kind has in common
 * for all pixels is not computed for each. */
#define KINDS(of, surrounded, ...)                                                           \
    switch (view->kind) {                                                                    \
    case TS_SHADE_PUBLISHED: return of(view, TS_SHADE_PUBLISHED, surrounded, __VA_ARGS__);   \
    case TS_SHADE_COLLOCATED: return of(view, TS_SHADE_COLLOCATED, surrounded, __VA_ARGS__); \
    case TS_SHADE_DIRECTIONS: return of(view, TS_SHADE_DIRECTIONS, surrounded, __VA_ARGS__); \
    default: return of(view, TS_SHADE_POSITIONS, surrounded, __VA_ARGS__);                   \
    }

static void render(const ts_shade_view *view, const ts_shade_row *row, float limit, float *image)
{
    if (view->ambient != 0) KINDS(render_kind, true, row, limit, image)
    KINDS(render_kind, false, row, limit, image)
}

/* Each pixel takes the points that it needs itself, whatever stands beside it in a vector. */
static void render_disk(const ts_shade_view *view, const ts_shade_row *row, const ts_shade_disk *disk, float *image)
{
    static const double centre[1][2];
    const double(*const point[3])[2] = {disk->many, disk->few, centre};
    static const int points[3] = {TS_DISK_MANY, TS_DISK_FEW, 1};
    for (int i = 0; i < row->count; i += VL) {
        const int n = lanes_left(row, i);
        surface s;
        vf mean[3] = {0};
        decode(view->guards, row->maps + (int64_t)i * row->channels, row->channels, n, &s);
        const vf a = TS_ALPHA(s.roughness);
        const vi sharp = a < v_set(disk->as_few), seen = a < v_set(disk->as_one);
        const vi wants[3] = {sharp, seen & ~sharp, ~seen};
        for (int j = 0; j < 3; j++) {
            vf sum[3] = {0};
            if (!v_any(wants[j])) continue;
            for (int k = 0; k < points[j]; k++) {
                ts_shade_view at = *view;
                lighting e;
                angles g;
                radiance r;
                at.light[0] += point[j][k][0];
                at.light[1] += point[j][k][1];
                light(&at, TS_SHADE_POSITIONS, row, i, &e);
                measure(&s, &e, TS_SHADE_POSITIONS, &g);
                if (!v_any(g.seen)) continue;
                shade(&at, TS_SHADE_POSITIONS, false, &s, &e, &g, &r);
                for (int c = 0; c < 3; c++) sum[c] += r.value[c];
            }
            for (int c = 0; c < 3; c++) mean[c] = v_select(wants[j], sum[c] * (1.0f / (float)points[j]), mean[c]);
        }
        v_store_pixels(image + (int64_t)i * 3, 3, n, 3, mean);
    }
}

static double flash(const ts_shade_view *view, const ts_shade_row *row, const float *image, float scale,
                    float *gradient)
{
    if (view->ambient != 0) KINDS(flash_kind, true, row, image, scale, gradient)
    KINDS(flash_kind, false, row, image, scale, gradient)
}

V_INLINE vf log_view(const ts_shade_view *view, ts_shade_kind kind, bool surrounded, const ts_shade_row *row, int first,
                     const surface *s, const surface *target, float scale, bool wanted, slopes *d)
{
    lighting e;
    angles g, gt;
    radiance r, rt;
    vf u[3], total = {0};
    light(view, kind, row, first, &e);
    measure(s, &e, kind, &g);
    measure(target, &e, kind, &gt);
    if (!v_any(lit(surrounded, &g) | lit(surrounded, &gt))) return total; /* both black */
    shade(view, kind, surrounded, s, &e, &g, &r);
    shade(view, kind, surrounded, target, &e, &gt, &rt);
    for (int c = 0; c < 3; c++) {
        vf a = r.value[c] + 0.01f, b = rt.value[c] + 0.01f, inverse = 1.0f / a;
        total += v_abs(v_log(v_select(a == b, v_set(1), b * inverse))); /* exactly 0 for equal values */
        u[c] = v_select(a > b, v_set(scale), v_select(a < b, v_set(-scale), v_set(0))) * inverse;
    }
    if (wanted) derive(kind, s, &e, &g, &r, u, d);
    return total;
}

V_INLINE double log_views(const ts_shade_view *views, int count, bool surrounded, const ts_shade_row *row,
                          const ts_shade_row *target, float scale, float *gradient)
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
            const bool wanted = gradient != NULL;
            if (views[j].kind == TS_SHADE_DIRECTIONS)
                total += log_view(&views[j], TS_SHADE_DIRECTIONS, surrounded, row, i, &s, &st, scale, wanted, &d);
            else total += log_view(&views[j], TS_SHADE_POSITIONS, surrounded, row, i, &s, &st, scale, wanted, &d);
        }
        sum += (double)v_sum(v_select(live, total, v_set(0)));
        if (!gradient) continue;
        encode(&s, &d, out);
        v_store_pixels(gradient + (int64_t)i * row->channels, row->channels, n, MAP_CHANNELS, out);
    }
    return sum;
}

static double log_loss(const ts_shade_view *views, int count, const ts_shade_row *row, const ts_shade_row *target,
                       float scale, float *gradient)
{
    bool surrounded = false;
    for (int j = 0; j < count; j++) surrounded = surrounded || views[j].ambient != 0;
    return surrounded ? log_views(views, count, true, row, target, scale, gradient)
                      : log_views(views, count, false, row, target, scale, gradient);
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
    .render = render, .render_disk = render_disk, .flash = flash, .log_loss = log_loss, .log_encode = log_encode};
