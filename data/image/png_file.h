/* What OpenImageIO does not report about a PNG file. */
#ifndef IO_PNG_FILE_H
#define IO_PNG_FILE_H
#include "data/image/colour.h"
#include "tensor/status.h"

/* Walks the chunks to the end. A file that is not a PNG passes. One that is cut short or whose checksums are wrong is
 * refused here, because libpng would print its own line about it to stderr. */
ts_code io_check_png(const char *path, ts_status *st);

/* From the colour chunks (cICP, sRGB, gAMA, cHRM; a profile goes before all but the first); false when it is no PNG or
 * they say nothing. named: the name of a profile that the file has, also where its bytes are none, or empty. */
enum { IO_PNG_NAME = 80 };
bool io_space_png(const char *path, io_space *space, char named[IO_PNG_NAME]);
#endif
