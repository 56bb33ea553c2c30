/* One picture of all photographs' maps. */
#ifndef EV_CONTACT_H
#define EV_CONTACT_H
#include "eval/sheet.h"

/* Rows of panels in the order of ev_contact_add. */
typedef struct ev_contact {
    io_image *sheet;
    int count, capacity;
} ev_contact;

/* A photograph without known maps, its estimate and, where there are any, a peer's maps; other cases are left out. */
ts_code ev_contact_add(ev_contact *contact, const ev_case *c, const float *maps, ts_status *st);
/* Of more than EV_CONTACT_COLUMN photographs two columns, the first at least as high. Nothing is written of none. An
 * 8-bit sRGB PNG. */
enum { EV_CONTACT_COLUMN = 8 };
ts_code ev_contact_write(const ev_contact *contact, const char *path, ts_status *st);
void ev_contact_free(ev_contact *contact);
#endif
