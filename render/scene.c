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
    number[RD_SCENE_DISTANCE] = logf(view->camera[2] / RD_FLASH_DISTANCE);
    for (int i = 0; i < 2; i++) {
        number[RD_SCENE_LIGHT_X + i] = (view->light[i] - view->camera[i]) / RD_SCENE_OFFSET;
        number[RD_SCENE_CAMERA_X + i] = view->camera[i] / RD_SCENE_OFFSET;
    }
    number[RD_SCENE_EXPOSURE] = stops(view);
    number[RD_SCENE_AMBIENT] = ambient / RD_SCENE_AMBIENTS;
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

/* Whether a comes before b. Differences below a hundred-thousandth of the patch are rounding of positions. */
static bool before(const rd_view *a, const rd_view *b)
{
    double distance[2], angle[2];
    const rd_view *v[2] = {a, b};
    for (int i = 0; i < 2; i++) {
        const double x = (double)v[i]->light[0] - (double)v[i]->camera[0],
                     y = (double)v[i]->light[1] - (double)v[i]->camera[1];
        const double z = (double)v[i]->light[2] - (double)v[i]->camera[2];
        distance[i] = sqrt(x * x + y * y + z * z);
        angle[i] = distance[i] < 1e-5 ? 0 : atan2(y, x);
        if (angle[i] < -1e-5) angle[i] += 2 * M_PI;
    }
    return fabs(distance[0] - distance[1]) > 1e-5 ? distance[0] < distance[1] : angle[0] < angle[1];
}

void rd_capture_order(const rd_view *views, int count, int order[])
{
    for (int i = 0; i < count; i++) {
        int at = i;
        for (; at > 0 && before(&views[i], &views[order[at - 1]]); at--) order[at] = order[at - 1];
        order[at] = i;
    }
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
