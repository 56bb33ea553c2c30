/* The sheet's tags in a photograph. */
#ifndef IO_TAGS_H
#define IO_TAGS_H
#include "data/image/photo_rows.h"
#include "data/rectify/tag_sheet.h"

typedef struct io_tags {
    int count;
    int id[IO_SHEET_TAGS];
    double corner[IO_SHEET_TAGS][4][2]; /* pixels (io_pinhole's convention), in the order of io_tag_corners */
} io_tags;

enum { IO_TAGS_LEAST = 6 }; /* that a pose is found from */

/* Finds them with libapriltag, on threads (0: the process's number). Failures are one line that says what to do: fewer
 * than IO_TAGS_LEAST tags, a tag that is there twice (two sheets); TS_UNSUPPORTED without the library. */
ts_code io_tags_find(const io_photo_rows *photo, int threads, io_tags *tags, ts_status *st);
#endif
