/* See data/image/oiio.h. The shared object's only source besides tensor/status.c. Each function catches everything: its
 * callers are C. */
#include "data/image/oiio.h"
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/thread.h>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <future>
#include <memory>
#include <new>
#include <thread>
#include <unistd.h>

using namespace OIIO;

/* The library's message as the one line that we promise. */
static std::string one_line(std::string text)
{
    while (!text.empty() && isspace((unsigned char)text.back())) text.pop_back();
    for (char &c : text)
        if ((unsigned char)c < 32) c = ' ';
    return text.empty() ? "no reason given by the image library" : text.substr(0, 300);
}

template <class F> static ts_code guarded(const char *name, ts_status *st, F f)
{
    try {
        return f();
    } catch (const std::bad_alloc &) {
        return ts_fail(st, TS_NOMEM, "%s: out of memory", name);
    } catch (const std::exception &e) {
        return ts_fail(st, TS_FORMAT, "%s: %s", name, one_line(e.what()).c_str());
    } catch (...) {
        return ts_fail(st, TS_FORMAT, "%s: the image library failed", name);
    }
}

static int channel(const ImageSpec &spec, const char *name)
{
    for (int c = 0; c < spec.nchannels; c++)
        if (Strutil::iequals(spec.channelnames[c], name)) return c;
    return -1;
}

/* "beauty." of "beauty.R", or nothing. */
static std::string layer_of(const std::string &name)
{
    const size_t stop = name.rfind('.');
    return stop == std::string::npos ? "" : name.substr(0, stop + 1);
}

/* The layers of an image that have R, G and B, "beauty.R" and so on: their names with the full stop. */
static std::vector<std::string> colour_layers(const ImageSpec &spec)
{
    std::vector<std::string> layers;
    for (const std::string &name : spec.channelnames) {
        const std::string layer = layer_of(name);
        if (layer.empty() || !Strutil::iequals(name.substr(layer.size()), "R")) continue;
        if (channel(spec, (layer + "G").c_str()) >= 0 && channel(spec, (layer + "B").c_str()) >= 0)
            layers.push_back(layer);
    }
    return layers;
}

/* Which channels are the colours: R, G, B by name, those of the only layer that has them, or the first ones that are
 * not alpha where there are no layers. */
static ts_code choose_channels(const char *path, const ImageSpec &spec, oi_image *image, ts_status *st)
{
    int n = spec.nchannels, r = channel(spec, "R"), g = channel(spec, "G"), b = channel(spec, "B");
    int alpha = spec.alpha_channel;
    const std::vector<std::string> layers = r < 0 || g < 0 || b < 0 ? colour_layers(spec) : std::vector<std::string>();
    if (layers.size() > 1) {
        std::string names;
        for (const std::string &layer : layers)
            names += (names.empty() ? "" : ", ") + layer.substr(0, layer.size() - 1);
        return ts_fail(st, TS_UNSUPPORTED, "%s: several layers have colours (%s): save one of them alone", path,
                       names.substr(0, 200).c_str());
    }
    if (layers.size() == 1) {
        r = channel(spec, (layers[0] + "R").c_str());
        g = channel(spec, (layers[0] + "G").c_str());
        b = channel(spec, (layers[0] + "B").c_str());
        alpha = channel(spec, (layers[0] + "A").c_str());
    }
    image->alpha = alpha < n && n > 1 ? alpha : -1;
    if (r < 0 || g < 0 || b < 0) {
        int others[3] = {0, 0, 0}, found = 0;
        for (int c = 0; c < n && found < 3; c++)
            if (c != image->alpha) others[found++] = c;
        for (int k = 1; k < found; k++)
            if (layer_of(spec.channelnames[others[k]]) != layer_of(spec.channelnames[others[0]]))
                return ts_fail(st, TS_UNSUPPORTED, "%s: no layer has the channels R, G and B: save its colours alone",
                               path);
        r = others[0];
        g = found == 3 ? others[1] : r; /* two channels that are no colour: the first is taken as grey */
        b = found == 3 ? others[2] : r;
    }
    image->colour[0] = r;
    image->colour[1] = g;
    image->colour[2] = b;
    image->grey = r == g && g == b;
    return TS_OK;
}

static double number(const ImageSpec &spec, const char *name)
{
    return std::max(0.0f, spec.get_float_attribute(name, 0));
}

static io_lens lens_of(const ImageSpec &spec)
{
    static const double millimetres[] = {25.4, 25.4, 25.4, 10, 1, 1e-3};
    const int unit = spec.get_int_attribute("Exif:FocalPlaneResolutionUnit", 2);
    const string_view make = spec.get_string_attribute("Make");
    io_lens lens = {};
    lens.focal_35mm = number(spec, "Exif:FocalLengthIn35mmFilm");
    lens.focal = number(spec, "Exif:FocalLength");
    lens.plane = number(spec, "Exif:FocalPlaneXResolution") / millimetres[unit >= 0 && unit < 6 ? unit : 2];
    lens.zoom = number(spec, "Exif:DigitalZoomRatio");
    lens.width = std::max(0, spec.get_int_attribute("Exif:PixelXDimension", 0));
    lens.height = std::max(0, spec.get_int_attribute("Exif:PixelYDimension", 0));
    lens.zoom_in_focal35 = Strutil::istarts_with(make, "Apple");
    return lens;
}

static void describe(const ImageSpec &spec, oi_image *image)
{
    TypeDesc type = spec.format;
    image->floating = type.is_floating_point();
    image->levels = type.size() == 1 ? 256 : 65536;
    image->associated = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) == 0;
    image->orientation = spec.get_int_attribute("Orientation", 1);
    if (image->orientation < 1 || image->orientation > 8) image->orientation = 1;
    string_view space = spec.get_string_attribute("oiio:ColorSpace");
    image->linear = Strutil::iequals(space, "linear") || Strutil::iequals(space, "scene_linear") ||
        Strutil::istarts_with(space, "lin_");
    image->adobe = Strutil::starts_with(spec.get_string_attribute("Exif:InteroperabilityIndex"), "R03");
    const ParamValue *p = spec.find_attribute("chromaticities");
    if (p && p->type().basetype == TypeDesc::FLOAT && p->type().basevalues() * (size_t)p->nvalues() == 8) {
        image->primaries = true;
        memcpy(image->chromaticities, p->data(), sizeof image->chromaticities);
    }
    image->lens = lens_of(spec);
    p = spec.find_attribute("ICCProfile");
    if (p && p->type().basetype == TypeDesc::UINT8 && p->type().size() > 128) {
        image->icc_size = p->type().size();
        image->icc = (unsigned char *)malloc(image->icc_size);
        if (!image->icc) throw std::bad_alloc();
        memcpy(image->icc, p->data(), image->icc_size);
    }
}

/* The colours without alpha, which the library's reader of WebP multiplies encoded values by. */
static void divide_by_alpha(oi_image *image)
{
    float *v = (float *)image->data;
    for (size_t i = 0; i < (size_t)image->width * image->height; i++, v += image->channels)
        for (int c = 0; c < image->channels; c++)
            if (c != image->alpha) v[c] = v[image->alpha] > 0 ? std::min(v[c] / v[image->alpha], 1.0f) : 0;
    image->associated = false;
}

static ts_code read_file(const char *path, int64_t max_pixels, double max_bytes, oi_image *image, ts_status *st)
{
    ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1); /* the library would multiply encoded values by alpha */
    auto in = ImageInput::open(path, &config);
    if (!in) {
        const std::string why = one_line(OIIO::geterror());
        if (why.find("could not find a format reader") != std::string::npos)
            return ts_fail(st, TS_FORMAT,
                           "%s: is no image, or one in a format that is not read: save it as PNG or JPEG", path);
        return ts_fail(st, TS_FORMAT, "%s: cannot be read: %s", path, why.c_str());
    }
    ImageSpec spec = in->spec();
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1)
        return ts_fail(st, TS_FORMAT, "%s: claims %d x %d pixels of %d channels", path, spec.width, spec.height,
                       spec.nchannels);
    if ((int64_t)spec.width * spec.height > max_pixels)
        return ts_fail(st, TS_UNSUPPORTED,
                       "%s: %d x %d pixels are more than the limit of %lld; of "
                       "photographs --max-pixels raises it",
                       path, spec.width, spec.height, (long long)max_pixels);
    if (spec.depth > 1) return ts_fail(st, TS_UNSUPPORTED, "%s: a volume, not an image", path);
    if (spec.deep) return ts_fail(st, TS_UNSUPPORTED, "%s: a deep image; flatten it first", path);
    const bool webp = !strcmp(in->format_name(), "webp");
    if (choose_channels(path, spec, image, st) != TS_OK) return st->code;
    describe(spec, image);

    /* Only the channels that are wanted: a file may hold hundreds. */
    int first = image->colour[0], last = first;
    for (int c : {image->colour[1], image->colour[2], image->alpha})
        if (c >= 0) first = std::min(first, c), last = std::max(last, c);
    if (last - first >= 16) /* colours far apart among many layers: not worth the memory between them */
        return ts_fail(st, TS_UNSUPPORTED, "%s: its colour channels are not stored side by side (%d channels in all)",
                       path, spec.nchannels);
    for (int &c : image->colour) c -= first;
    if (image->alpha >= 0) image->alpha -= first;
    image->width = spec.width;
    image->height = spec.height;
    image->channels = last - first + 1;
    image->type = OI_F32;
    const double bytes = (double)sizeof(float) * spec.width * spec.height * image->channels;
    if (bytes > max_bytes)
        return ts_fail(st, TS_NOMEM,
                       "%s: %d x %d pixels: about %.3g GB of memory are needed and %.3g GB may be taken (lgd-infer "
                       "--max-memory)",
                       path, spec.width, spec.height, bytes * 1e-9, max_bytes * 1e-9);
    image->data = calloc((size_t)spec.width * spec.height * image->channels, sizeof(float));
    if (!image->data) return ts_fail(st, TS_NOMEM, "%s: no memory for %d x %d pixels", path, spec.width, spec.height);
    if (!in->read_image(0, 0, first, last + 1, TypeDesc::FLOAT, image->data))
        return ts_fail(st, TS_FORMAT, "%s: damaged or cut short: %s", path, one_line(in->geterror()).c_str());
    /* Some readers note a problem and go on with what they have. */
    if (in->has_error())
        return ts_fail(st, TS_FORMAT, "%s: damaged or cut short: %s", path, one_line(in->geterror()).c_str());
    if (webp && image->associated && image->alpha >= 0) divide_by_alpha(image);
    return TS_OK;
}

static ts_code read(const char *path, int64_t max_pixels, double max_bytes, oi_image *image, ts_status *st)
{
    return guarded(path, st, [&] { return read_file(path, max_pixels, max_bytes, image, st); });
}

static ts_code encode(const char *name, const oi_encoding *e, const uint8_t *pixels, unsigned char **bytes,
                      size_t *size, ts_status *st)
{
    Filesystem::IOVecOutput memory; /* outlives out, which writes to it to its end */
    auto out = ImageOutput::create("jpeg");
    if (!out) return ts_fail(st, TS_UNSUPPORTED, "%s: this OpenImageIO cannot write JPEG", name);
    ImageSpec spec(e->width, e->height, e->channels, TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("Compression", "jpeg:" + std::to_string(e->quality));
    if (!out->supports("ioproxy") || !out->set_ioproxy(&memory))
        return ts_fail(st, TS_UNSUPPORTED, "%s: this OpenImageIO cannot write JPEG to memory", name);
    if (!out->open("image.jpg", spec) || !out->write_image(TypeDesc::UINT8, pixels) || !out->close())
        return ts_fail(st, TS_IO, "%s: %s", name, one_line(out->geterror()).c_str());
    std::vector<unsigned char> &buffer = memory.buffer();
    *bytes = (unsigned char *)malloc(buffer.size() + 1);
    if (!*bytes) throw std::bad_alloc();
    memcpy(*bytes, buffer.data(), buffer.size());
    *size = buffer.size();
    return TS_OK;
}

static ts_code encode_jpeg(const char *name, const oi_encoding *e, const uint8_t *pixels, unsigned char **bytes,
                           size_t *size, ts_status *st)
{
    return guarded(name, st, [&] { return encode(name, e, pixels, bytes, size, st); });
}

static bool knows_extension(const char *extension)
{
    bool known = false;
    guarded("extension", nullptr, [&] {
        /* "tiff:tif,tiff,tx;jpeg:jpg,jpe,..." */
        for (string_view format : Strutil::splitsv(OIIO::get_string_attribute("extension_list"), ";")) {
            size_t colon = format.find(':');
            if (colon == string_view::npos) continue;
            for (string_view e : Strutil::splitsv(format.substr(colon + 1), ","))
                if (Strutil::iequals(e, extension)) known = true;
        }
        return TS_OK;
    });
    return known;
}

struct pool_threads {
    std::vector<pid_t> ids;
    std::atomic<size_t> there{0};
};

/* Ends the threads that OpenImageIO begins with and waits until they are gone, a second at most: as they come and go
 * they hold a lock, which a process that is forked meanwhile would find taken for ever. */
static void end_threads(void)
{
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    const auto late = [end] { return std::chrono::steady_clock::now() > end; };
    thread_pool *pool = default_thread_pool();
    const auto threads = std::make_shared<pool_threads>();
    std::vector<std::future<void>> seen;
    threads->ids.resize((size_t)pool->size());
    for (size_t i = 0; i < threads->ids.size(); i++)
        seen.push_back(pool->push([threads, late](int) {
            threads->ids[threads->there++] = gettid();
            while (threads->there < threads->ids.size() && !late()) std::this_thread::yield(); /* each comes once */
        }));
    for (auto &s : seen) s.wait_until(end);
    OIIO::attribute("threads", 1);
    for (pid_t id : threads->ids)
        while (id && tgkill(getpid(), id, 0) == 0 && !late()) std::this_thread::yield();
}

/* No threads beside the caller's (of OpenEXR -1 says so, 0 is as many as there are CPUs): a forked child would wait for
 * its parent's for ever, and signals for the program would go to them. */
static void start(void)
{
    guarded("start", nullptr, [] {
        OIIO::attribute("exr_threads", -1);
        OIIO::attribute("limits:imagesize_MB", 0); /* ours counts pixels and says how to raise it */
        end_threads();
        return TS_OK;
    });
}

extern "C" {
__attribute__((visibility("default"))) extern const oi_library lgd_image_library;
const oi_library lgd_image_library = {OI_BUILD, start, read, encode_jpeg, knows_extension};
}
