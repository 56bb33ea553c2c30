#include "data/rectify/sheet_check.h"
#include <math.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double io_sheet_bend(const io_sheet_photo *photo)
{
    const io_pinhole *c = &photo->sight.camera;
    return photo->sight.rms * sqrt(dot(c->at, c->at)) / c->focal * 512;
}

unsigned io_sheet_faults(const io_sheet_photo *photo)
{
    unsigned faults = 0;
    if (photo->sight.tags.count < IO_SHEET_TAGS) faults |= IO_FAULT_MISSING;
    if (photo->edge > IO_SHEET_SHARP) faults |= IO_FAULT_BLURRED;
    if (photo->burnt > IO_SHEET_CLEAR) faults |= IO_FAULT_BURNT;
    if (io_sheet_bend(photo) > IO_SHEET_FLAT) faults |= IO_FAULT_BENT;
    if (io_pinhole_tilt(&photo->sight.camera) > IO_SHEET_STEEP) faults |= IO_FAULT_STEEP;
    return faults;
}

double io_sheet_apart(const io_sheet_set *set)
{
    double widest = 0;
    for (int i = 0; i < set->photos; i++)
        for (int k = 0; k < i; k++) {
            const double *a = set->photo[i].sight.camera.at, *b = set->photo[k].sight.camera.at;
            if (set->photo[i].st.code || set->photo[k].st.code) continue;
            widest = fmax(widest, acos(fmin(dot(a, b) / sqrt(dot(a, a) * dot(b, b)), 1)));
        }
    return 57.29577951308232 * widest;
}
