/* The equations of shading, one pixel at a time in double, value and gradient: the reference for every fast path.
 *
 * Maps (tensor/maps.h). Each of the nine values x is clamped to [-1, 1]; outside it has no gradient.
 *
 *     diffuse d, specular s (F0), roughness r:  (x + 1) / 2;  r >= guards.roughness;  alpha = r^2
 *     normal n: (x, y, sqrt(max(1 - x^2 - y^2, guards.nz2))), divided by its length (1 outside the guard)
 *
 * BRDF, for unit l toward the light and v toward the camera, h = (l + v) / |l + v|:
 *
 *     f = (1 - s) d / pi + D G F / 4
 *     D = alpha^2 / (pi (alpha^2 (n.h)^2 + |n x h|^2)^2)
 *     G = 1 / ((n.l (1 - k) + k) (n.v (1 - k) + k)),  k = alpha / 2
 *     F = s + (1 - s) 2^((-5.55473 v.h - 6.98316) v.h)
 *     f = 0 where n.l <= 0 or n.v <= 0
 *
 * The sum in D is the usual (n.h)^2 (alpha^2 - 1) + 1 without its cancellation. G lacks the usual cosines above, which
 * cancel 4 n.l n.v below: no 0/0 at grazing angles.
 * Radiance = f n.l times the light's strength at the pixel (rd_kind in render/scene.h), and ambient (s + (1 - s) d)
 * under surroundings of that radiance (rd_view).
 *
 * Cook and Torrance, "A Reflectance Model for Computer Graphics", 1982; D: Walter et al., "Microfacet Models for
 * Refraction through Rough Surfaces", 2007; G and F: Karis, "Real Shading in Unreal Engine 4", 2013. */
#ifndef RD_BRDF_H
#define RD_BRDF_H
#include "render/kernels/view.h"
#include "render/scene.h"
#include "tensor/maps.h"

/* Every bound that keeps shading finite, for the reference and the kernels. */
extern const ts_shade_guards rd_guards;

/* GGX's width (TS_ALPHA). */
double rd_alpha(double roughness);

/* 2^((-5.55473 v.h - 6.98316) v.h) */
double rd_fresnel(double vh);

/* h = (l + v) / |l + v| for unit l and v, 0 when they are opposite; returns v.h. */
double rd_half(const double l[3], const double v[3], double h[3]);

/* A pixel's decoded maps. */
typedef struct rd_surface {
    double diffuse[3], specular[3], roughness, n[3];
    double slope[MAP_CHANNELS]; /* d decoded / d encoded: 1/2 or 1, 0 where the value was clamped */
    double dn[2][3];            /* d n / d x and d n / d y before the clamp */
} rd_surface;
void rd_decode_double(const double maps[MAP_CHANNELS], rd_surface *s);

/* f for unit l and v: f[3], and the specular part alone when specular is not NULL. */
void rd_brdf(const rd_surface *s, const double l[3], const double v[3], double f[3], double specular[3]);

/* The light's strength E (radiance = f max(n.l, 0) E) at a point of the sample, and the unit directions there. A light
 * or camera at the point itself has direction 0 and is not seen. */
double rd_light(const rd_view *view, const double point[2], double l[3], double v[3]);

/* Centre of the grid's pixel (column, row). */
void rd_centre(rd_grid grid, int column, int row, double point[2]);

/* Radiance of one pixel, and d radiance[c] / d maps[m] when gradient is not NULL. */
void rd_radiance(const double maps[MAP_CHANNELS], const double point[2], const rd_view *view, double radiance[3],
                 double gradient[3][MAP_CHANNELS]);
#endif
