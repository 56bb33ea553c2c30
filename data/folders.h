/* Where `make install` puts what the programs read. */
#ifndef IO_FOLDERS_H
#define IO_FOLDERS_H
#include <stdbool.h>
#include <stddef.h>

extern const char io_data_folder[];    /* the shipped weights */
extern const char io_library_folder[]; /* lgd/liblgd_image.so */

/* The folder that the running code is in, of the shared library or of the program, free of links, without a slash at
 * its end. False: it cannot be found, or size bytes are too few. */
bool io_own_folder(char *path, size_t size);
#endif
