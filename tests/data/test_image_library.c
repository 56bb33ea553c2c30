/* The image library is loaded when it is needed and not before, and what is read without it is what it would have read.
 */
#include "data/image/common_read.h"
#include "data/image/image.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static bool library_is_loaded(void)
{
    char line[512];
    bool found = false;
    FILE *f = fopen("/proc/self/maps", "r");
    CHECK(f, "no /proc/self/maps");
    while (fgets(line, sizeof line, f)) found |= strstr(line, "OpenImageIO") != NULL;
    fclose(f);
    return found;
}

static io_image ramp(int width, int height, int channels)
{
    ts_status st = {0};
    io_image image;
    CHECK(io_image_create(&image, width, height, channels, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < width * height * channels; i++) image.data[i] = (float)(i * 7919 % 4099) / 4098;
    return image;
}

/* Without the image library. */
static bool read_quickly(const char *path, int64_t max_pixels, oi_image *image)
{
    bool read = false;
    ts_status st = {0};
    if (!io_read_png_file(path, max_pixels, image, &read, &st) && !read)
        io_read_jpeg_file(path, max_pixels, image, &read, &st);
    CHECK(!st.code || (!read && !image->data), "%s is refused and read", path);
    return read;
}

/* Read both ways, every field and every value the same. False: the quick way passes it on. */
static bool check_same(const char *path)
{
    oi_image quick, slow;
    ts_status st = {0};
    if (!read_quickly(path, IO_MAX_PIXELS_DEFAULT, &quick)) {
        CHECK(!quick.data && !quick.icc, "%s: something is left", path);
        return false;
    }
    CHECK(oi_read(path, IO_MAX_PIXELS_DEFAULT, INFINITY, &slow, &st) == TS_OK, "%s", st.message);
    CHECK(quick.width == slow.width && quick.height == slow.height && quick.channels == slow.channels &&
              quick.levels == slow.levels,
          "%s: %d x %d x %d, not %d x %d x %d", path, quick.width, quick.height, quick.channels, slow.width,
          slow.height, slow.channels);
    CHECK(memcmp(quick.colour, slow.colour, sizeof quick.colour) == 0 && quick.alpha == slow.alpha &&
              quick.grey == slow.grey,
          "%s: channels", path);
    CHECK(quick.orientation == slow.orientation && quick.adobe == slow.adobe && quick.linear == slow.linear &&
              (quick.alpha < 0 || quick.associated == slow.associated) && quick.primaries == slow.primaries &&
              quick.floating == slow.floating,
          "%s: orientation %d and %d, Adobe %d and %d, linear %d and %d, primaries %d and %d", path, quick.orientation,
          slow.orientation, quick.adobe, slow.adobe, quick.linear, slow.linear, quick.primaries, slow.primaries);
    const io_lens *l = &quick.lens, *m = &slow.lens;
    CHECK(l->focal_35mm == m->focal_35mm && fabs(l->focal - m->focal) < 1e-6 * m->focal + 1e-9 &&
              fabs(l->plane - m->plane) < 1e-6 * m->plane + 1e-9 && fabs(l->zoom - m->zoom) < 1e-6 &&
              l->width == m->width && l->height == m->height && l->zoom_in_focal35 == m->zoom_in_focal35,
          "%s: lens %g and %g mm, %g and %g on 35 mm film", path, l->focal, m->focal, l->focal_35mm, m->focal_35mm);
    CHECK(quick.icc_size == slow.icc_size && (!quick.icc_size || memcmp(quick.icc, slow.icc, quick.icc_size) == 0),
          "%s: profiles", path);
    const size_t values = (size_t)quick.width * (size_t)quick.height * (size_t)quick.channels;
    for (size_t i = 0; i < values; i++)
        CHECK(oi_value(&quick, i) == oi_value(&slow, i), "%s: value %zu is %.9g, not %.9g", path, i,
              (double)oi_value(&quick, i), (double)oi_value(&slow, i));
    oi_free(&quick);
    oi_free(&slow);
    return true;
}

TEST(png_and_jpeg_load_no_image_library)
{
    char path[512];
    ts_status st = {0};
    io_image image = ramp(31, 17, 3), back;
    snprintf(path, sizeof path, "%s/a.png", test_folder());
    CHECK(io_write_png(path, &image, 16, true, &st) == TS_OK && io_read_photo(path, 1000, &back, &st) == TS_OK, "%s",
          st.message);
    CHECK(!library_is_loaded(), "a PNG needs the image library");
    io_image_free(&back);
    CHECK(io_read_photo("demo/flash.jpg", IO_MAX_PIXELS_DEFAULT, &back, &st) == TS_OK, "%s", st.message);
    CHECK(!library_is_loaded(), "a JPEG needs the image library");
    io_image_free(&back);
    snprintf(path, sizeof path, "%s/a.jpg", test_folder());
    CHECK(io_write_jpeg(path, &image, 90, &st) == TS_OK, "%s", st.message);
    CHECK(library_is_loaded(), "the image library is not seen in /proc/self/maps");
}

/* Threads of this process beside the first that SIGTERM may go to. */
static int threads_for_signals(void)
{
    char path[300], line[256];
    int found = 0;
    DIR *d = opendir("/proc/self/task");
    CHECK(d, "no /proc/self/task");
    for (struct dirent *e; (e = readdir(d));) {
        if (e->d_name[0] == '.' || atoi(e->d_name) == getpid()) continue;
        snprintf(path, sizeof path, "/proc/self/task/%s/status", e->d_name);
        FILE *f = fopen(path, "r");
        unsigned long long blocked;
        while (f && fgets(line, sizeof line, f))
            if (sscanf(line, "SigBlk: %llx", &blocked) == 1) found += !(blocked >> (SIGTERM - 1) & 1);
        if (f) fclose(f);
    }
    closedir(d);
    return found;
}

static bool library_reads(const char *path)
{
    oi_image image;
    if (oi_read(path, 1 << 20, INFINITY, &image, NULL) != TS_OK) return false;
    oi_free(&image);
    return true;
}

/* Of its parent's threads it has none. */
TEST(image_library_reads_in_a_forked_child)
{
    enum { SIDE = 64 };
    static float values[SIDE * SIDE * 3];
    static uint8_t levels[SIDE * SIDE * 3];
    bytes exr = exr_file(SIDE, SIDE, values, NULL),
          tiff = tiff_file(&(tiff_page){SIDE, SIDE, 3, 8, 2, 1, -1, 1, levels}, 1);
    const char *path[] = {bytes_save(&exr, test_folder(), "a.exr"), bytes_save(&tiff, test_folder(), "a.tif")};
    for (int k = 0; k < 2; k++) CHECK(library_reads(path[k]), "%s is not read", path[k]);
    CHECK(threads_for_signals() == 0, "SIGTERM may go to %d threads of the library", threads_for_signals());
    const pid_t child = fork();
    if (child == 0) {
        alarm(20);
        _exit(library_reads(path[0]) && library_reads(path[1]) ? 0 : 1);
    }
    int status;
    CHECK(child > 0 && waitpid(child, &status, 0) == child, "no child");
    CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 0, "the child ends with status %#x", status);
}

TEST(quick_readers_read_what_the_library_reads)
{
    char path[512];
    ts_status st = {0};
    for (int k = 0; k < 8; k++) {
        io_image image = ramp(37, 5, k % 4 + 1);
        snprintf(path, sizeof path, "%s/%d.png", test_folder(), k);
        const io_rows none = {0};
        CHECK(io_write_png_rows(path, &none, 8, true, &st) == TS_INVALID, "a picture of nothing");
        st = (ts_status){0};
        CHECK(io_write_png(path, &image, k < 4 ? 8 : 16, k % 3 > 0, &st) == TS_OK, "%s", st.message);
        CHECK(check_same(path), "%s is passed on", path);
    }
    bytes profile = icc_profile(icc_display_p3, 0);
    for (int grey = 0; grey < 2; grey++) {
        io_image image = ramp(41, 23, grey ? 1 : 3);
        snprintf(path, sizeof path, "%s/a.jpg", test_folder());
        CHECK(io_write_jpeg(path, &image, 93, &st) == TS_OK, "%s", st.message);
        CHECK(check_same(path), "%s is passed on", path);
        for (int k = 1; k <= 8; k++) {
            bytes b = bytes_load(path);
            uint8_t *own = memmem(b.data, b.size, "Exif", 4); /* the writer's: two are unusual */
            if (own) memcpy(own, "none", 4);
            jpeg_profile(&b, &profile);
            jpeg_orientation(&b, k);
            CHECK(check_same(bytes_save(&b, test_folder(), "turned.jpg")), "orientation %d is passed on", k);
        }
    }
    bytes b = {0};
    const uint8_t rgb[6] = {1, 2, 3, 200, 150, 100};
    png_begin(&b, 2, 1, 8, 2), png_chunk(&b, "tEXt", "Software\0none", 13), png_pixels(&b, rgb, 6, 1), png_end(&b);
    CHECK(check_same(bytes_save(&b, test_folder(), "words.png")), "a PNG with a word about its software is passed on");
}

/* iTXt: keyword, uncompressed, no language, no translated keyword, text. */
static void png_xmp(bytes *b, const char *text)
{
    char chunk[256];
    static const char head[] = "XML:com.adobe.xmp\0\0\0\0"; /* and its own zero */
    memcpy(chunk, head, sizeof head);
    strcpy(chunk + sizeof head, text);
    png_chunk(b, "iTXt", chunk, sizeof head + strlen(text));
}

TEST(quick_reader_of_png_reads_exif_and_passes_over_xmp)
{
    const uint8_t four[4] = {0, 128, 255, 64};
    uint8_t exif[] = "II*\0\10\0\0\0\2\0\22\1\3\0\1\0\0\0\6\0\0\0\151\207\4\0\1\0\0\0\46\0\0\0\0\0\0\0"
                     "\1\0\5\244\3\0\1\0\0\0\32\0\0\0\0\0\0\0";
    static const char *const xmp[] = {"<x exif:FocalLength='4/1'>", "<x tiff:Orientation='6'>", "<x dc:creator='me'>"};
    for (int k = 1; k <= 8; k++)
        for (int behind = 0; behind < 2; behind++) {
            bytes b = {0};
            exif[18] = (uint8_t)k;
            png_begin(&b, 4, 1, 8, 0);
            if (!behind) png_chunk(&b, "eXIf", exif, sizeof exif - 1);
            if (k % 3 != 1) png_xmp(&b, xmp[k % 3]);
            png_pixels(&b, four, 4, 1);
            if (behind) png_chunk(&b, "eXIf", exif, sizeof exif - 1);
            png_end(&b);
            const char *name = bytes_save(&b, test_folder(), "exif.png");
            /* the library reads what stands before the pixels alone */
            CHECK(behind || check_same(name), "orientation %d: passed on", k);
            oi_image quick;
            CHECK(read_quickly(name, 1 << 20, &quick) && quick.orientation == k && quick.lens.focal_35mm == 26,
                  "behind %d: orientation %d, %g mm, not %d and 26", behind, quick.orientation, quick.lens.focal_35mm,
                  k);
            oi_free(&quick);
        }
    for (size_t i = 0; i < sizeof xmp / sizeof *xmp; i++) {
        bytes b = {0};
        png_begin(&b, 4, 1, 8, 0), png_xmp(&b, xmp[i]), png_pixels(&b, four, 4, 1), png_end(&b);
        CHECK(check_same(bytes_save(&b, test_folder(), "xmp.png")) == (i == 2), "%s", xmp[i]);
    }
}

/* EXIF as GIMP and ImageMagick write it into a PNG. */
TEST(quick_reader_of_png_reads_exif_as_text)
{
    static const char digits[] = "0123456789abcdef";
    static const uint8_t four[4] = {0, 128, 255, 64};
    uint8_t exif[] = "Exif\0\0II*\0\10\0\0\0\2\0\22\1\3\0\1\0\0\0\6\0\0\0\151\207\4\0\1\0\0\0\46\0\0\0\0\0\0\0"
                     "\1\0\5\244\3\0\1\0\0\0\32\0\0\0\0\0\0\0";
    const int size = sizeof exif - 1;
    static const struct {
        const char *what, *xmp;
        int orientation, given, cut; /* given: more than there is */
        char wrong;
        bool twice, quick;
    } cases[] = {{"upright", NULL, 1, 0, 0, 0, false, true},
                 {"turned", NULL, 6, 0, 0, 0, false, true},
                 {"mirrored", NULL, 2, 0, 0, 0, false, true},
                 {"upright, and so says GIMP's XMP", "<x tiff:Orientation=\"1\" exif:FocalLength='4/1'>", 1, 0, 0, 0,
                  false, true},
                 {"turned, but not so in the XMP", "<x tiff:Orientation=\"1\">", 6, 0, 0, 0, false, false},
                 {"XMP twice", "<x tiff:Orientation=\"1\" tiff:Orientation=\"6\">", 1, 0, 0, 0, false, false},
                 {"too long a number", NULL, 1, 1, 0, 0, false, false},
                 {"a digit is missing", NULL, 1, 0, 1, 0, false, false},
                 {"a letter that is none", NULL, 1, 0, 0, 'g', false, false},
                 {"two of them", NULL, 1, 0, 0, 0, true, false}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[512];
        exif[24] = (uint8_t)cases[k].orientation;
        int n = snprintf(text, sizeof text, "Raw profile type exif%c\nexif\n %7d\n", 0, size + cases[k].given);
        for (int i = 0; i < size; i++) {
            if (i % 36 == 35) text[n++] = '\n';
            text[n++] = digits[exif[i] >> 4];
            text[n++] = digits[exif[i] & 15];
        }
        n -= cases[k].cut;
        if (cases[k].wrong) text[n - 1] = cases[k].wrong;
        bytes b = {0};
        png_begin(&b, 4, 1, 8, 0);
        for (int i = 0; i <= cases[k].twice; i++) png_chunk(&b, "tEXt", text, (size_t)n);
        if (cases[k].xmp) png_xmp(&b, cases[k].xmp);
        png_pixels(&b, four, 4, 1), png_end(&b);
        const char *name = bytes_save(&b, test_folder(), "gimp.png");
        CHECK(check_same(name) == cases[k].quick, "%s: %s", cases[k].what, cases[k].quick ? "passed on" : "read");
        oi_image quick;
        if (!cases[k].quick) continue;
        CHECK(read_quickly(name, 1 << 20, &quick) && quick.orientation == cases[k].orientation &&
                  quick.lens.focal_35mm == 26,
              "%s: orientation %d, %g mm", cases[k].what, quick.orientation, quick.lens.focal_35mm);
        oi_free(&quick);
    }
}

/* Whatever may change how a picture is seen is left to the library. */
TEST(quick_readers_pass_on_what_is_unusual)
{
    const uint8_t four[4] = {0, 128, 255, 64}, palette[6] = {255, 0, 0, 0, 128, 255};
    bytes b = {0};
    png_begin(&b, 4, 1, 8, 0), png_chunk(&b, "tRNS", "\0\200", 2), png_pixels(&b, four, 4, 1), png_end(&b);
    CHECK(!check_same(bytes_save(&b, test_folder(), "a.png")), "a transparent colour");
    png_begin(&b, 4, 1, 8, 0), png_chunk(&b, "tEXt", "Orientation\0006", 13), png_pixels(&b, four, 4, 1), png_end(&b);
    CHECK(!check_same(bytes_save(&b, test_folder(), "b.png")), "an orientation as text");
    png_begin(&b, 4, 1, 8, 0), png_pixels(&b, four, 4, 1), png_chunk(&b, "tEXt", "Raw profile type exif\0", 22),
        png_end(&b);
    CHECK(!check_same(bytes_save(&b, test_folder(), "c.png")), "a profile as text behind the pixels");
    png_begin(&b, 2, 1, 8, 3), png_chunk(&b, "PLTE", palette, 6), png_pixels(&b, "\1\0", 2, 1), png_end(&b);
    CHECK(!check_same(bytes_save(&b, test_folder(), "d.png")), "a palette");
    png_begin(&b, 8, 1, 1, 0), png_pixels(&b, four, 1, 1), png_end(&b);
    CHECK(!check_same(bytes_save(&b, test_folder(), "e.png")), "one bit");
    b = jpeg_cmyk(four);
    CHECK(!check_same(bytes_save(&b, test_folder(), "f.jpg")), "CMYK");
    char path[512];
    ts_status st = {0};
    io_image image = ramp(64, 64, 3);
    snprintf(path, sizeof path, "%s/g.jpg", test_folder());
    CHECK(io_write_jpeg(path, &image, 93, &st) == TS_OK, "%s", st.message);
    static const struct {
        int marker;
        const char *text;
    } segments[] = {{0xe1, "http://ns.adobe.com/xap/1.0/ <x tiff:Orientation='6'>"},
                    {0xed, "Photoshop 3.0"},
                    {0xfe, "Orientation:6"},
                    {0xe1, "Exif"}};
    for (size_t i = 0; i < sizeof segments / sizeof *segments; i++) {
        b = bytes_load(path);
        char text[64] = {0};
        strcpy(text, segments[i].text);
        jpeg_insert(&b, segments[i].marker, text, i == 3 ? 8 : strlen(text) + 1);
        const char *name = bytes_save(&b, test_folder(), "h.jpg");
        oi_image quick;
        CHECK(!read_quickly(name, 1 << 20, &quick) && !quick.data, "segment %zu is passed over", i);
    }
    b = bytes_load(path);
    b.size -= b.size / 3;
    oi_image quick;
    CHECK(!read_quickly(bytes_save(&b, test_folder(), "i.jpg"), 1 << 20, &quick) && !quick.data, "a file cut short");
    CHECK(!read_quickly(path, 64 * 64 - 1, &quick) && read_quickly(path, 64 * 64, &quick), "the limit");
    oi_free(&quick);
}

/* No byte of a damaged Exif segment leads outside of it (a checker sees the end). */
TEST(damaged_exif)
{
    uint8_t good[] = "Exif\0\0II*\0\10\0\0\0\2\0\22\1\3\0\1\0\0\0\6\0\0\0\151\207\4\0\1\0\0\0\46\0\0\0\0\0\0\0"
                     "\1\0\5\240\4\0\1\0\0\0\70\0\0\0\0\0\0\0\1\0\1\0\2\0\4\0\0\0R03\0\0\0\0\0";
    int orientation;
    bool adobe;
    io_lens lens;
    const size_t size = sizeof good - 1;
    CHECK(io_exif(good, size, &orientation, &adobe, &lens) && orientation == 6 && adobe, "orientation %d, Adobe %d",
          orientation, adobe);
    unsigned state = 1;
    for (int round = 0; round < 50000; round++) {
        state = state * 1664525 + 1013904223;
        const size_t n = round % 3 ? size : (state >> 8) % size + 1;
        uint8_t *copy = malloc(n);
        memcpy(copy, good, n);
        for (int k = 0; k < 2; k++) {
            state = state * 1664525 + 1013904223;
            copy[(state >> 8) % n] = (uint8_t)(state >> 24);
        }
        io_exif(copy, n, &orientation, &adobe, &lens);
        CHECK(orientation >= 1 && orientation <= 8, "orientation %d", orientation);
        free(copy);
    }
}

TEST(quick_readers_on_real_photographs)
{
    char folder[512], path[1024];
    snprintf(folder, sizeof folder, "%s/photos", test_data());
    DIR *d = opendir(folder);
    if (!d) test_skip("%s is absent", folder);
    int quick = 0, all = 0;
    for (struct dirent *e; (e = readdir(d));) {
        if (e->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        quick += check_same(path);
        all++;
    }
    closedir(d);
    CHECK(quick == all, "%d of %d photographs need the library", all - quick, all);
}
