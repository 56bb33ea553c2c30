/* Photographs of one sample under a printed sheet: where their cameras and their flash are, and how they are exposed.
 */
#ifndef IO_SHEET_SET_H
#define IO_SHEET_SET_H
#include "data/image/image.h"
#include "data/rectify/paper_light.h"
#include "data/rectify/solve.h"

typedef struct io_sheet_photo {
    const char *path; /* the caller's */
    char profile[96]; /* io_photo_facts.profile */
    ts_status st;     /* why it cannot be used, naming it; the rest is then only so far known */
    io_sight sight;
    io_whites whites;
    double exposure[3]; /* paper is so bright: exposure * io_paper_light */
    double burnt;       /* share of the window's values that are burnt out */
    double edge;        /* how wide the tags' edges are, from 10% to 90%, in pixels of a window of 512 (median) */
} io_sheet_photo;

typedef struct io_sheet_set {
    io_sheet_photo *photo; /* owned, in the order of the names */
    int photos, good;      /* good: those with st TS_OK */
    bool sure;             /* a focal length is known from EXIF or given */
    double aside[2];       /* of the flash beside the lens, right and down, in the window's sides */
} io_sheet_set;

/* count <= IO_SOLVE_MOST. fov: degrees across the photographs' shorter side; 0: from EXIF, or, where none has it,
 * fitted from a phone's. A photograph that cannot be used has its own st, and the rest are solved without it; good may
 * be 0. The caller frees after success; set is empty after a failure (memory, a fit of all, or TS_INTERRUPTED). stop:
 * asked before each photograph whether to go no further; may be NULL. */
ts_code io_sheet_set_read(char *const *paths, int count, double fov, int64_t max_pixels, int threads,
                          bool (*stop)(void), io_sheet_set *set, ts_status *st);
void io_sheet_set_free(io_sheet_set *set);

/* The window of a good photograph, size x size, linear, as it is exposed; the caller frees it. */
ts_code io_sheet_window(const io_sheet_photo *photo, int size, int64_t max_pixels, int threads, io_image *window,
                        ts_status *st);

/* The side of a good photograph's window in its picture, the mean of the four in pixels. */
double io_sheet_window_side(const io_sheet_photo *photo);

/* A camera's angle of view when nothing is known: a phone's main lens, 26 mm on 35 mm film. */
#define IO_PHONE_FOCAL (26 / 43.266615305567875) /* in diagonals of the picture */
#endif
