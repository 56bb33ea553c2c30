#include "eval/contact.h"
#include <stdlib.h>
#include <string.h>

ts_code ev_contact_add(ev_contact *contact, const ev_case *c, const float *maps, ts_status *st)
{
    if (c->truth || c->capture) return TS_OK;
    if (contact->count == contact->capacity) {
        const int capacity = contact->capacity ? 2 * contact->capacity : 32;
        io_image *more = realloc(contact->sheet, (size_t)capacity * sizeof *more);
        if (!more) return ts_fail(st, TS_NOMEM, "out of memory for the contact sheet");
        contact->sheet = more;
        contact->capacity = capacity;
    }
    const ts_code code = ev_sheet_small(c, maps, &contact->sheet[contact->count], st);
    contact->count += code == TS_OK;
    return code;
}

static void put(io_image *all, int x, int y, const io_image *sheet)
{
    for (int row = 0; row < sheet->height; row++)
        memcpy(all->data + ((size_t)(y + row) * (size_t)all->width + (size_t)x) * 3,
               sheet->data + (size_t)row * (size_t)sheet->width * 3, (size_t)sheet->width * 3 * sizeof *all->data);
}

ts_code ev_contact_write(const ev_contact *contact, const char *path, ts_status *st)
{
    io_image all;
    int total = 0, first = 0, left = contact->count; /* left: photographs of the first column; first: its height */
    if (contact->count == 0) return TS_OK;
    for (int i = 0; i < contact->count; i++) total += contact->sheet[i].height;
    if (contact->count > EV_CONTACT_COLUMN)
        for (left = 0; 2 * first < total; left++) first += contact->sheet[left].height;
    else first = total;
    const int width = contact->sheet[0].width;
    ts_code code = io_image_create(&all, left < contact->count ? 2 * width : width, first, 3, st);
    if (code) return code;
    for (int i = 0, y = 0; i < contact->count; i++) {
        if (i == left) y = 0;
        put(&all, i < left ? 0 : width, y, &contact->sheet[i]);
        y += contact->sheet[i].height;
    }
    code = io_write_png(path, &all, 8, true, st);
    io_image_free(&all);
    return code;
}

void ev_contact_free(ev_contact *contact)
{
    for (int i = 0; i < contact->count; i++) io_image_free(&contact->sheet[i]);
    free(contact->sheet);
    *contact = (ev_contact){0};
}
