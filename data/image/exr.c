/* maps.exr through OpenEXR's C core: channels diffuse.R .G .B, normal.X .Y .Z, roughness.Y, specular.R .G .B, and R, G,
 * B, the diffuse once more: programs that know no layers show these. The reader takes the named ones. */
#include "data/image/exr.h"
#include "data/file.h"
#include "data/name.h"
#include "tensor/team.h"
#include <errno.h>
#include <fcntl.h>
#include <openexr.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* In the file's order, which is alphabetical; value k of a pixel is channel k. */
enum { CHANNELS = 10, SHOWN = 3, STORED = SHOWN + CHANNELS };
static const char *const shown[SHOWN] = {"B", "G", "R"}; /* capitals stand before the rest */
static const char *const names[CHANNELS] = {"diffuse.B", "diffuse.G",   "diffuse.R",  "normal.X",   "normal.Y",
                                            "normal.Z",  "roughness.Y", "specular.B", "specular.G", "specular.R"};

static void to_values(const io_texel *t, float v[CHANNELS])
{
    for (int c = 0; c < 3; c++) {
        v[2 - c] = t->diffuse[c];
        v[3 + c] = t->normal[c];
        v[9 - c] = t->specular[c];
    }
    v[6] = t->roughness;
}

static io_texel from_values(const float v[CHANNELS])
{
    io_texel t = {.roughness = v[6]};
    for (int c = 0; c < 3; c++) {
        t.diffuse[c] = v[2 - c];
        t.normal[c] = v[3 + c];
        t.specular[c] = v[9 - c];
    }
    return t;
}

/* The library's own handler prints; ours keeps the first message. */
typedef struct stream {
    char message[256];
    unsigned char *bytes; /* what was written so far */
    size_t size, capacity;
    int fd; /* what is read */
} stream;

/* The stream that this thread has open. exr_get_user_data would take the context's lock, which a file that is written
 * holds when something fails. */
static _Thread_local stream *opened;

static void on_error(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context;
    stream *s = opened;
    if (!s) return;
    if (!s->message[0])
        snprintf(s->message, sizeof s->message, "%s", message ? message : exr_get_error_code_as_string(code));
    for (char *p = s->message; *p; p++)
        if ((unsigned char)*p < 32) *p = ' ';
}

static int64_t on_write(exr_const_context_t context, void *user, const void *buffer, uint64_t size, uint64_t offset,
                        exr_stream_error_func_ptr_t error)
{
    stream *s = user;
    if (offset + size > s->capacity) {
        size_t capacity = (offset + size) * 2;
        unsigned char *bytes = realloc(s->bytes, capacity);
        if (!bytes) {
            error(context, EXR_ERR_OUT_OF_MEMORY, "out of memory");
            return -1;
        }
        memset(bytes + s->capacity, 0, capacity - s->capacity);
        s->bytes = bytes;
        s->capacity = capacity;
    }
    memcpy(s->bytes + offset, buffer, size);
    if (offset + size > s->size) s->size = offset + size;
    return (int64_t)size;
}

static int64_t on_read(exr_const_context_t context, void *user, void *buffer, uint64_t size, uint64_t offset,
                       exr_stream_error_func_ptr_t error)
{
    uint64_t done = 0;
    while (done < size) {
        ssize_t n = pread(((stream *)user)->fd, (char *)buffer + done, size - done, (off_t)(offset + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            error(context, EXR_ERR_READ_IO, "%s", strerror(errno));
            return -1;
        }
        if (n == 0) break;
        done += (uint64_t)n;
    }
    return (int64_t)done;
}

static int64_t on_size(exr_const_context_t context, void *user)
{
    (void)context;
    struct stat info;
    return fstat(((stream *)user)->fd, &info) ? -1 : info.st_size;
}

/* A string attribute of the file: which way the normal's y points. Without it, up. */
static const char y_attribute[] = "normalY", y_up[] = "OpenGL", y_down[] = "DirectX";

/* The named channel that a stored one has the values of. */
static int named(int stored) { return stored < SHOWN ? stored : stored - SHOWN; }

static exr_result_t write_header(exr_context_t f, int size, bool directx, bool half)
{
    enum {
        ZIP_LEVEL = 4
    }; /* as OpenEXR's C++ library has it: zlib's own, 6, takes twice the time to save a twentieth */
    int part = 0;
    exr_result_t r = exr_add_part(f, "maps", EXR_STORAGE_SCANLINE, &part);
    if (!r && half) r = exr_set_zip_compression_level(f, part, ZIP_LEVEL);
    if (!r)
        r = exr_initialize_required_attr_simple(f, part, size, size, half ? EXR_COMPRESSION_ZIP : EXR_COMPRESSION_NONE);
    for (int k = 0; k < STORED && !r; k++) {
        const int c = named(k);
        bool linear = c >= 3 && c <= 6; /* normals and roughness are no colours */
        r = exr_add_channel(f, part, k < SHOWN ? shown[k] : names[c], half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                            linear ? EXR_PERCEPTUALLY_LINEAR : EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    }
    if (!r) r = exr_attr_set_string(f, part, y_attribute, directx ? y_down : y_up);
    return r ? r : exr_write_header(f);
}

/* A chunk that one thread makes, and what it makes it with. */
typedef struct packer {
    exr_encode_pipeline_t encoder;
    exr_result_t (*write)(exr_encode_pipeline_t *encoder); /* the library's, of its turn */
    float *rows;                                           /* [lines][size][CHANNELS] */
    exr_result_t result;
    stream said; /* a message alone */
} packer;

/* Chunks first .. first + count - 1 of so many lines. */
typedef struct packing {
    exr_context_t f;
    const io_material *m;
    bool directx;
    int lines, first;
    packer *packer;
} packing;

static exr_result_t written_later(exr_encode_pipeline_t *encoder)
{
    (void)encoder;
    return EXR_ERR_SUCCESS;
}

static exr_result_t pack(const packing *p, packer *to, int y)
{
    const int size = p->m->size, count = size - y < p->lines ? size - y : p->lines;
    const bool begun = to->write != NULL;
    for (size_t i = 0; i < (size_t)count * (size_t)size; i++) {
        io_texel t = io_texel_get(p->m->maps + ((size_t)y * (size_t)size + i) * MAP_CHANNELS);
        if (p->directx) t.normal[1] = -t.normal[1];
        to_values(&t, to->rows + i * CHANNELS);
    }
    exr_chunk_info_t chunk;
    exr_result_t r = exr_write_scanline_chunk_info(p->f, 0, y, &chunk);
    if (!r)
        r = begun ? exr_encoding_update(p->f, 0, &chunk, &to->encoder)
                  : exr_encoding_initialize(p->f, 0, &chunk, &to->encoder);
    for (int c = 0; c < to->encoder.channel_count && !r; c++) {
        exr_coding_channel_info_t *info = &to->encoder.channels[c];
        info->encode_from_ptr = (const uint8_t *)(to->rows + named(c));
        info->user_pixel_stride = CHANNELS * sizeof(float);
        info->user_line_stride = CHANNELS * (int32_t)sizeof(float) * size;
        info->user_bytes_per_element = sizeof(float);
        info->user_data_type = EXR_PIXEL_FLOAT;
    }
    if (!r && !begun) {
        r = exr_encoding_choose_default_routines(p->f, 0, &to->encoder);
        to->write = to->encoder.write_fn;
        to->encoder.yield_until_ready_fn = to->encoder.write_fn = written_later;
    }
    return r ? r : exr_encoding_run(p->f, 0, &to->encoder);
}

static void pack_one(const void *job, int64_t i)
{
    const packing *p = job;
    packer *to = &p->packer[i];
    stream *outer = opened;
    opened = &to->said;
    to->result = pack(p, to, (p->first + (int)i) * p->lines);
    opened = outer;
}

/* Some chunks at a time are compressed by all threads, then written in their order. */
static exr_result_t write_chunks(exr_context_t f, const io_material *m, bool directx, int lines, packer *packers,
                                 int most, int threads, stream *s)
{
    exr_result_t r = EXR_ERR_SUCCESS;
    const int chunks = (m->size + lines - 1) / lines;
    for (int first = 0; first < chunks && !r; first += most) {
        const int count = chunks - first < most ? chunks - first : most;
        ts_tasks(threads, count, pack_one, &(packing){f, m, directx, lines, first, packers});
        for (int i = 0; i < count && !r; i++) {
            r = packers[i].result;
            if (r) memcpy(s->message, packers[i].said.message, sizeof s->message);
            else r = packers[i].write(&packers[i].encoder);
        }
    }
    for (int i = 0; i < most; i++) exr_encoding_destroy(f, &packers[i].encoder);
    return r;
}

ts_code io_write_maps_exr(const char *path, const io_material *m, bool directx, bool half, int threads, ts_status *st)
{
    const int lines = half ? 16 : 1; /* of a chunk, by the kind of compression */
    enum {
        HEADER = 1 << 16, /* more than it takes, as 16 bytes are more than a line has beside its values; on_write has
                           * the last word */
        PACKERS = 8
    };
    const size_t line = (size_t)m->size * STORED * sizeof(float), rows = (size_t)lines * (size_t)m->size * CHANNELS;
    stream s = {.fd = -1, .capacity = HEADER + (size_t)m->size * ((half ? line / 2 : line) + 16)};
    packer packers[PACKERS] = {0};
    float *memory = malloc(PACKERS * rows * sizeof *memory);
    s.bytes = calloc(s.capacity, 1);
    if (!memory || !s.bytes) {
        free(memory), free(s.bytes);
        return ts_fail(st, TS_NOMEM, "%s: no memory for %zu bytes", path, s.capacity);
    }
    for (int i = 0; i < PACKERS; i++) packers[i].rows = memory + (size_t)i * rows;
    exr_context_t f = NULL;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = on_error;
    init.user_data = &s;
    init.write_fn = on_write;
    opened = &s;
    exr_result_t r = exr_start_write(&f, path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (!r) r = write_header(f, m->size, directx, half);
    if (!r) r = write_chunks(f, m, directx, lines, packers, PACKERS, threads, &s);
    exr_result_t finish = exr_finish(&f);
    opened = NULL;
    if (!r) r = finish;
    free(memory);
    ts_code code = r ? ts_fail(st, TS_IO, "%s: %s", path, s.message[0] ? s.message : exr_get_error_code_as_string(r))
                     : io_write_bytes(path, s.bytes, s.size, st);
    free(s.bytes);
    return code;
}

static ts_code read_size(const char *path, exr_context_t f, int *size, ts_status *st)
{
    exr_attr_box2i_t box;
    exr_storage_t storage;
    if (exr_get_data_window(f, 0, &box) || exr_get_storage(f, 0, &storage))
        return ts_fail(st, TS_FORMAT, "%s: damaged header", path);
    int64_t width = (int64_t)box.max.x - box.min.x + 1, height = (int64_t)box.max.y - box.min.y + 1;
    if (storage != EXR_STORAGE_SCANLINE)
        return ts_fail(st, TS_UNSUPPORTED, "%s: stored in tiles or deep; only scan lines are read", path);
    if (width != height || width < 1)
        return ts_fail(st, TS_FORMAT, "%s: maps of %lld x %lld pixels are not square", path, (long long)width,
                       (long long)height);
    if (width * height > IO_MAX_PIXELS_DEFAULT)
        return ts_fail(st, TS_UNSUPPORTED, "%s: %lld x %lld pixels are more than the limit of %d", path,
                       (long long)width, (long long)height, IO_MAX_PIXELS_DEFAULT);
    const exr_attr_chlist_t *list = NULL;
    if (exr_get_channels(f, 0, &list)) return ts_fail(st, TS_FORMAT, "%s: damaged header", path);
    for (int k = 0; k < CHANNELS; k++) {
        int found = 0;
        for (int c = 0; c < list->num_channels; c++)
            if (!strcmp(list->entries[c].name.str, names[k]))
                found = list->entries[c].x_sampling == 1 && list->entries[c].y_sampling == 1 ? 1 : -1;
        if (found < 1)
            return ts_fail(st, TS_FORMAT, "%s: channel %s is %s", path, names[k], found ? "subsampled" : "missing");
    }
    *size = (int)width;
    return TS_OK;
}

static bool points_down(exr_context_t f)
{
    const char *text = NULL;
    int32_t length = 0;
    return !exr_attr_get_string(f, 0, y_attribute, &length, &text) && text && length == (int32_t)strlen(y_down) &&
        !memcmp(text, y_down, (size_t)length);
}

static exr_result_t read_chunks(exr_context_t f, io_material *m, float *rows, int lines, int first_line)
{
    bool directx = points_down(f);
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t r = EXR_ERR_SUCCESS;
    for (int y = 0; y < m->size && !r; y += lines) {
        int count = m->size - y < lines ? m->size - y : lines;
        exr_chunk_info_t chunk;
        r = exr_read_scanline_chunk_info(f, 0, first_line + y, &chunk);
        if (!r)
            r = y == 0 ? exr_decoding_initialize(f, 0, &chunk, &decoder) : exr_decoding_update(f, 0, &chunk, &decoder);
        for (int c = 0; c < decoder.channel_count && !r; c++) {
            exr_coding_channel_info_t *info = &decoder.channels[c];
            info->decode_to_ptr = NULL;
            for (int k = 0; k < CHANNELS; k++)
                if (!strcmp(info->channel_name, names[k])) info->decode_to_ptr = (uint8_t *)(rows + k);
            info->user_pixel_stride = CHANNELS * sizeof(float);
            info->user_line_stride = CHANNELS * (int32_t)sizeof(float) * m->size;
            info->user_bytes_per_element = sizeof(float);
            info->user_data_type = EXR_PIXEL_FLOAT;
        }
        if (!r && y == 0) r = exr_decoding_choose_default_routines(f, 0, &decoder);
        if (!r) r = exr_decoding_run(f, 0, &decoder);
        for (size_t i = 0; i < (size_t)count * (size_t)m->size && !r; i++) {
            io_texel t = from_values(rows + i * CHANNELS);
            if (directx) t.normal[1] = -t.normal[1];
            io_texel_put(m->maps + ((size_t)y * (size_t)m->size + i) * MAP_CHANNELS, &t);
        }
    }
    exr_decoding_destroy(f, &decoder);
    return r;
}

static ts_code read_maps(const char *path, exr_context_t f, const stream *s, io_material *m, ts_status *st)
{
    int size = 0, lines = 0;
    ts_code code = read_size(path, f, &size, st);
    if (code != TS_OK) return code;
    exr_attr_box2i_t box;
    if (exr_get_data_window(f, 0, &box) || exr_get_scanlines_per_chunk(f, 0, &lines) || lines < 1)
        return ts_fail(st, TS_FORMAT, "%s: damaged header", path);
    code = io_material_create(m, size, st);
    if (code != TS_OK) return ts_context(st, "%s", path);
    float *rows = calloc((size_t)size * (size_t)lines, CHANNELS * sizeof(float));
    if (!rows) return ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    exr_result_t r = read_chunks(f, m, rows, lines, box.min.y);
    free(rows);
    if (r)
        return ts_fail(st, TS_FORMAT, "%s: damaged or cut short: %s", path,
                       s->message[0] ? s->message : exr_get_error_code_as_string(r));
    io_name_from_path(path, m->name, sizeof m->name);
    return TS_OK;
}

ts_code io_read_maps_exr(const char *path, io_material *m, ts_status *st)
{
    memset(m, 0, sizeof *m);
    ts_code code = io_check_file(path, st);
    if (code != TS_OK) return code;
    stream s = {.fd = open(path, O_RDONLY | O_CLOEXEC)};
    if (s.fd < 0) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    exr_context_t f = NULL;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = on_error;
    init.user_data = &s; /* the library's own file reader would take this place */
    init.read_fn = on_read;
    init.size_fn = on_size;
    opened = &s;
    exr_result_t r = exr_start_read(&f, path, &init);
    code = r ? ts_fail(st, TS_FORMAT, "%s: no EXR file: %s", path,
                       s.message[0] ? s.message : exr_get_error_code_as_string(r))
             : read_maps(path, f, &s, m, st);
    exr_finish(&f);
    opened = NULL;
    close(s.fd);
    if (code != TS_OK) io_material_free(m);
    return code;
}
