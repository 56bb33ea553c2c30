/* What is no image, or not wholly: one clear line each, and no memory taken on a header's word. Writing where nothing
 * can be written. */
#include "data/file.h"
#include "data/image/image.h"
#include "tensor/budget.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

/* Reading fails with one line that begins with the path and contains word. */
static void refused(const char *path, const char *word)
{
    ts_status st = {0};
    io_image image;
    CHECK(io_read_photo(path, IO_MAX_PIXELS_DEFAULT, &image, &st) != TS_OK, "%s was read as %d x %d", path, image.width,
          image.height);
    CHECK(!image.data, "%s: memory left", path);
    CHECK(!strncmp(st.message, path, strlen(path)), "the message does not name %s: %s", path, st.message);
    CHECK(strstr(st.message, word), "no \"%s\" in: %s", word, st.message);
    CHECK(!strpbrk(st.message, "\n\r"), "more than one line: %s", st.message);
}

static long peak_kilobytes(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

TEST(not_an_image)
{
    const char *folder = test_folder();
    char path[512];
    snprintf(path, sizeof path, "%s/missing.png", folder);
    refused(path, "No such file");
    refused(folder, "folder");
    bytes b = {0};
    refused(bytes_save(&b, folder, "empty.jpg"), "empty");
    for (int k = 0; k < 4; k++) {
        put(&b, "just some words, and no picture at all\n\n", 40);
        refused(bytes_save(&b, folder, (const char *[]){"words.txt", "words.png", "words.jpg", "words"}[k]), ": ");
    }
    put(&b, "BMW, photographs of the paint, all of them\n", 43); /* begins as a bitmap does */
    refused(bytes_save(&b, folder, "notes.txt"), "is no image");
    for (int k = 4; k < 8; k++) { /* libpng would print its own line about the last of them */
        png_begin(&b, 2, 1, 8, 0), png_pixels(&b, "ab", 2, 1), png_end(&b);
        b.data[k] ^= 0x80;
        refused(bytes_save(&b, folder, "as_text.png"), "its first bytes were changed");
    }
    snprintf(path, sizeof path, "%s/pipe.png", folder);
    CHECK(!mkfifo(path, 0600), "mkfifo");
    refused(path, "not a regular file");
}

TEST(image_of_another)
{
    bytes b = {0};
    put(&b, "x", 1);
    const char *folder = test_folder(), *locked = bytes_save(&b, folder, "locked.png");
    CHECK(!chmod(locked, 0) && !chmod(folder, 0755), "chmod");
    const bool root = geteuid() == 0;
    if (root && seteuid(65534) != 0) test_skip("root may read everything, and cannot be another user here");
    refused(locked, "Permission denied");
    CHECK(!root || !seteuid(0), "seteuid");
}

/* Headers that claim 10^6 x 10^6 pixels (or the most that a format can say). */
TEST(header_bombs)
{
    const char *folder = test_folder();
    bytes b = {0};
    png_begin(&b, 4, 4, 8, 2), png_pixels(&b, "0123456789ab0123456789ab0123456789ab0123456789ab", 12, 4), png_end(&b);
    ts_status st = {0};
    io_image image;
    const char *small = bytes_save(&b, folder, "small.png");
    CHECK(io_read_photo(small, 16, &image, &st) == TS_OK, "%s",
          st.message); /* also loads the readers, for the measurement */
    io_image_free(&image);
    CHECK(io_read_photo(small, 15, &image, &st) == TS_UNSUPPORTED && strstr(st.message, "4 x 4"),
          "16 pixels with a limit of 15: %s", st.message);
    long before = peak_kilobytes();
    for (int colour = 0; colour <= 6; colour += 2) {
        png_begin(&b, 1000000, 1000000, 8, colour), png_pixels(&b, "0123", 4, 1), png_end(&b);
        const char *path = bytes_save(&b, folder, "bomb.png");
        refused(path, "1000000 x 1000000");
        refused(path, "--max-pixels");
    }
    for (int packed = 0; packed < 2; packed++) {
        put(&b, "BM", 2), put32le(&b, 70), put32le(&b, 0), put32le(&b, 54);
        put32le(&b, 40), put32le(&b, 1000000), put32le(&b, 1000000), put16le(&b, 1), put16le(&b, packed ? 8 : 24),
            put32le(&b, (uint32_t)packed);
        for (int i = 0; i < 9; i++) put32le(&b, 0);
        refused(bytes_save(&b, folder, "bomb.bmp"), "1000000 x 1000000");
    }
    b = tiff_file(&(tiff_page){1000000, 1000000, 3, 8, 2, 1, -1, 1, NULL}, 1);
    refused(bytes_save(&b, folder, "bomb.tif"), "--max-pixels");
    b = exr_file(1000000, 1000000, NULL, NULL);
    refused(bytes_save(&b, folder, "bomb.exr"), "--max-pixels");
    const char *text[] = {"P6\n1000000 1000000\n255\nabc",
                          "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\nabcd",
                          "GIF89a\xff\xff\xff\xff\x80\1\0\1\1\1\2\2\2,\1\1\1\1\xff\xff\xff\xff\1\2\2D\1\0;",
                          "P6\n2000000000 2000000000\n255\n",
                          "P7\nWIDTH 1000000\nHEIGHT 1000000 # as wide\nDEPTH 3\nMAXVAL 255\nTUPLTYPE RGB\nENDHDR\n",
                          "P4 # bits\n# and more\n1000000\n1000000 0"};
    const char *name[] = {"bomb.ppm", "bomb.hdr", "bomb.gif", "bomb2.ppm", "bomb.pam", "bomb.pbm"};
    for (int i = 0; i < 6; i++) {
        put(&b, text[i], strlen(text[i]));
        refused(bytes_save(&b, folder, name[i]), "--max-pixels");
    }
    long taken = peak_kilobytes() - before;
    CHECK(taken < 64 << 10, "%ld KiB were taken for files of a hundred bytes", taken);
}

/* A progressive file's coefficients are all held at once: 20000 x 12000 pixels of them, claimed by a hundred bytes. */
TEST(coefficient_bomb)
{
    static const uint8_t start[] = {0xff, 0xd8}, frame[] = {0xff, 0xc2, 0, 17, 8,    0x2e, 0xe0, 0x4e, 0x20, 3,
                                                            1,    0x11, 0, 2,  0x11, 0,    3,    0x11, 0},
                         scan[] = {0xff, 0xda, 0, 12, 3, 1, 0, 2, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xd9};
    bytes b = {0};
    put(&b, start, sizeof start);
    for (int i = 0; i < 3; i++) { /* tables of the quantisation: all 1 */
        put(&b, "\xff\xdb", 2), put16(&b, 67), put8(&b, (unsigned)i);
        for (int k = 0; k < 64; k++) put8(&b, 1);
    }
    put(&b, frame, sizeof frame), put(&b, scan, sizeof scan);
    const char *path = bytes_save(&b, test_folder(), "progressive.jpg");
    ts_budget_set(1e9);
    const long before = peak_kilobytes();
    refused(path, "20000 x 12000 pixels: about 2.16 GB");
    CHECK(peak_kilobytes() - before < 16 << 10, "%ld KiB were taken first", peak_kilobytes() - before);
    /* the float pixels of what goes to the image library */
    b = tiff_file(&(tiff_page){4, 4, 3, 8, 2, 1, -1, 1, "0123456789ab0123456789ab0123456789ab0123456789ab"}, 1);
    path = bytes_save(&b, test_folder(), "small.tif");
    ts_budget_set(191);
    refused(path, "4 x 4 pixels: about 1.92e-07 GB");
}

/* Every third prefix of a small file of each format. A whole number of scan lines may be missing: still an error. */
TEST(cut_short)
{
    const char *folder = test_folder();
    float pixels[16 * 16 * 3];
    uint8_t small[16 * 16 * 3];
    for (int i = 0; i < 16 * 16 * 3; i++) pixels[i] = (float)(i * 37 % 256) / 255, small[i] = (uint8_t)(i * 37);
    io_image image = {16, 16, 3, pixels};
    ts_status st = {0};
    char path[512];
    for (int kind = 0; kind < 4; kind++) {
        static const char *const name[] = {"a.png", "a.jpg", "a.tif", "a.exr"};
        bytes b;
        snprintf(path, sizeof path, "%s/whole", folder);
        if (kind == 0) CHECK(io_write_png(path, &image, 8, true, &st) == TS_OK, "%s", st.message);
        if (kind == 1) CHECK(io_write_jpeg(path, &image, 90, &st) == TS_OK, "%s", st.message);
        if (kind < 2) b = bytes_load(path);
        else
            b = kind == 2 ? tiff_file(&(tiff_page){16, 16, 3, 8, 2, 1, -1, 1, small}, 1)
                          : exr_file(16, 16, pixels, NULL);
        size_t tail = kind == 0 ? 12 : 0; /* PNG's last chunk holds nothing */
        for (size_t size = 1; size + tail < b.size; size += 3 + b.size / 200) {
            bytes part = {0};
            put(&part, b.data, size);
            refused(bytes_save(&part, folder, name[kind]), ": ");
        }
        bytes_free(&b);
    }
}

/* A real photograph without its last third. */
TEST(photograph_cut_short)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/photos/h_0231_IMG_0794.jpg", test_data());
    bytes b = bytes_load(path);
    b.size = b.size / 3 * 2;
    refused(bytes_save(&b, test_folder(), "photo.jpg"), "cut short");
}

static int entries(const char *folder)
{
    int n = 0;
    DIR *d = opendir(folder);
    CHECK(d, "cannot open %s", folder);
    for (struct dirent *e; (e = readdir(d));) n += e->d_name[0] != '.' || (e->d_name[1] && e->d_name[1] != '.');
    closedir(d);
    return n;
}

static void not_written(ts_code code, const ts_status *st, const char *path)
{
    CHECK(code == TS_IO, "%s: code %d, %s", path, code, st->message);
    CHECK(strstr(st->message, path) && !strchr(st->message, '\n'), "not one line about %s: %s", path, st->message);
}

TEST(writing_fails_cleanly)
{
    const char *folder = test_folder();
    float pixels[64 * 64];
    unsigned state = 1;
    for (int i = 0; i < 64 * 64; i++) pixels[i] = (float)((state = state * 1664525 + 1013904223) >> 8) / (1 << 24);
    io_image image = {64, 64, 1, pixels};
    char path[512], inside[600];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/none/a.png", folder);
    not_written(io_write_png(path, &image, 8, false, &st), &st, path);
    snprintf(path, sizeof path, "%s/file", folder);
    CHECK(io_write_bytes(path, "x", 1, &st) == TS_OK, "%s", st.message);
    snprintf(inside, sizeof inside, "%s/a.png", path);
    not_written(io_write_png(inside, &image, 8, false, &st), &st, inside);
    not_written(io_write_png(folder, &image, 8, false, &st), &st, folder);
    if (access("/dev/full", W_OK) == 0) {
        not_written(io_write_png("/dev/full", &image, 8, false, &st), &st, "/dev/full");
        struct stat info;
        CHECK(!stat("/dev/full", &info) && S_ISCHR(info.st_mode), "the device was replaced");
        snprintf(path, sizeof path, "%s/link.jpg", folder);
        CHECK(!symlink("/dev/full", path), "symlink");
        not_written(io_write_jpeg(path, &image, 90, &st), &st, path);
        unlink(path);
    }
    /* No room: a limit on the size of files stands for a full disk. What was there before stays. */
    snprintf(path, sizeof path, "%s/old.png", folder);
    CHECK(io_write_bytes(path, "old", 3, &st) == TS_OK, "%s", st.message);
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &(struct rlimit){1000, 1000});
    not_written(io_write_png(path, &image, 16, false, &st), &st, path);
    bytes b = bytes_load(path);
    CHECK(b.size == 3 && !memcmp(b.data, "old", 3), "the old file was harmed");
    bytes_free(&b);
    CHECK(entries(folder) == 2, "%d files in the folder, not 2", entries(folder));
}

TEST(writing_replaces_and_follows_links)
{
    const char *folder = test_folder();
    char path[512], link[512], name[300];
    ts_status st = {0};
    memset(name, 'n', 255), name[255] = 0; /* the longest that a file system takes */
    snprintf(path, sizeof path, "%s/%s", folder, name);
    snprintf(link, sizeof link, "%s/link", folder);
    CHECK(io_write_bytes(path, "one", 3, &st) == TS_OK, "%s", st.message);
    CHECK(!symlink(name, link), "symlink");
    CHECK(io_write_bytes(link, "other", 5, &st) == TS_OK, "%s", st.message);
    struct stat info;
    CHECK(!lstat(link, &info) && S_ISLNK(info.st_mode), "the link was replaced");
    bytes b = bytes_load(path);
    CHECK(b.size == 5 && !memcmp(b.data, "other", 5), "the link was not followed");
    bytes_free(&b);
    CHECK(entries(folder) == 2, "%d files in the folder", entries(folder));
}
