/* set.ini: what holds for a map folder, or, in the folder of them all, for every one. Lines "key = value", '#' or ';'
 * begins a comment: workflow = metallic | specular normal = opengl | directx       which way the normal's y points
 *   colour = srgb | linear          how colour maps are stored
 * Any other line is an error that names it. */
#ifndef EV_SET_INI_H
#define EV_SET_INI_H
#include "data/material.h"

/* *out: what is told (may be NULL), and what folder/set.ini, if there is one, says about the rest. */
ts_code ev_set_ini(const char *folder, const io_map_convention *told, io_map_convention *out, ts_status *st);

/* One such pair into *c; false when there is no such key or value. */
bool ev_set_ini_key(const char *key, const char *value, io_map_convention *c);
#endif
