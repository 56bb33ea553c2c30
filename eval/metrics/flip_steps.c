/* The steps of FLIP: colour spaces, filters, the colour difference. */
#include "eval/metrics/flip.h"
#include <math.h>

#define PI 3.14159265358979323846

/* sRGB's primaries to XYZ (IEC 61966-2-1; D65 from its chromaticities), as fractions so that nothing is rounded. */
static const double to_xyz[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382},
};

/* XYZ, each divided by the white's. */
static void relative_xyz(const double rgb[3], double xyz[3])
{
    for (int i = 0; i < 3; i++) {
        const double *row = to_xyz[i];
        xyz[i] = (row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]) / (row[0] + row[1] + row[2]);
    }
}

void ev_flip_ycxcz(const double rgb[3], double ycc[3])
{
    double r[3];
    relative_xyz(rgb, r);
    ycc[0] = 116 * r[1] - 16;
    ycc[1] = 500 * (r[0] - r[1]);
    ycc[2] = 200 * (r[1] - r[2]);
}

void ev_flip_rgb(const double ycc[3], double rgb[3])
{
    const double y = (ycc[0] + 16) / 116, r[3] = {y + ycc[1] / 500, y, y - ycc[2] / 200};
    double xyz[3];
    for (int i = 0; i < 3; i++) xyz[i] = r[i] * (to_xyz[i][0] + to_xyz[i][1] + to_xyz[i][2]);
    /* Cramer's rule: the inverse is the matrix above's and no second set of constants. */
    const double(*m)[3] = to_xyz;
    double minor[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
            minor[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    const double det = m[0][0] * minor[0][0] + m[0][1] * minor[0][1] + m[0][2] * minor[0][2];
    for (int j = 0; j < 3; j++) rgb[j] = (minor[0][j] * xyz[0] + minor[1][j] * xyz[1] + minor[2][j] * xyz[2]) / det;
}

/* CIE 15: the cube root, with a line below (6/29)^3. */
static double lab_curve(double t)
{
    const double d = 6.0 / 29;
    return t > d * d * d ? cbrt(t) : t / (3 * d * d) + 4.0 / 29;
}

void ev_flip_lab(const double rgb[3], double lab[3])
{
    double r[3];
    relative_xyz(rgb, r);
    for (int i = 0; i < 3; i++) r[i] = lab_curve(r[i]);
    lab[0] = 116 * r[1] - 16;
    lab[1] = 500 * (r[0] - r[1]);
    lab[2] = 200 * (r[1] - r[2]);
}

void ev_flip_hunt(double lab[3])
{
    lab[1] *= 0.01 * lab[0];
    lab[2] *= 0.01 * lab[0];
}

double ev_flip_hyab(const double a[3], const double b[3])
{
    return fabs(a[0] - b[0]) + sqrt((a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

int ev_flip_csf(int channel, double weight[2], ev_taps taps[2])
{
    /* a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees: a Gaussian of variance b / (2 pi^2). Table 1 of the paper. */
    static const struct {
        int terms;
        double a[2], b[2];
    } table[3] = {{1, {1, 0}, {0.0047, 0}}, {1, {1, 0}, {0.0053, 0}}, {2, {34.1, 13.5}, {0.04, 0.025}}};
    const double widest = 0.04;
    const int radius = (int)ceil(3 * sqrt(widest / (2 * PI * PI)) * EV_FLIP_PPD); /* one radius for all three */
    double total = 0;
    for (int k = 0; k < table[channel].terms; k++) {
        const double sigma = sqrt(table[channel].b[k] / (2 * PI * PI)) * EV_FLIP_PPD;
        double sum = 0;
        for (int i = -radius; i <= radius; i++) sum += exp(-i * i / (2 * sigma * sigma));
        taps[k] = ev_gauss_taps(sigma, radius);
        total += weight[k] = table[channel].a[k] * sqrt(PI / table[channel].b[k]) * sum * sum;
    }
    for (int k = 0; k < table[channel].terms; k++) weight[k] /= total;
    return table[channel].terms;
}

double ev_flip_largest(void)
{
    static const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    double a[3], b[3];
    ev_flip_lab(green, a);
    ev_flip_lab(blue, b);
    ev_flip_hunt(a);
    ev_flip_hunt(b);
    return pow(ev_flip_hyab(a, b), 0.7);
}

double ev_flip_colour(double hyab, double largest)
{
    const double knee = 0.4 * largest, e = pow(hyab, 0.7);
    return e < knee ? 0.95 / knee * e : 0.95 + (e - knee) / (largest - knee) * 0.05;
}

void ev_flip_feature(bool point, ev_taps *derivative, ev_taps *smooth)
{
    const double sigma = 0.5 * 0.082 * EV_FLIP_PPD;
    const int radius = (int)ceil(3 * sigma);
    double sum[2] = {0, 0};
    *smooth = ev_gauss_taps(sigma, radius);
    derivative->radius = radius;
    for (int x = -radius; x <= radius; x++) {
        double *d = &derivative->tap[x + radius];
        *d = (point ? x * x / (sigma * sigma) - 1 : -x) * exp(-x * x / (2 * sigma * sigma));
        sum[*d > 0] += fabs(*d);
    }
    for (int i = 0; i <= 2 * radius; i++) derivative->tap[i] /= sum[derivative->tap[i] > 0];
}
