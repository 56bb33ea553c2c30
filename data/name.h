/* Small conventions that several readers share. */
#ifndef IO_NAME_H
#define IO_NAME_H
#include <stdbool.h>
#include <stddef.h>

/* The last part of a path without its extension ("a/b.c.png" gives "b.c"), cut to capacity - 1 bytes; of a folder
 * ("a/wood_3.5cm/"), which has none, all of it. */
void io_name_from_path(const char *path, char *name, size_t capacity);
void io_name_of_folder(const char *path, char *name, size_t capacity);

/* Whether the extension is one of images that photographs are stored as; of hidden files it is not. */
bool io_is_image_name(const char *name);

/* A stored normal, (n + 1) / 2 per channel, to a unit vector with z > 0; directx: its y points down. */
void io_normal_decode(const float stored[3], bool directx, float normal[3]);
#endif
