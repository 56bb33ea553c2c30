/* Colour profiles that are look-up tables; WebP's orientation, alpha and profile. */
#include "data/image/image.h"
#include "infer/angle.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <lcms2.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lab or XYZ of sRGB with red and blue exchanged, so that taking the file for sRGB is seen. */
static cmsInt32Number sample(const cmsUInt16Number in[], cmsUInt16Number out[], void *transform)
{
    const cmsUInt16Number exchanged[3] = {in[2], in[1], in[0]};
    cmsDoTransform(transform, exchanged, out, 1);
    return 1;
}

static bytes saved(cmsHPROFILE p)
{
    cmsUInt32Number size = 0;
    bytes b = {0};
    CHECK(cmsSaveProfileToMem(p, NULL, &size) && size > 0, "the profile has no size");
    uint8_t *memory = malloc(size);
    CHECK(cmsSaveProfileToMem(p, memory, &size), "the profile is not saved");
    put(&b, memory, size);
    free(memory);
    return b;
}

/* kind: cmsSigRgbData, or another space, whose profile no RGB file can use. both: of XYZ, with sRGB's matrix and curves
 * too. */
static bytes table_profile(cmsColorSpaceSignature kind, bool both)
{
    const unsigned channels = kind == cmsSigRgbData ? 3 : 4;
    cmsHPROFILE srgb = cmsCreate_sRGBProfile(), to = both ? cmsCreateXYZProfile() : cmsCreateLab4Profile(NULL),
                p = cmsCreateProfilePlaceholder(NULL);
    cmsHTRANSFORM transform = cmsCreateTransform(srgb, TYPE_RGB_16, to, both ? TYPE_XYZ_16 : TYPE_Lab_16,
                                                 INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
    cmsPipeline *pipeline = cmsPipelineAlloc(NULL, channels, 3);
    cmsStage *table = cmsStageAllocCLut16bit(NULL, channels == 3 ? 21 : 2, channels, 3, NULL);
    cmsMLU *name = cmsMLUalloc(NULL, 1);
    CHECK(srgb && to && p && transform && pipeline && table && name, "lcms2 has no memory");
    CHECK(cmsStageSampleCLut16bit(table, sample, transform, 0) &&
              cmsPipelineInsertStage(pipeline, cmsAT_END, cmsStageAllocToneCurves(NULL, channels, NULL)) &&
              cmsPipelineInsertStage(pipeline, cmsAT_END, table) &&
              cmsPipelineInsertStage(pipeline, cmsAT_END, cmsStageAllocToneCurves(NULL, 3, NULL)),
          "the table is not made");
    cmsMLUsetASCII(name, "en", "US", "exchanged");
    cmsSetProfileVersion(p, 4.3);
    cmsSetDeviceClass(p, cmsSigInputClass);
    cmsSetColorSpace(p, kind);
    cmsSetPCS(p, both ? cmsSigXYZData : cmsSigLabData);
    CHECK(cmsWriteTag(p, cmsSigAToB0Tag, pipeline) && cmsWriteTag(p, cmsSigProfileDescriptionTag, name) &&
              cmsWriteTag(p, cmsSigMediaWhitePointTag, cmsD50_XYZ()),
          "the profile is not made");
    static const cmsTagSignature simple[] = {cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag,
                                             cmsSigRedTRCTag,      cmsSigGreenTRCTag,      cmsSigBlueTRCTag};
    for (int i = 0; both && i < 6; i++)
        CHECK(cmsWriteTag(p, simple[i], cmsReadTag(srgb, simple[i])), "tag %d is not made", i);
    const bytes b = saved(p);
    cmsMLUfree(name);
    cmsPipelineFree(pipeline);
    cmsDeleteTransform(transform);
    cmsCloseProfile(p), cmsCloseProfile(to), cmsCloseProfile(srgb);
    return b;
}

static void check_tables(bool both)
{
    enum { N = 8 };
    uint8_t pixels[N * 3];
    for (int i = 0; i < N * 3; i++) pixels[i] = (uint8_t)(37 * i % 256);
    bytes profile = table_profile(cmsSigRgbData, both), b = {0};
    png_begin(&b, N, 1, 8, 2), png_profile(&b, &profile), png_pixels(&b, pixels, N * 3, 1), png_end(&b);
    bytes_free(&profile);
    const char *path = bytes_save(&b, test_folder(), "p.png");
    io_image image, square;
    io_photo_facts facts;
    ts_status st = {0};
    CHECK(!io_read_photo(path, 1 << 20, &image, &st), "%s", st.message);
    for (int i = 0; i < N * 3; i++) {
        const double want = (double)io_srgb_to_linear((float)pixels[i / 3 * 3 + 2 - i % 3] / 255);
        CHECK(fabs((double)image.data[i] - want) < 6e-3, "value %d: %g, not %g", i, (double)image.data[i], want);
    }
    CHECK(!io_read_photo_square(path, 1 << 20, 1, 0, &square, &facts, &st) && !*facts.profile, "'%s' %s", facts.profile,
          st.message);
    io_image_free(&image);
    io_image_free(&square);
}

/* Tables go before a matrix that stands beside them. */
TEST(profile_of_tables)
{
    check_tables(false);
    check_tables(true);
}

/* Of Lab a grey's curve gives L*: half of it is a Y of .18. */
TEST(profile_of_grey_in_lab)
{
    cmsToneCurve *straight = cmsBuildGamma(NULL, 1);
    cmsHPROFILE p = cmsCreateGrayProfile(cmsD50_xyY(), straight);
    CHECK(straight && p, "lcms2 has no memory");
    for (int lab = 0; lab < 2; lab++) {
        const uint8_t half = 128;
        const double l = (100 * half / 255.0 + 16) / 116, want = lab ? l * l * l : half / 255.0;
        if (lab) cmsSetPCS(p, cmsSigLabData);
        bytes profile = saved(p), b = {0};
        png_begin(&b, 1, 1, 8, 0), png_profile(&b, &profile), png_pixels(&b, &half, 1, 1), png_end(&b);
        bytes_free(&profile);
        ts_status st = {0};
        io_image image;
        CHECK(!io_read_photo(bytes_save(&b, test_folder(), "g.png"), 1 << 20, &image, &st), "%s", st.message);
        for (int c = 0; c < 3; c++)
            CHECK(fabs((double)image.data[c] - want) < 2e-3, "Lab %d: %g, not %g", lab, (double)image.data[c], want);
        io_image_free(&image);
    }
    cmsCloseProfile(p);
    cmsFreeToneCurve(straight);
}

/* A PNG's chunks: sRGB goes before what EXIF says (R03 is Adobe RGB's), and with Adobe RGB's primaries a gamma of 1/2.2
 * is no word for sRGB's curve. */
TEST(png_chunks_of_colour)
{
    static const uint8_t exif[] = "II*\0\10\0\0\0\1\0\151\207\4\0\1\0\0\0\32\0\0\0\0\0\0\0"
                                  "\1\0\5\240\4\0\1\0\0\0\54\0\0\0\0\0\0\0\1\0\1\0\2\0\4\0\0\0R03\0\0\0\0\0",
                         pixel[3] = {200, 150, 100};
    static const uint32_t adobe[8] = {31270, 32900, 64000, 33000, 21000, 71000, 15000, 6000};
    float light[3], curve[3];
    for (int c = 0; c < 3; c++) {
        light[c] = powf((float)pixel[c] / 255, 2.19998f);
        curve[c] = io_srgb_to_linear((float)pixel[c] / 255);
    }
    /* Adobe RGB to sRGB, both with white D65 */
    const float wide[3] = {1.3984f * light[0] - 0.3984f * light[1], light[1], 1.0429f * light[2] - 0.0429f * light[1]};
    for (int k = 0; k < 3; k++) {
        bytes b = {0}, gamma = {0}, primaries = {0};
        png_begin(&b, 1, 1, 8, 2);
        if (k == 0) png_chunk(&b, "sRGB", "\0", 1);
        if (k < 2) png_chunk(&b, "eXIf", exif, sizeof exif - 1);
        put32(&gamma, 45455);
        for (int i = 0; i < 8; i++) put32(&primaries, adobe[i]);
        if (k == 2) png_chunk(&b, "gAMA", gamma.data, 4), png_chunk(&b, "cHRM", primaries.data, 32);
        bytes_free(&gamma), bytes_free(&primaries);
        png_pixels(&b, pixel, 3, 1), png_end(&b);
        ts_status st = {0};
        io_image image;
        CHECK(!io_read_photo(bytes_save(&b, test_folder(), "c.png"), 1 << 20, &image, &st), "%s", st.message);
        for (int c = 0; c < 3; c++)
            CHECK(fabsf(image.data[c] - (k ? wide[c] : curve[c])) < 2e-3f, "case %d: channel %d is %g, not %g", k, c,
                  (double)image.data[c], (double)(k ? wide[c] : curve[c]));
        io_image_free(&image);
    }
}

/* One of another kind of colours is named, and sRGB assumed. */
TEST(profile_that_cannot_be_used_is_named)
{
    char path[512];
    ts_status st = {0};
    io_image image, square;
    io_photo_facts facts;
    CHECK(!io_image_create(&image, 16, 16, 3, &st), "%s", st.message);
    for (int i = 0; i < 16 * 16 * 3; i++) image.data[i] = 0.25f;
    snprintf(path, sizeof path, "%s/a.jpg", test_folder());
    CHECK(!io_write_jpeg(path, &image, 95, &st), "%s", st.message);
    bytes jpeg = bytes_load(path), profile = table_profile(cmsSigCmykData, false);
    jpeg_profile(&jpeg, &profile);
    CHECK(!io_read_photo_square(bytes_save(&jpeg, test_folder(), "b.jpg"), 1 << 20, 4, 0, &square, &facts, &st), "%s",
          st.message);
    CHECK(strcmp(facts.profile, "exchanged") == 0, "'%s' is reported", facts.profile);
    CHECK(fabsf(square.data[0] - 0.25f) < 0.01f, "%g, not sRGB", (double)square.data[0]);
    const io_corners corners = {{{2, 2}, {14, 2}, {14, 14}, {2, 14}}};
    lgd_rectified r;
    snprintf(path, sizeof path, "%s/b.jpg", test_folder());
    CHECK(!lgd_rectify(path, &corners, 1 << 20, 4, 50, 1, &r, &st), "%s", st.message);
    CHECK(strcmp(r.profile, "exchanged") == 0, "'%s' is reported of the rectified one", r.profile);
    io_image_free(&r.square);
    io_image_free(&image);
    io_image_free(&square);
}

/* So is a PNG's that libpng refuses: of another number of colours than the image, or damaged. */
TEST(profile_that_libpng_refuses_is_named)
{
    static const uint8_t pixel[3] = {137, 137, 137}, stored[] = "of a scanner\0\0these bytes are not deflated";
    for (int damaged = 0; damaged < 2; damaged++) {
        bytes b = {0}, profile = table_profile(cmsSigCmykData, false);
        ts_status st = {0};
        io_image square;
        io_photo_facts facts;
        png_begin(&b, 1, 1, 8, 2);
        if (damaged) png_chunk(&b, "iCCP", stored, sizeof stored - 1);
        else png_profile(&b, &profile);
        png_pixels(&b, pixel, 3, 1), png_end(&b);
        bytes_free(&profile);
        CHECK(!io_read_photo_square(bytes_save(&b, test_folder(), "p.png"), 1 << 20, 1, 0, &square, &facts, &st), "%s",
              st.message);
        CHECK(*facts.profile && (!damaged || !strcmp(facts.profile, "of a scanner")), "'%s' is reported",
              facts.profile);
        CHECK(fabsf(square.data[0] - 0.25f) < 0.01f, "%g, not sRGB", (double)square.data[0]);
        io_image_free(&square);
    }
}

static void chunk(bytes *b, const char *type, const void *data, size_t size)
{
    put(b, type, 4), put32le(b, (uint32_t)size), put(b, data, size);
    if (size & 1) put8(b, 0);
}

/* 4 x 2 pixels of (200, 100, 50), the lower half with an alpha of 128, by cwebp -lossless -exact. */
static const uint8_t lossless[] = {0x2f, 0x03, 0x40, 0x00, 0x10, 0x0f, 0x30, 0x64, 0x83, 0x3c,
                                   0x32, 0xff, 0x03, 0x8c, 0x07, 0xcc, 0x43, 0x44, 0xff, 0x23};

/* Turned by EXIF, with "Exif" before the header as some write or without as the format says; alpha over black in linear
 * light, as of a PNG. */
TEST(webp_is_turned_and_transparent_as_png)
{
    static const uint8_t exif[] = "Exif\0\0II*\0\10\0\0\0\1\0\22\1\3\0\1\0\0\0\6\0\0\0\0\0\0\0";
    const uint8_t extended[10] = {0x18, 0, 0, 0, 3, 0, 0, 1, 0, 0}; /* alpha, EXIF; 4 x 2 */
    for (int prefix = 0; prefix < 2; prefix++) {
        bytes inner = {0}, b = {0};
        put(&inner, "WEBP", 4);
        chunk(&inner, "VP8X", extended, sizeof extended);
        chunk(&inner, "VP8L", lossless, sizeof lossless);
        chunk(&inner, "EXIF", exif + (prefix ? 0 : 6), sizeof exif - 1 - (prefix ? 0 : 6));
        chunk(&b, "RIFF", inner.data, inner.size);
        bytes_free(&inner);
        io_image image;
        ts_status st = {0};
        CHECK(!io_read_photo(bytes_save(&b, test_folder(), "a.webp"), 1 << 20, &image, &st), "%s", st.message);
        CHECK(image.width == 2 && image.height == 4, "prefix %d: %d x %d", prefix, image.width, image.height);
        for (int i = 0; i < 8; i++) /* a quarter turn: the lower row is the left column */
            for (int c = 0; c < 3; c++) {
                static const float stored[3] = {200, 100, 50};
                const float want = io_srgb_to_linear(stored[c] / 255) * (i % 2 ? 1 : 128.0f / 255);
                CHECK(fabsf(image.data[3 * i + c] - want) < 0.01f * want + 2e-3f, "prefix %d, pixel %d: %g, not %g",
                      prefix, i, (double)image.data[3 * i + c], (double)want);
            }
        io_image_free(&image);
    }
}

/* A profile that exchanges red and blue. */
TEST(webp_has_the_colours_that_its_profile_says)
{
    const uint8_t extended[10] = {0x30, 0, 0, 0, 3, 0, 0, 1, 0, 0}; /* a profile, alpha; 4 x 2 */
    bytes inner = {0}, b = {0}, table = table_profile(cmsSigRgbData, false);
    put(&inner, "WEBP", 4);
    chunk(&inner, "VP8X", extended, sizeof extended);
    chunk(&inner, "ICCP", table.data, table.size);
    chunk(&inner, "VP8L", lossless, sizeof lossless);
    chunk(&b, "RIFF", inner.data, inner.size);
    bytes_free(&inner), bytes_free(&table);
    io_image image;
    ts_status st = {0};
    CHECK(!io_read_photo(bytes_save(&b, test_folder(), "p.webp"), 1 << 20, &image, &st), "%s", st.message);
    for (int c = 0; c < 3; c++) {
        static const float seen[3] = {50, 100, 200};
        const float want = io_srgb_to_linear(seen[c] / 255);
        CHECK(fabsf(image.data[c] - want) < 0.03f * want + 2e-3f, "channel %d: %g, not %g", c, (double)image.data[c],
              (double)want);
    }
    io_image_free(&image);
}
