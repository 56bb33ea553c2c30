/* Words in pictures. */
#ifndef IO_LABEL_H
#define IO_LABEL_H
#include "data/image/image.h"

enum { IO_LABEL_HEIGHT = 12 }; /* pixels of a line, with its margin */

/* Writes text, small letters a to z, digits and '-' (others are blanks), white on what is there, from the pixel (x, y)
 * on; what would be beyond the picture is left out. image: three channels. */
void io_label(io_image *image, int x, int y, const char *text);
#endif
