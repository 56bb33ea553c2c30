#include "cli/data/pictures.h"
#include "data/capture.h"
#include "render/render.h"
#include "tensor/maps.h"
#include <math.h>
#include <string.h>

ts_code cl_write_capture(const char *folder, const io_material *m, ts_status *st)
{
    enum { PICTURES = 9 };
    const size_t values = (size_t)m->size * (size_t)m->size * 3;
    io_capture c;
    ts_code code = io_capture_create(&c, PICTURES, m->size, st);
    c.side = 20;
    for (int i = 0; i < PICTURES && !code; i++) {
        rd_view view = rd_flash();
        const double phi = 6.28318530717958647692 * (i - 1) / (PICTURES - 1);
        if (i > 0) {
            view.camera[0] = (float)(0.45 * cos(phi)), view.camera[1] = (float)(0.45 * sin(phi));
            view.light[0] = view.camera[0] + 0.06f, view.light[1] = view.camera[1];
        }
        memcpy(c.camera[i], view.camera, sizeof view.camera);
        memcpy(c.light[i], view.light, sizeof view.light);
        rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, &view, true, c.image + (size_t)i * values);
    }
    for (int k = 0; k < 3; k++) c.power[k] = RD_FLASH_POWER;
    if (!code) code = io_write_capture(folder, &c, st);
    io_capture_free(&c);
    return code;
}
