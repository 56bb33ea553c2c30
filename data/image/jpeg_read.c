/* Ordinary JPEG files, without the image library (data/image/common_read.h). */
#include "data/image/common_read.h"
#include "data/image/header.h"
#include "tensor/memory.h"
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h> /* after stdio.h, whose FILE it needs */

typedef struct reading {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    jmp_buf back;
    FILE *file;
    JOCTET *profile;
    oi_image *image;
    const char *path;
    int64_t max_pixels;
    ts_status *st; /* of what is refused */
    ts_code refused;
} reading;

static void on_error(j_common_ptr jpeg) { longjmp(((reading *)jpeg->client_data)->back, 1); }
static void on_message(j_common_ptr jpeg) { (void)jpeg; }
static void on_emit(j_common_ptr jpeg, int level)
{
    if (level < 0) jpeg->err->num_warnings++; /* damage that the library would go on with */
}

static bool contains(const JOCTET *bytes, size_t size, const char *word)
{
    return memmem(bytes, size, word, strlen(word)) != NULL;
}

/* Everything beside the pixels that may say how they are to be seen. */
static bool markers(reading *r)
{
    bool exif = false, extended = false;
    r->image->orientation = 1;
    for (jpeg_saved_marker_ptr m = r->jpeg.marker_list; m; m = m->next) {
        if (m->data_length != m->original_length) return false;
        if (m->marker == JPEG_APP0 + 1 && m->data_length >= 6 && memcmp(m->data, "Exif\0\0", 6) == 0) {
            if (exif || !io_exif(m->data, m->data_length, &r->image->orientation, &r->image->adobe, &r->image->lens))
                return false;
            exif = true;
        } else if (m->marker == JPEG_APP0 + 1) {
            /* XMP: seldom has more to say than the Exif segment */
            extended = contains(m->data, m->data_length, "rientation") ||
                contains(m->data, m->data_length, "nteroperability");
            if (extended || contains(m->data, m->data_length, "ExtensionForm")) return false;
        } else if (m->marker == JPEG_COM && contains(m->data, m->data_length, ":"))
            return false;                                   /* "key: value" comments exist */
        else if (m->marker == JPEG_APP0 + 13) return false; /* IPTC */
    }
    return true;
}

static bool pixels(reading *r)
{
    oi_image *image = r->image;
    const size_t values = (size_t)image->width * (size_t)image->channels;
    image->type = OI_U8;
    image->data = ts_memory(values * (size_t)image->height);
    if (!image->data) return false;
    for (int y = 0; y < image->height; y++) {
        JSAMPROW row = (JSAMPROW)image->data + (size_t)y * values;
        if (jpeg_read_scanlines(&r->jpeg, &row, 1) != 1) return false;
    }
    return true;
}

/* What the library and we take for it: the pixels, and of a file whose components or bits come in several scans all its
 * coefficients. */
static double bytes_of(reading *r)
{
    double coefficients = 0;
    if (jpeg_has_multiple_scans(&r->jpeg))
        for (int c = 0; c < r->jpeg.num_components; c++)
            coefficients += (double)r->jpeg.comp_info[c].width_in_blocks * r->jpeg.comp_info[c].height_in_blocks *
                sizeof(JBLOCK);
    return coefficients + (double)r->jpeg.image_width * r->jpeg.image_height * r->jpeg.num_components;
}

static bool work(reading *r)
{
    if (setjmp(r->back)) return false;
    jpeg_create_decompress(&r->jpeg);
    jpeg_stdio_src(&r->jpeg, r->file);
    for (int marker = 1; marker <= 13; marker++)
        if (marker < 3 || marker == 13) jpeg_save_markers(&r->jpeg, JPEG_APP0 + marker, 0xffff);
    jpeg_save_markers(&r->jpeg, JPEG_COM, 0xffff);
    if (jpeg_read_header(&r->jpeg, TRUE) != JPEG_HEADER_OK) return false;
    r->refused = io_check_claim(r->path, r->jpeg.image_width, r->jpeg.image_height, r->max_pixels, bytes_of(r), r->st);
    if (r->refused) return false;
    const J_COLOR_SPACE space = r->jpeg.jpeg_color_space;
    if (space != JCS_GRAYSCALE && space != JCS_YCbCr && space != JCS_RGB) return false;
    if (r->jpeg.data_precision != 8 || !markers(r)) return false;
    oi_image *image = r->image;
    image->width = (int)r->jpeg.image_width;
    image->height = (int)r->jpeg.image_height;
    image->channels = space == JCS_GRAYSCALE ? 1 : 3;
    image->levels = 256;
    image->alpha = -1;
    image->grey = image->channels == 1;
    for (int c = 0; c < 3; c++) image->colour[c] = image->grey ? 0 : c;
    unsigned size = 0;
    if (jpeg_read_icc_profile(&r->jpeg, &r->profile, &size) && size > 128) {
        image->icc = r->profile;
        image->icc_size = size;
        r->profile = NULL;
    }
    if (!jpeg_start_decompress(&r->jpeg) || r->jpeg.output_components != image->channels || !pixels(r)) return false;
    return jpeg_finish_decompress(&r->jpeg) && r->errors.num_warnings == 0;
}

ts_code io_read_jpeg_file(const char *path, int64_t max_pixels, oi_image *image, bool *read, ts_status *st)
{
    reading r = {.image = image, .path = path, .max_pixels = max_pixels, .st = st, .file = fopen(path, "rbe")};
    memset(image, 0, sizeof *image);
    int a = r.file ? getc(r.file) : 0, b = r.file ? getc(r.file) : 0;
    bool done = false;
    if (a == 0xff && b == 0xd8 && fseek(r.file, 0, SEEK_SET) == 0) {
        r.jpeg.err = jpeg_std_error(&r.errors);
        r.jpeg.client_data = &r;
        r.errors.error_exit = on_error;
        r.errors.output_message = on_message;
        r.errors.emit_message = on_emit;
        done = work(&r);
        jpeg_destroy_decompress(&r.jpeg);
    }
    if (r.file) fclose(r.file);
    free(r.profile);
    if (!done) oi_free(image);
    *read = done;
    return r.refused;
}
