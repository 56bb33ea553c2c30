/* The files of one photograph, all or none. */
#ifndef LGD_OUTPUT_H
#define LGD_OUTPUT_H
#include "data/material.h"
#include "infer/lgd.h"
#include "infer/order.h"

/* Fails with one clear line when nothing can be made inside the folder, before any work is done for it. */
ts_code lgd_output_check(const char *folder, ts_status *st);

/* Writes what is ordered and meta.txt (what they mean) to parent/stem; nothing else is computed. They are
 * written to a hidden folder first and renamed when all are complete: a failure leaves what was there before, and
 * nothing else; one amid the renames a meta.txt that begins with "incomplete". The folder's meta.txt names the estimate
 * and its files: those that are not written now stay, and keep their lines, when they are of this estimate; of another
 * (of another photograph, or made otherwise) they are removed. A file that no meta.txt names is somebody else's and
 * stays unless one of its name is ordered. Several processes may write the same folder: one's files stay. photo: of the
 * material's size, with light and camera as they were taken; it is compared with the estimate as it is, seamless or
 * not. Its image may be NULL where neither render.png nor view.html is ordered. result: may be NULL. */
ts_code lgd_output_write(const char *parent, const char *stem, const io_material *estimate, const lgd_photo *photo,
                         const lgd_order *order, lgd_output_result *result, ts_status *st);

/* Whether folder holds all files of which, and a meta.txt, which is written last, with the lines of record in it: then
 * *meta is its text, which the caller frees. */
bool lgd_output_is(const char *folder, unsigned which, const char *record, char **meta);
#endif
