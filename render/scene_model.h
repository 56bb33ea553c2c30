/* A photograph as a function of the maps and of what is global about its scene, the numbers t of rd_scene_number.
 * With o = RD_SCENE_OFFSET and the default flash's height D and irradiance P / D^2,
 *     height             d = D exp(t_distance)
 *     camera             c = (o t_camera_x, o t_camera_y, d)
 *     light              p = (o (t_camera_x + t_light_x), o (t_camera_y + t_light_y), d)
 *     irradiance         E = P / D^2 2^t_exposure
 *     ambient radiance   A = RD_SCENE_AMBIENTS t_ambient E / pi
 *     radiance           L = f(n, l, v) max(n.l, 0) E d^2 / |p - x|^2 + A (F0 + (1 - F0) diffuse)
 *     tone curve         value = w^2, w = y + t_tone y (1 - y) (y - 1/2), y = sqrt(L) up to L = 1; value = L above.
 * y stands for the encoding of a photograph, where 0, 1/2 and 1 stay where they are; w rises for -4 < t_tone < 2.
 * Derivatives by the places, with r = |p - x|, u = n.l and so on, h = (l + v) / |l + v|:
 *     dL/dp = ((I - l l') (L_u n + (I - h h') L_nh n / |l + v| + L_vh h / 2) - 2 L l) / r
 * of the light's part of L, and the same by c without the last term; by d: of both along z, and 2 L / d. */
#ifndef RD_SCENE_MODEL_H
#define RD_SCENE_MODEL_H
#include "autograd/tape.h"
#include "render/kernels/scene.h"
#include "render/posterior.h"

/* The values of one pixel in double, not clamped. */
void rd_scene_value(const double maps[MAP_CHANNELS], const double point[2], const double number[RD_SCENE_NUMBERS],
                    double value[3]);

/* The same of a whole photograph [h, w, 3]; clamp: at 1. Threaded; the same bytes for any number of threads. */
void rd_scene_photograph(rd_grid grid, const float *maps, int channels, const float number[RD_SCENE_NUMBERS],
                         bool clamp, float *image);

/* The photographs [N, S, S, 3] of maps [N, S, S, 9 or more], whole patches, in the scenes numbers [N, 1, 1,
 * RD_SCENE_NUMBERS]; clamp: at 1, without a gradient there. Either input may have a gradient
 * (render/op_scene_render.c). */
ag_value *ag_scene_render(ag_tape *tape, ag_value *maps, ag_value *numbers, bool clamp);

/* What a network says of a material's roughness may be off as a whole: the level, the logarithm of a factor on all of
 * it, is found together with the numbers of the scene. */
enum { RD_SCENE_ROUGHNESS = RD_SCENE_NUMBERS, RD_SCENE_UNKNOWNS };

/* to = maps [pixels, channels], the roughness at a level; it ends at 1. to may be maps. threads as in tensor/team.h. */
void rd_scene_roughen(int64_t pixels, const float *maps, int channels, float level, int threads, float *to);

/* What is known beforehand of a scene's numbers and the level: they are independent and have Gaussian errors. A
 * deviation of 0 keeps an unknown. */
typedef struct rd_scene_prior {
    float mean[RD_SCENE_UNKNOWNS], deviation[RD_SCENE_UNKNOWNS];
} rd_scene_prior;

typedef struct rd_scene_how {
    int steps;
    int every;        /* of so many rows the middle one is read (rd_middle); 1 reads all */
    float correlated; /* so many pixels are worth one: the maps' errors of neighbours are alike */
    ts_prior scale;   /* q of the maps' prior, and of a photograph's values the variance */
} rd_scene_how;

/* Gauss and Newton's method on the numbers of a photograph's scene and the roughness' level of maps that are uncertain.
 * With e = image - seen (as in render/posterior.h: a logarithm above 1, nothing where both are burnt out), J_t = d seen
 * / d t, J = d seen / d maps and the covariance Sigma of a pixel's maps, the sums over the pixels that are read are V =
 * (J Sigma J' + S)^-1,   A = w sum J_t' V J_t,   b = w sum J_t' V e,   w = min(every / correlated, 1). S has the
 * variance model^2 + noise v + (gain v)^2, v = min(value, 1), of the rendering's value: with the photograph's, what is
 * darker by chance would weigh more. With the prior's mean m and its deviations in the diagonal matrix Q a step goes to
 * t = m + Q z, (I + Q A Q) z = Q (b + A (t_before - m)), at most RD_SCENE_STRIDE in any number. The ambient light is
 * not let below 0, nor the tone curve's strength out of +-RD_SCENE_TONE_MOST. In the first half of the steps, values of
 * the photograph that are burnt out tell nothing; from then on they tell nothing where the rendering is above 1: were
 * they ignored wherever it is brighter than they are, true maps would not lead to the scene in as many steps. Where
 * much is burnt out and the maps are uncertain, exposure and tone curve lean to what by chance is not. The maps are the
 * mean of what the material may be: of maps that were fitted to this photograph the errors depend on it, which is not
 * foreseen. unknown begins with the caller's values. after (may be NULL): the square roots of the diagonal of Q (I + Q
 * A Q)^-1 Q at the last step. deviation: of the maps, [h, w, MAP_GROUPS]; image: [h, w, 3]. Threaded; the same bytes
 * for any number of threads. */
#define RD_SCENE_STRIDE 1.0
#define RD_SCENE_TONE_MOST 1.5f
void rd_scene_fit(rd_grid grid, const float *maps, int channels, const float *deviation, const float *image,
                  const rd_scene_prior *prior, const rd_scene_how *how, float unknown[RD_SCENE_UNKNOWNS],
                  float after[RD_SCENE_UNKNOWNS]);

/* What the kernels need of them. */
ts_scene rd_scene_of(const float number[RD_SCENE_NUMBERS]);
#endif
