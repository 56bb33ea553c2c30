/* set.ini: the conventions of a map folder, or of all map folders in the folder that it is in. Lines "key = value"; '#'
 * or ';' begins a comment:
 *
 *   workflow = metallic | specular
 *   normal = opengl | directx       whether the normal's y points up or down
 *   colour = srgb | linear          encoding of colour maps
 *
 * Any other line is an error that names it. */
#ifndef EV_SET_INI_H
#define EV_SET_INI_H
#include "data/material.h"

/* *out: given (from options, may be NULL), and for what it leaves open folder/set.ini, if it exists. */
ts_code ev_set_ini(const char *folder, const io_map_convention *given, io_map_convention *out, ts_status *st);

/* One such pair into *c; false when there is no such key or value. */
bool ev_set_ini_key(const char *key, const char *value, io_map_convention *c);
#endif
