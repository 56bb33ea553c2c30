/* Where `make install` puts what the programs read. */
#ifndef IO_FOLDERS_H
#define IO_FOLDERS_H

extern const char io_data_folder[];    /* the shipped weights */
extern const char io_library_folder[]; /* lgd/liblgd_image.so */
#endif
