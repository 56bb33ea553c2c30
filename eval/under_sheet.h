/* Photographs of known materials in the window of a printed sheet, as lgd-data --format sheet-captures writes them. */
#ifndef EV_UNDER_SHEET_H
#define EV_UNDER_SHEET_H
#include "data/capture.h"
#include "data/material.h"

/* Whether the folder has maps/ and photo_1.jpg. */
bool ev_is_under_sheet(const char *folder);

/* truth: the maps; c: the windows of photo_1.jpg, photo_2.jpg ..., `most` at most, in the order, brightness and places
 * in which lgd-infer --sheet finds them (infer/sheet.h); with exact those of exact/, in the order of the files. A
 * photograph that cannot be used is a failure. The caller frees both. */
ts_code ev_load_under_sheet(const char *folder, const io_map_convention *own, bool exact, int most, int size,
                            io_material *truth, io_capture *c, ts_status *st);
#endif
