/* meta.txt: what the files of a folder mean, and what was assumed of the photograph. */
#ifndef LGD_META_H
#define LGD_META_H
#include "infer/lgd.h"
#include "infer/order.h"

/* The conventions that io_read_map_folder reads, then a line for each file that is ordered, then the scene: the field
 * of view and where it is known from, camera and light in patch widths, and the light's power (infer/lgd.h); the
 * order's record; mark, a line more. before, kept: the meta.txt of an earlier call and the files of it (bits, in the
 * order of lgd_files) that stay as they are, whose lines are taken over; NULL, 0: none. */
ts_code lgd_write_meta(const char *path, const lgd_photo *photo, const lgd_order *order, const lgd_output_result *facts,
                       const char *mark, const char *before, unsigned kept, ts_status *st);

/* What stands in its place while files (bits) of a folder are replaced: it names them, and is nobody's estimate. */
ts_code lgd_write_meta_begun(const char *path, unsigned files, ts_status *st);

/* The files that a meta.txt of lgd_output_write has a line of, bits in the order of lgd_files; 0: another program's. */
unsigned lgd_meta_files(const char *text);

/* folder/meta.txt, which the caller frees; NULL when there is none that can be read. */
char *lgd_meta_read(const char *folder);
#endif
