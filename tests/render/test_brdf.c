/* Laws of the reference BRDF in double (render/brdf.h). */
#include "render/brdf.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

static rd_surface flat(double roughness, double specular, double diffuse)
{
    double r = 2 * roughness - 1, s = 2 * specular - 1, d = 2 * diffuse - 1;
    double maps[MAP_CHANNELS] = {d, d, d, 0, 0, r, s, s, s};
    rd_surface surface;
    rd_decode_double(maps, &surface);
    return surface;
}

static void from_angles(double theta, double phi, double d[3])
{
    d[0] = sin(theta) * cos(phi);
    d[1] = sin(theta) * sin(phi);
    d[2] = cos(theta);
}

static void random_maps(ts_rng *rng, double tilt, double spread, double maps[MAP_CHANNELS])
{
    for (int i = 0; i < MAP_CHANNELS; i++) {
        bool normal = i == MAP_NORMAL || i == MAP_NORMAL + 1;
        maps[i] = (double)ts_rng_range(rng, -1, 1) * (normal ? tilt : spread);
    }
}

TEST(brdf_reciprocity)
{
    ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, 0);
    int seen = 0;
    for (int i = 0; i < 20000; i++) {
        double maps[MAP_CHANNELS], l[3], v[3], a[3], b[3];
        rd_surface s;
        random_maps(&rng, 1, 1, maps);
        rd_decode_double(maps, &s);
        from_angles(acos((double)ts_rng_uniform(&rng)), 2 * PI * (double)ts_rng_uniform(&rng), l);
        from_angles(acos((double)ts_rng_uniform(&rng)), 2 * PI * (double)ts_rng_uniform(&rng), v);
        rd_brdf(&s, l, v, a, NULL);
        rd_brdf(&s, v, l, b, NULL);
        for (int c = 0; c < 3; c++) {
            seen += a[c] > 0;
            CHECK(a[c] >= 0 && fabs(a[c] - b[c]) <= 1e-9 * a[c], "f(l, v) = %.17g, f(v, l) = %.17g", a[c], b[c]);
        }
    }
    CHECK(seen > 10000, "only %d of 60000 were lit: this tested nothing", seen);
}

/* Directional albedo of the specular part and of the diffuse part, the integrals of f n.l over l. Over the half vector,
 * where the lobe is: dl = 4 v.h dh, and theta_h = atan(alpha t / sqrt(1 - t^2)), for which t^2 is what importance
 * sampling of D would draw. */
static void albedo(double roughness, double specular, double theta, double *mirror, double *diffuse)
{
    rd_surface s = flat(roughness, specular, 1);
    double v[3], alpha = rd_alpha(roughness);
    from_angles(theta, 0, v);
    enum { T = 250, P = 100 };
    *mirror = 0;
    for (int i = 0; i < T; i++)
        for (int j = 0; j < P; j++) {
            double t2 = (i + 0.5) / T, tangent = alpha * sqrt(t2 / (1 - t2)), h[3], l[3], f[3], spec[3];
            from_angles(atan(tangent), 2 * PI * (j + 0.5) / P, h);
            double vh = v[0] * h[0] + v[1] * h[1] + v[2] * h[2];
            if (vh <= 0) continue;
            for (int k = 0; k < 3; k++) l[k] = 2 * vh * h[k] - v[k];
            if (l[2] <= 0) continue;
            rd_brdf(&s, l, v, f, spec);
            double a = 1 + (alpha * alpha - 1) * h[2] * h[2]; /* density of h: D n.h */
            double density = alpha * alpha / (PI * a * a) * h[2] / (4 * vh);
            *mirror += spec[0] * l[2] / density / (T * P);
        }
    *diffuse = 1 - specular; /* (1 - s) / pi over the hemisphere, weighted by the cosine */
}

TEST(brdf_white_furnace)
{
    double worst = 0, least = 2;
    for (int i = 0; i <= 10; i++)
        for (int j = 0; j < 10; j++) {
            double mirror, diffuse, roughness = i == 0 ? 0.05 : i / 10.0, theta = j * 89 / 9.0 * PI / 180;
            albedo(roughness, 1, theta, &mirror, &diffuse);
            /* 1e-3: what this quadrature is off by on the smoothest lobe */
            CHECK(mirror + diffuse <= 1.001, "a mirror of roughness %g seen at %g degrees returns %g", roughness,
                  theta * 180 / PI, mirror + diffuse);
            if (j == 0 && i == 0) CHECK(mirror > 0.99, "a smooth mirror seen from above returns only %g", mirror);
            worst = fmax(worst, mirror);
            least = fmin(least, mirror);
        }
    printf("specular albedo at F0 = 1: %.4f to %.4f\n", least, worst);
}

/* With F0 < 1 the model adds Fresnel's grazing light to a diffuse part that was only reduced by F0. The excess over 1
 * of a white diffuse surface is that addition and no more: (1 - s) times the albedo of Fresnel's power alone.
 * Dielectrics (F0 = 0.04) with a diffuse albedo of at most 0.8 keep below 1 up to 60 degrees. */
TEST(brdf_energy)
{
    for (int i = 1; i <= 5; i++)
        for (int j = 0; j < 8; j++) {
            double roughness = i / 5.0, theta = j * 85 / 7.0 * PI / 180, one, zero, part, diffuse;
            albedo(roughness, 1, theta, &one, &diffuse);
            albedo(roughness, 0, theta, &zero, &diffuse);
            for (int k = 0; k <= 4; k++) {
                double s = k / 4.0;
                albedo(roughness, s, theta, &part, &diffuse);
                double all = diffuse + part;
                CHECK(all <= 1.001 + (1 - s) * zero, "F0 %g, roughness %g, %g degrees: %g", s, roughness,
                      theta * 180 / PI, all);
                CHECK(fabs(part - (s * one + (1 - s) * zero)) < 1e-9, "the specular part is not linear in F0");
            }
            albedo(roughness, 0.04, theta, &part, &diffuse);
            if (theta > 60.5 * PI / 180) continue;
            CHECK(0.8 * diffuse + part <= 1, "dielectric, roughness %g, %g degrees: %g", roughness, theta * 180 / PI,
                  0.8 * diffuse + part);
        }
}

TEST(brdf_no_light_from_below)
{
    ts_rng rng = ts_rng_make(2, TS_STREAM_TEST, 0);
    int below = 0;
    for (int i = 0; i < 20000; i++) {
        double maps[MAP_CHANNELS], l[3], v[3], f[3];
        rd_surface s;
        random_maps(&rng, 0.7, 1, maps);
        rd_decode_double(maps, &s);
        from_angles(PI * (double)ts_rng_uniform(&rng), 2 * PI * (double)ts_rng_uniform(&rng), l);
        from_angles(PI * (double)ts_rng_uniform(&rng), 2 * PI * (double)ts_rng_uniform(&rng), v);
        double nl = s.n[0] * l[0] + s.n[1] * l[1] + s.n[2] * l[2], nv = s.n[0] * v[0] + s.n[1] * v[1] + s.n[2] * v[2];
        rd_brdf(&s, l, v, f, NULL);
        if (nl > 0 && nv > 0) continue;
        below++;
        CHECK(f[0] == 0 && f[1] == 0 && f[2] == 0, "n.l = %g, n.v = %g, but f = %g", nl, nv, f[0]);
    }
    CHECK(below > 5000, "only %d directions were below", below);
}

TEST(brdf_decode)
{
    double maps[MAP_CHANNELS] = {-1, 0, 1, 0.6, 0, 0, -3, NAN, 7};
    rd_surface s;
    rd_decode_double(maps, &s);
    CHECK(s.diffuse[0] == 0 && s.diffuse[1] == 0.5 && s.diffuse[2] == 1, "diffuse");
    CHECK(s.specular[0] == 0 && s.specular[1] == 0 && s.specular[2] == 1, "specular is clamped");
    CHECK(s.slope[MAP_SPECULAR] == 0 && s.slope[MAP_SPECULAR + 1] == 0 && s.slope[MAP_DIFFUSE] == 0.5,
          "no slope outside, one at the ends");
    CHECK(s.roughness == 0.5 && rd_alpha(s.roughness) == 0.25, "roughness");
    CHECK(fabs(s.n[2] - 0.8) < 1e-15 && s.n[0] == 0.6, "normal (%g, %g, %g)", s.n[0], s.n[1], s.n[2]);
    maps[MAP_ROUGHNESS] = -1;
    maps[MAP_NORMAL] = maps[MAP_NORMAL + 1] = 1;
    rd_decode_double(maps, &s);
    CHECK(s.roughness == rd_guards.roughness && s.slope[MAP_ROUGHNESS] == 0, "the floor has no slope");
    double length = s.n[0] * s.n[0] + s.n[1] * s.n[1] + s.n[2] * s.n[2];
    CHECK(fabs(length - 1) < 1e-14 && s.n[2] > 0, "the guarded normal is not a unit vector above the surface");
}

/* Central differences of the reference itself, away from its kinks. */
TEST(brdf_gradient)
{
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, 0);
    double worst = 0;
    int lit = 0;
    for (int i = 0; i < 4000; i++) {
        double maps[MAP_CHANNELS], point[2], at[3], g[3][MAP_CHANNELS], scale = 0;
        for (int k = 0; k < 2; k++) point[k] = (double)ts_rng_range(&rng, -0.5f, 0.5f);
        rd_view views[RD_LOSS_VIEWS + 2], view;
        random_maps(&rng, i % 4 == 3 ? 1.3 : 0.6, 0.97, maps); /* every fourth is often in the normal's guard */
        rd_loss_views(&rng, views);
        views[RD_LOSS_VIEWS] = rd_flash();
        rd_eval_views(&rng, 1, views + RD_LOSS_VIEWS + 1);
        view = views[i % (RD_LOSS_VIEWS + 2)];
        double nxy = maps[MAP_NORMAL] * maps[MAP_NORMAL] + maps[MAP_NORMAL + 1] * maps[MAP_NORMAL + 1];
        if (fabs(nxy - 1) < 1e-3 || fabs(maps[MAP_NORMAL]) > 0.999 || fabs(maps[MAP_NORMAL + 1]) > 0.999) continue;
        maps[MAP_ROUGHNESS] = fmax(maps[MAP_ROUGHNESS], -0.95);
        rd_radiance(maps, point, &view, at, g);
        for (int c = 0; c < 3; c++)
            for (int m = 0; m < MAP_CHANNELS; m++) scale = farther(scale, fabs(g[c][m]));
        for (int m = 0; m < MAP_CHANNELS; m++) {
            double h = 1e-6, up[3], down[3], keep = maps[m];
            maps[m] = keep + h;
            rd_radiance(maps, point, &view, up, NULL);
            maps[m] = keep - h;
            rd_radiance(maps, point, &view, down, NULL);
            maps[m] = keep;
            if ((up[0] > 0) != (down[0] > 0)) continue; /* across the horizon */
            for (int c = 0; c < 3; c++) {
                double difference = (up[c] - down[c]) / (2 * h), error = fabs(difference - g[c][m]) / (scale + 1e-3);
                lit += at[c] > 0;
                worst = fmax(worst, error);
                CHECK(error < 1e-4, "pixel %d, d rgb[%d] / d map[%d] = %.9g, by differences %.9g", i, c, m, g[c][m],
                      difference);
            }
        }
    }
    CHECK(lit > 20000, "only %d lit", lit);
    printf("gradient against differences: worst %.2g of %d\n", worst, lit);
}
