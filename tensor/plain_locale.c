#include "tensor/plain_locale.h"
#include <pthread.h>

static pthread_once_t once = PTHREAD_ONCE_INIT;
static locale_t plain;

static void make(void) { plain = newlocale(LC_ALL_MASK, "C", (locale_t)0); }

locale_t ts_locale_plain(void)
{
    pthread_once(&once, make);
    return uselocale(plain); /* where there was no memory for it, nothing changes */
}

void ts_locale_back(locale_t before) { uselocale(before); }
