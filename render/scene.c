#include "render/scene.h"
#include <math.h>
#include <stdbool.h>

#define TAU 6.28318530717958647692
#define PI 3.14159265f

rd_grid rd_grid_on(rd_grid grid, int threads)
{
    grid.threads = threads;
    return grid;
}

rd_grid rd_grid_full(int side) { return (rd_grid){.h = side, .w = side, .side = side}; }

rd_view rd_flash(void)
{
    return (rd_view){.kind = RD_POINT,
                     .camera = {0, 0, RD_FLASH_DISTANCE},
                     .light = {0, 0, RD_FLASH_DISTANCE},
                     .power = RD_FLASH_POWER};
}

#define DEGREES 57.295779513082320877
double rd_fov_of(double distance) { return 2 * DEGREES * atan(0.5 / distance); }
double rd_fov_from(const float camera[3])
{
    return rd_fov_of(hypot(hypot((double)camera[0], (double)camera[1]), (double)camera[2]));
}
double rd_fov_distance(double fov) { return 0.5 / tan(fov / (2 * DEGREES)); }

rd_view rd_view_from(rd_view view, double distance)
{
    const float d = (float)distance, farther = d / view.light[2];
    view.power *= farther * farther;
    view.camera[2] = view.light[2] = d;
    return view;
}

static void tilt(float at[3], double c, double s)
{
    const double y = (double)at[1], z = (double)at[2];
    at[1] = (float)(y * c - z * s);
    at[2] = (float)(y * s + z * c);
}

rd_view rd_view_tilted(rd_view view, double degrees)
{
    const double c = cos(degrees / DEGREES), s = sin(degrees / DEGREES);
    tilt(view.camera, c, s);
    tilt(view.light, c, s);
    view.power = (float)((double)view.power / c);
    return view;
}

static float stops(const rd_view *view)
{
    const float reference = RD_FLASH_POWER / (RD_FLASH_DISTANCE * RD_FLASH_DISTANCE);
    return log2f(view->power / (view->light[2] * view->light[2]) / reference);
}

void rd_scene_numbers(const rd_view *view, float ambient, float tone, float number[RD_SCENE_NUMBERS])
{
    const float up = view->light[2] > 0 ? view->camera[2] / view->light[2] : 1;
    number[RD_SCENE_DISTANCE] = logf(view->camera[2] / RD_FLASH_DISTANCE);
    for (int i = 0; i < 2; i++) {
        number[RD_SCENE_LIGHT_X + i] = (up * view->light[i] - view->camera[i]) / RD_SCENE_OFFSET;
        number[RD_SCENE_CAMERA_X + i] = view->camera[i] / RD_SCENE_OFFSET;
    }
    number[RD_SCENE_EXPOSURE] = stops(view);
    const float *l = view->light, far2 = l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
    number[RD_SCENE_AMBIENT] = far2 > 0 ? ambient * l[2] * l[2] / far2 / RD_SCENE_AMBIENTS : 0;
    number[RD_SCENE_TONE] = tone;
}

rd_view rd_scene_view(const float number[RD_SCENE_NUMBERS])
{
    rd_view view = rd_flash();
    const float farther = expf(number[RD_SCENE_DISTANCE]);
    view.camera[2] = view.light[2] = RD_FLASH_DISTANCE * farther;
    for (int i = 0; i < 2; i++) {
        view.camera[i] = RD_SCENE_OFFSET * number[RD_SCENE_CAMERA_X + i];
        view.light[i] = view.camera[i] + RD_SCENE_OFFSET * number[RD_SCENE_LIGHT_X + i];
    }
    view.power = RD_FLASH_POWER * farther * farther * exp2f(number[RD_SCENE_EXPOSURE]);
    view.ambient = RD_SCENE_AMBIENTS * number[RD_SCENE_AMBIENT] * view.power / (view.light[2] * view.light[2]) / PI;
    return view;
}

static void hemisphere(ts_rng *rng, double d[3])
{
    double r = sqrt(0.94 * ts_rng_uniform(rng) + 0.01), phi = TAU * ts_rng_uniform(rng);
    d[0] = r * cos(phi);
    d[1] = r * sin(phi);
    d[2] = sqrt(1 - r * r);
}

void rd_loss_views(ts_rng *rng, rd_view views[RD_LOSS_VIEWS])
{
    for (int i = 0; i < RD_LOSS_VIEWS; i++) {
        double v[3], l[3];
        hemisphere(rng, v);
        if (i < RD_LOSS_DIFFUSE) {
            hemisphere(rng, l);
        } else {
            double sx = ts_rng_range(rng, -1, 1), sy = ts_rng_range(rng, -1, 1), shift[3] = {sx, sy, 1e-4};
            double dv = exp(0.5 + 0.75 * ts_rng_normal(rng)), dl = exp(0.5 + 0.75 * ts_rng_normal(rng));
            for (int k = 0; k < 3; k++) {
                l[k] = 0.5 *
                    (dl * (k < 2 ? -v[k] : v[k]) + shift[k]); /* half: from half patch widths to patch widths */
                v[k] = 0.5 * (dv * v[k] + shift[k]);
            }
        }
        views[i].kind = i < RD_LOSS_DIFFUSE ? RD_DIRECTIONS : RD_NEAR;
        views[i].power = 1;
        views[i].ambient = 0;
        for (int k = 0; k < 3; k++) {
            views[i].camera[k] = (float)v[k];
            views[i].light[k] = (float)l[k];
        }
    }
}

void rd_flash_views(ts_rng *rng, int count, rd_view *views)
{
    for (int i = 0; i < count; i++) {
        const float farther = expf(ts_rng_uniform(rng));
        rd_view *v = &views[i];
        *v = rd_flash();
        v->camera[2] = v->light[2] = RD_FLASH_DISTANCE * farther;
        v->power *= farther * farther;
        for (int k = 0; k < 2; k++) v->camera[k] = ts_rng_range(rng, -0.5f, 0.5f);
        for (int k = 0; k < 2; k++) v->light[k] = i % 2 ? ts_rng_range(rng, -0.5f, 0.5f) : v->camera[k];
    }
}

void rd_eval_views(ts_rng *rng, int count, rd_view *views)
{
    for (int i = 0; i < count; i++) {
        views[i] = rd_flash();
        for (int k = 0; k < 2; k++) views[i].camera[k] = ts_rng_range(rng, -0.5f, 0.5f);
        for (int k = 0; k < 2; k++) views[i].light[k] = ts_rng_range(rng, -0.5f, 0.5f);
    }
}

rd_view rd_preview_view(int index, int count)
{
    rd_view view = rd_flash();
    double phi = TAU * (index + 0.5) / count;
    /* low beside the sample: the highlight leaves the middle and relief throws its shading, which a light near the
     * camera hides */
    view.light[0] = (float)(0.75 * cos(phi));
    view.light[1] = (float)(0.75 * sin(phi));
    view.light[2] = 0.6f;
    return view;
}

rd_view rd_capture_view(int index)
{
    static const signed char place[RD_CAPTURE_VIEWS][2] = {{0, 0},  {1, 0},   {1, 1},  {0, 1}, {-1, 1},
                                                           {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
    rd_view view = rd_flash();
    for (int k = 0; k < 2; k++) view.light[k] = RD_CAPTURE_SPACING * (float)place[index][k];
    return view;
}

/* What the order depends on; differences below a hundred-thousandth are rounding of positions. */
typedef struct standing {
    double distance; /* of light and camera */
    double aslant;   /* tangent of the camera's angle with the normal */
    double angle;    /* direction of the light from the cameras' mean */
    const rd_view *view;
} standing;
#define ROUNDING 1e-5

static standing standing_of(const rd_view *v, const double mean[2])
{
    const double x = (double)v->light[0] - (double)v->camera[0], y = (double)v->light[1] - (double)v->camera[1],
                 z = (double)v->light[2] - (double)v->camera[2];
    const double right = (double)v->light[0] - mean[0], up = (double)v->light[1] - mean[1];
    standing p = {.view = v,
                  .distance = sqrt(x * x + y * y + z * z),
                  .aslant = hypot((double)v->camera[0], (double)v->camera[1]) / (double)v->camera[2],
                  .angle = hypot(right, up) < ROUNDING ? 0 : atan2(up, right)};
    if (p.angle < -ROUNDING) p.angle += 2 * M_PI;
    return p;
}

static bool before(const standing *a, const standing *b, bool first)
{
    if (fabs(a->distance - b->distance) > ROUNDING) return a->distance < b->distance;
    if (first && fabs(a->aslant - b->aslant) > ROUNDING) return a->aslant < b->aslant;
    if (fabs(a->angle - b->angle) > ROUNDING) return a->angle < b->angle;
    for (int k = 0; k < 3; k++) { /* any order will do, as long as it is one */
        if (a->view->camera[k] != b->view->camera[k]) return a->view->camera[k] < b->view->camera[k];
        if (a->view->light[k] != b->view->light[k]) return a->view->light[k] < b->view->light[k];
    }
    return false;
}

void rd_capture_order(const rd_view *views, int count, int order[])
{
    standing of[RD_CAPTURE_MOST];
    double mean[2] = {0, 0};
    int first = 0;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 2; k++) mean[k] += (double)views[i].camera[k] / count;
    for (int i = 0; i < count; i++) {
        of[i] = standing_of(&views[i], mean);
        if (before(&of[i], &of[first], true)) first = i;
    }
    for (int i = 0, n = 0; i < count; i++) {
        if (i == first) continue;
        int at = ++n;
        for (; at > 1 && before(&of[i], &of[order[at - 1]], false); at--) order[at] = order[at - 1];
        order[at] = i;
    }
    if (count) order[0] = first;
}

void rd_capture_draw(ts_rng *rng, int count, rd_view views[])
{
    int place[RD_CAPTURE_VIEWS], order[RD_CAPTURE_VIEWS];
    rd_view drawn[RD_CAPTURE_VIEWS] = {{0}};
    for (int i = 0; i < RD_CAPTURE_VIEWS; i++) place[i] = i;
    for (int i = 1; i < count; i++) { /* the first steps of Fisher and Yates's shuffle of all but the flash */
        const int from = i + ts_rng_int(rng, RD_CAPTURE_VIEWS - i), kept = place[i];
        place[i] = place[from];
        place[from] = kept;
    }
    for (int i = 0; i < count; i++) drawn[i] = rd_capture_view(place[i]);
    rd_capture_order(drawn, count, order);
    for (int i = 0; i < count; i++) views[i] = drawn[order[i]];
}

void rd_sheet_draw(ts_rng *rng, int count, rd_view views[])
{
    enum { AROUND = 4 };
    const float degree = TAU / 360, start = ts_rng_range(rng, 0, TAU), side = ts_rng_range(rng, 0, TAU),
                beside = ts_rng_range(rng, 0.03f, 0.25f);
    rd_view drawn[RD_CAPTURE_MOST] = {{0}};
    int order[RD_CAPTURE_MOST];
    float power = 0;
    for (int i = 0; i < count; i++) {
        rd_view *v = &drawn[i];
        const float tilt = degree * (i ? ts_rng_range(rng, 12, 45) : ts_rng_range(rng, 0, 8));
        const float around = start + TAU * (float)i / AROUND + ts_rng_range(rng, -0.4f, 0.4f);
        const float far = ts_rng_range(rng, 1.6f, 2.2f), roll = side + ts_rng_range(rng, -0.2f, 0.2f);
        const float axis[3] = {sinf(tilt) * cosf(around), sinf(tilt) * sinf(around), cosf(tilt)};
        /* across the axis: the part of x that is, and what is upright to both */
        const float across = sqrtf(1 - axis[0] * axis[0]);
        const float right[3] = {across, -axis[0] * axis[1] / across, -axis[0] * axis[2] / across};
        const float up[3] = {0, axis[2] / across, -axis[1] / across};
        v->kind = RD_POINT;
        float distance2 = 0;
        for (int k = 0; k < 3; k++) {
            v->camera[k] = far * axis[k];
            v->light[k] = v->camera[k] + beside * (cosf(roll) * right[k] + sinf(roll) * up[k]);
            distance2 += v->light[k] * v->light[k];
        }
        if (i == 0)
            power = RD_FLASH_POWER / (RD_FLASH_DISTANCE * RD_FLASH_DISTANCE) * distance2 * sqrtf(distance2) /
                v->light[2];
        v->power = power;
    }
    rd_capture_order(drawn, count, order);
    for (int i = 0; i < count; i++) views[i] = drawn[order[i]];
}
