/* Sample, cameras and lights. The sample is the square [-1/2, 1/2]^2 at z = 0, in patch widths; x right, y up, z toward
 * the camera. */
#ifndef RD_SCENE_H
#define RD_SCENE_H
#include "tensor/rng.h"
#include "tensor/status.h"

/* The pixels that a map or an image holds: rows y0 .. y0+h-1 and columns x0 .. x0+w-1 of a sample that is side x side
 * pixels. Pixel (column i, row j) has its centre at ((i + 1/2) / side - 1/2, 1/2 - (j + 1/2) / side). */
typedef struct rd_grid {
    int h, w, y0, x0, side;
    int threads; /* that renderings of it run on; 0: the process's number */
} rd_grid;

rd_grid rd_grid_full(int side);
rd_grid rd_grid_on(rd_grid grid, int threads); /* the same pixels on so many threads */

typedef enum rd_kind {
    RD_POINT,      /* positions; radiance = f max(n.l, 0) power / |light - x|^2, not clamped */
    RD_DIRECTIONS, /* camera and light are unit directions, the same for every pixel; radiance = f pi max(n.l, 0) /
                      max(l_z, 0.001) */
    RD_NEAR,       /* positions; radiance as RD_DIRECTIONS, without distance falloff */
    RD_PUBLISHED   /* as RD_POINT with light and camera at one position, shaded as the published code does
                      (render/published.h) */
} rd_kind;

typedef struct rd_view {
    rd_kind kind;
    float camera[3], light[3];
    float power; /* RD_POINT and RD_PUBLISHED only */
    /* Radiance of uniform surroundings: a pixel's radiance is ambient (F0 + (1 - F0) diffuse) more, which is what a
     * surface without roughness, and one without gloss, make of them. */
    float ambient;
} rd_view;

/* The flash photograph: camera and light at (0, 0, RD_FLASH_DISTANCE), power RD_FLASH_POWER. */
#define RD_FLASH_DISTANCE (250.0f / 256.0f)
#define RD_FLASH_POWER (329288.0f / 65536.0f)
rd_view rd_flash(void);

/* Seen from height d the sample's side spans the angle fov = 2 atan(1 / 2d), in degrees; RD_FLASH_DISTANCE: 54.2. */
double rd_fov_of(double distance);
/* The same from a camera that may be tilted: d is its distance from the centre. */
double rd_fov_from(const float camera[3]);
double rd_fov_distance(double fov);
/* The same view with camera and light at that height, the power as much greater as the light's height has been squared:
 * the sample is as bright as before. */
rd_view rd_view_from(rd_view view, double distance);
/* The same view with camera and light turned by 0 .. 89 degrees about the sample's x axis, towards its lower edge, the
 * power greater by 1 / cos: a matt sample under the flash is as bright in its middle as before. */
rd_view rd_view_tilted(rd_view view, double degrees);

/* What is global about a photograph, as numbers of about the size of 1: the logarithm of the camera's height over
 * RD_FLASH_DISTANCE; the light's place beside the camera, x and y, in RD_SCENE_OFFSET patch widths; the camera's place
 * beside the centre, x and y, in the same; the light's power over the square of its height in stops above the default
 * flash's; the ambient light in RD_SCENE_AMBIENTS of the power over the square of the light's height; the strength of
 * the tone curve. The light is as high as the camera; one at another height is put there along its ray to the centre of
 * the sample, which looks the same from there. */
typedef enum rd_scene_number {
    RD_SCENE_DISTANCE,
    RD_SCENE_LIGHT_X,
    RD_SCENE_LIGHT_Y,
    RD_SCENE_CAMERA_X,
    RD_SCENE_CAMERA_Y,
    RD_SCENE_EXPOSURE,
    RD_SCENE_AMBIENT,
    RD_SCENE_TONE,
    RD_SCENE_NUMBERS
} rd_scene_number;
#define RD_SCENE_OFFSET 0.1f
#define RD_SCENE_AMBIENTS 0.1f
void rd_scene_numbers(const rd_view *view, float ambient, float tone, float number[RD_SCENE_NUMBERS]);
/* A point light's view from them. */
rd_view rd_scene_view(const float number[RD_SCENE_NUMBERS]);

/* The views of the training loss. The first RD_LOSS_DIFFUSE have view and light directions on the hemisphere, each with
 * r = sqrt(0.94 u + 0.01), phi uniform. The others are mirror configurations: the view is drawn so, the light is its
 * mirror image about z, at distances exp(N(0.5, 0.75)) from one point uniform on the patch (in half patch widths, lift
 * 1e-4). Deschaintre et al., "Single-Image SVBRDF Capture with a Rendering-Aware Deep Network", 2018, section 4.2. */
enum { RD_LOSS_DIFFUSE = 3, RD_LOSS_SPECULAR = 6, RD_LOSS_VIEWS = 9 };
void rd_loss_views(ts_rng *rng, rd_view views[RD_LOSS_VIEWS]);

/* Of a phone over the sample: the camera uniform over [-1/2, 1/2]^2 at exp(U(0, 1)) times RD_FLASH_DISTANCE, 54 to 22
 * degrees across the patch; the light at the same height, at the camera in views 0, 2 and so on, and uniform over the
 * same square in the others. A matt sample is as bright as under the default flash. */
void rd_flash_views(ts_rng *rng, int count, rd_view *views);

/* Evaluation: camera and light each uniform over the square [-1/2, 1/2]^2 at z = RD_FLASH_DISTANCE,
 * power RD_FLASH_POWER. */
void rd_eval_views(ts_rng *rng, int count, rd_view *views);

/* The preview's light positions: index 0 .. count-1 around the sample, camera at the flash's place. */
rd_view rd_preview_view(int index, int count);

/* The predefined configurations of a capture in several photographs: the camera at the flash's place, the light at the
 * same height over a 3 x 3 grid, RD_CAPTURE_SPACING patch widths apart. 0 is the flash photograph; 1 .. 8 are
 * counter-clockwise from the right (1: +x, 3: +y). */
enum { RD_CAPTURE_VIEWS = 9 };
#define RD_CAPTURE_SPACING 0.6f
rd_view rd_capture_view(int index);

/* The views of a capture of count <= RD_CAPTURE_VIEWS photographs: the flash, and others of the configurations, every
 * subset equally likely, in the order of rd_capture_order. */
void rd_capture_draw(ts_rng *rng, int count, rd_view views[]);

/* The views of count <= RD_CAPTURE_VIEWS photographs of a printed sheet (docs/capturing.md), in the order of
 * rd_capture_order: one from within 8 degrees of straight above, the others around it at 12 to 45, all from 1.6 to 2.2
 * patch widths. The flash is beside the lens, as far (0.03 to 0.25 patch widths) and in about the same direction on the
 * phone in all of them; the first one's lights a matt sample's middle as brightly as the default flash does, and the
 * others have its power. */
void rd_sheet_draw(ts_rng *rng, int count, rd_view views[]);

/* The order in which models read count <= RD_CAPTURE_MOST photographs of a capture: by the light's distance from the
 * camera, the flash first; of equal ones, that from nearest to straight above is the first of all, and the others come
 * by the light's direction from the cameras' mean place, from x toward y. order[0 .. count-1]: indices into views. The
 * result does not depend on the order of the views, unless some differ by no more than rounding does. */
enum { RD_CAPTURE_MOST = 16 };
void rd_capture_order(const rd_view *views, int count, int order[]);
#endif
