/* Numbers with a decimal point, whatever the user's language: the library may be called by a program that has set it.
 */
#ifndef TS_PLAIN_LOCALE_H
#define TS_PLAIN_LOCALE_H
#include <locale.h>

/* The calling thread's locale becomes "C". Returns what it was, for ts_locale_back. */
locale_t ts_locale_plain(void);
void ts_locale_back(locale_t before);
#endif
