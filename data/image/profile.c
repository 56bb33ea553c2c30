#include "data/image/profile.h"
#include <lcms2.h>
#include <stdio.h>
#include <stdlib.h>

struct io_profile {
    cmsHTRANSFORM transform;
    bool grey;
};

static void be_silent(cmsContext context, cmsUInt32Number code, const char *text)
{
    (void)context, (void)code, (void)text;
}

/* sRGB's primaries and white with straight curves. */
static cmsHPROFILE linear_srgb(cmsContext context)
{
    const cmsCIExyY white = {0.3127, 0.3290, 1};
    const cmsCIExyYTRIPLE primaries = {{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}};
    cmsToneCurve *straight = cmsBuildGamma(context, 1);
    cmsToneCurve *const curves[3] = {straight, straight, straight};
    cmsHPROFILE profile = straight ? cmsCreateRGBProfileTHR(context, &white, &primaries, curves) : NULL;
    if (straight) cmsFreeToneCurve(straight);
    return profile;
}

io_profile *io_profile_open(const uint8_t *bytes, size_t length, bool grey, char *name, size_t size)
{
    io_profile *p = calloc(1, sizeof *p);
    cmsContext context = cmsCreateContext(NULL, NULL);
    snprintf(name, size, "without a name");
    if (!p || !context || length > UINT32_MAX) {
        if (context) cmsDeleteContext(context);
        free(p);
        return NULL;
    }
    cmsSetLogErrorHandlerTHR(context, be_silent);
    cmsHPROFILE from = cmsOpenProfileFromMemTHR(context, bytes, (cmsUInt32Number)length), to = linear_srgb(context);
    if (from) {
        char ascii[96] = "";
        if (cmsGetProfileInfoASCII(from, cmsInfoDescription, "en", "US", ascii, sizeof ascii) > 1)
            snprintf(name, size, "%s", ascii);
        for (char *c = name; *c; c++)
            if ((unsigned char)*c < 32 || (unsigned char)*c > 126) *c = '?';
    }
    const cmsColorSpaceSignature space = from ? cmsGetColorSpace(from) : 0;
    if (to && space == (grey ? cmsSigGrayData : cmsSigRgbData))
        p->transform = cmsCreateTransformTHR(context, from, grey ? TYPE_GRAY_FLT : TYPE_RGB_FLT, to, TYPE_RGB_FLT,
                                             INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE | cmsFLAGS_NOOPTIMIZE);
    p->grey = grey;
    if (from) cmsCloseProfile(from);
    if (to) cmsCloseProfile(to);
    if (p->transform) return p;
    cmsDeleteContext(context);
    free(p);
    return NULL;
}

void io_profile_close(io_profile **profile)
{
    io_profile *p = *profile;
    if (!p) return;
    cmsContext context = cmsGetTransformContextID(p->transform);
    cmsDeleteTransform(p->transform);
    cmsDeleteContext(context);
    free(p);
    *profile = NULL;
}

void io_profile_apply(const io_profile *p, float *rgb, int count)
{
    if (!p->grey) {
        cmsDoTransform(p->transform, rgb, rgb, (cmsUInt32Number)count);
        return;
    }
    for (int i = 0; i < count; i++) {
        const float grey = rgb[3 * i];
        cmsDoTransform(p->transform, &grey, rgb + 3 * i, 1);
    }
}
