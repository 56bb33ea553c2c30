/* Ordinary PNG files, without the image library (data/image/common_read.h). */
#include "data/image/common_read.h"
#include "data/image/header.h"
#include "tensor/memory.h"
#include <ctype.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct reading {
    FILE *file;
    png_structp png;
    png_infop info;
    oi_image *image;
    const char *path;
    int64_t max_pixels;
    ts_status *st; /* of what is refused */
    ts_code refused;
    int bits;
    volatile bool odd; /* set by what libpng warns about */
} reading;

static void on_error(png_structp png, png_const_charp message)
{
    (void)message;
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
    (void)message;
    ((reading *)png_get_error_ptr(png))->odd = true;
}

static const char exif_key[] = "Raw profile type exif", exif_prefix[6] = "Exif\0";

/* XMP that says how the picture is to be seen, or the only one that says how it was taken. GIMP writes orientation 1
 * into every file. */
static bool xmp_is_needed(const char *text, bool exif, int orientation)
{
    static const char upright[] = "tiff:Orientation=\"1\"";
    for (const char *at = text; (at = strstr(at, "rientation")); at++)
        if (orientation != 1 || at - text < 6 || strncmp(at - 6, upright, sizeof upright - 1) != 0) return true;
    return strstr(text, "nteroperability") || (!exif && strstr(text, "FocalLength"));
}

/* Only texts that are known to be words, or EXIF that has been read, are passed over. */
static bool plain_texts(reading *r, bool exif)
{
    static const char *const plain[] = {"Software",    "Comment",     "Title",         "Author",
                                        "Description", "Copyright",   "Source",        "Creation Time",
                                        "date:create", "date:modify", "date:timestamp"};
    png_textp text;
    const int count = png_get_text(r->png, r->info, &text, NULL);
    for (int i = 0; i < count; i++) {
        bool known = strcmp(text[i].key, exif_key) == 0 ||
            (strcmp(text[i].key, "XML:com.adobe.xmp") == 0 &&
             !xmp_is_needed(text[i].text, exif, r->image->orientation));
        for (size_t k = 0; k < sizeof plain / sizeof *plain; k++) known |= strcmp(text[i].key, plain[k]) == 0;
        if (!known) return false;
    }
    return true;
}

/* The bytes of a profile as ImageMagick, exiv2 and GIMP write it: a name, how many, hexadecimal digits. Malloc'd; NULL
 * where it is none. */
static unsigned char *profile_of_text(const char *text, size_t *size)
{
    static const char digits[] = "0123456789abcdef";
    size_t given = 0, nibbles = 0;
    int used = 0;
    if (sscanf(text, " exif %zu%n", &given, &used) != 1 || given > strlen(text) / 2) return NULL;
    unsigned char *bytes = calloc(given + 1, 1);
    bool good = bytes;
    for (const char *at = text + used; good && *at; at++) {
        const char *digit = strchr(digits, tolower((unsigned char)*at));
        if (isspace((unsigned char)*at)) continue;
        good = digit && nibbles < 2 * given;
        if (good) bytes[nibbles / 2] = (unsigned char)(bytes[nibbles / 2] << 4 | (digit - digits)), nibbles++;
    }
    if (good && nibbles == 2 * given) return *size = given, bytes;
    free(bytes);
    return NULL;
}

/* The picture's EXIF, from exif_prefix on, malloc'd; NULL where there is none or it cannot be read. How many it has. */
static int find_exif(reading *r, unsigned char **segment, size_t *size)
{
    png_bytep chunk;
    png_uint_32 length;
    png_textp text;
    int found = 0;
    *segment = NULL;
    if (png_get_eXIf_1(r->png, r->info, &length, &chunk)) {
        *size = sizeof exif_prefix + length;
        *segment = malloc(*size);
        if (*segment) {
            memcpy(*segment, exif_prefix, sizeof exif_prefix);
            memcpy(*segment + sizeof exif_prefix, chunk, length); /* the chunk begins with the TIFF header */
        }
        found++;
    }
    const int count = png_get_text(r->png, r->info, &text, NULL);
    for (int i = 0; i < count; i++)
        if (strcmp(text[i].key, exif_key) == 0 && found++ == 0) *segment = profile_of_text(text[i].text, size);
    return found;
}

/* What may say how the pixels are to be seen: before them, or all of it, for more may stand behind them. */
static bool beside(reading *r, bool all)
{
    unsigned char *segment;
    size_t size = 0;
    oi_image *image = r->image;
    const int found = find_exif(r, &segment, &size);
    const bool ordinary = !found ||
        (found == 1 && segment && io_exif(segment, size, &image->orientation, &image->adobe, &image->lens));
    free(segment);
    return ordinary && plain_texts(r, found || !all);
}

static bool supported(reading *r)
{
    const bool profile = png_get_valid(r->png, r->info, PNG_INFO_iCCP),
               other = png_get_valid(r->png, r->info, PNG_INFO_gAMA | PNG_INFO_cHRM | PNG_INFO_sRGB);
    return r->bits >= 8 && png_get_color_type(r->png, r->info) != PNG_COLOR_TYPE_PALETTE &&
        !png_get_valid(r->png, r->info, PNG_INFO_tRNS) &&
        png_get_interlace_type(r->png, r->info) == PNG_INTERLACE_NONE && !(profile && other) && beside(r, false);
}

static bool profile(reading *r)
{
    png_charp name;
    png_bytep bytes;
    png_uint_32 size;
    int method;
    if (!png_get_iCCP(r->png, r->info, &name, &method, &bytes, &size) || size <= 128) return true;
    if (!(r->image->icc = malloc(size))) return false;
    memcpy(r->image->icc, bytes, size);
    r->image->icc_size = size;
    return true;
}

static bool pixels(reading *r)
{
    oi_image *image = r->image;
    const size_t row = (size_t)image->width * (size_t)image->channels * (size_t)(r->bits / 8);
    image->type = r->bits == 8 ? OI_U8 : OI_U16;
    image->data = ts_memory(row * (size_t)image->height);
    if (!image->data) return false;
    const uint16_t one = 1;
    if (r->bits == 16 && *(const uint8_t *)&one) png_set_swap(r->png); /* the file's are big endian */
    for (int y = 0; y < image->height; y++) png_read_row(r->png, (png_bytep)image->data + (size_t)y * row, NULL);
    return true;
}

/* In a function of its own, so that nothing that changes lives in the frame that setjmp returns to. */
static bool work(reading *r)
{
    if (setjmp(png_jmpbuf(r->png))) return false;
    png_init_io(r->png, r->file);
    png_set_user_limits(r->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX); /* ours are checked below */
    png_read_info(r->png, r->info);
    oi_image *image = r->image;
    r->bits = png_get_bit_depth(r->png, r->info);
    r->refused = io_check_claim(
        r->path, png_get_image_width(r->png, r->info), png_get_image_height(r->png, r->info), r->max_pixels,
        (double)png_get_rowbytes(r->png, r->info) * png_get_image_height(r->png, r->info), r->st);
    image->orientation = 1;
    if (r->refused || !supported(r)) return false;
    image->width = (int)png_get_image_width(r->png, r->info);
    image->height = (int)png_get_image_height(r->png, r->info);
    image->channels = png_get_channels(r->png, r->info);
    image->levels = r->bits == 8 ? 256 : 65536;
    image->grey = image->channels < 3;
    image->alpha = image->channels % 2 == 0 ? image->channels - 1 : -1;
    for (int c = 0; c < 3; c++) image->colour[c] = image->grey ? 0 : c;
    if (!profile(r) || !pixels(r)) return false;
    png_read_end(r->png, r->info);
    return beside(r, true) && !r->odd;
}

ts_code io_read_png_file(const char *path, int64_t max_pixels, oi_image *image, bool *read, ts_status *st)
{
    reading r = {.image = image, .path = path, .max_pixels = max_pixels, .st = st};
    memset(image, 0, sizeof *image);
    r.file = fopen(path, "rbe");
    png_byte head[8];
    const bool png = r.file && fread(head, 1, sizeof head, r.file) == sizeof head &&
        png_sig_cmp(head, 0, sizeof head) == 0;
    bool done = false;
    if (png && fseek(r.file, 0, SEEK_SET) == 0 &&
        (r.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &r, on_error, on_warning))) {
        r.info = png_create_info_struct(r.png);
        done = r.info && work(&r);
        png_destroy_read_struct(&r.png, &r.info, NULL);
    }
    if (r.file) fclose(r.file);
    if (!done) oi_free(image);
    *read = done;
    return r.refused;
}
