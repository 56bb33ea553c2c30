#include "data/label.h"
#include <string.h>

enum { ROWS = 7, COLUMNS = 5, ADVANCE = 6 };

/* The letters' rows from above, the highest of five bits on the left. */
static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789-";
static const unsigned char glyph[][ROWS] = {
    {0, 0, 14, 1, 15, 17, 15},    /* a */
    {16, 16, 30, 17, 17, 17, 30}, /* b */
    {0, 0, 14, 16, 16, 17, 14},   /* c */
    {1, 1, 15, 17, 17, 17, 15},   /* d */
    {0, 0, 14, 17, 31, 16, 14},   /* e */
    {6, 9, 8, 28, 8, 8, 8},       /* f */
    {0, 15, 17, 17, 15, 1, 14},   /* g */
    {16, 16, 22, 25, 17, 17, 17}, /* h */
    {4, 0, 12, 4, 4, 4, 14},      /* i */
    {2, 0, 6, 2, 2, 18, 12},      /* j */
    {16, 16, 18, 20, 24, 20, 18}, /* k */
    {12, 4, 4, 4, 4, 4, 14},      /* l */
    {0, 0, 26, 21, 21, 17, 17},   /* m */
    {0, 0, 22, 25, 17, 17, 17},   /* n */
    {0, 0, 14, 17, 17, 17, 14},   /* o */
    {0, 0, 30, 17, 30, 16, 16},   /* p */
    {0, 0, 13, 19, 15, 1, 1},     /* q */
    {0, 0, 22, 25, 16, 16, 16},   /* r */
    {0, 0, 14, 16, 14, 1, 30},    /* s */
    {8, 8, 28, 8, 8, 9, 6},       /* t */
    {0, 0, 17, 17, 17, 19, 13},   /* u */
    {0, 0, 17, 17, 17, 10, 4},    /* v */
    {0, 0, 17, 17, 21, 21, 10},   /* w */
    {0, 0, 17, 10, 4, 10, 17},    /* x */
    {0, 0, 17, 17, 15, 1, 14},    /* y */
    {0, 0, 31, 2, 4, 8, 31},      /* z */
    {14, 17, 19, 21, 25, 17, 14}, /* 0 */
    {4, 12, 4, 4, 4, 4, 14},      /* 1 */
    {14, 17, 1, 2, 4, 8, 31},     /* 2 */
    {31, 2, 4, 2, 1, 17, 14},     /* 3 */
    {2, 6, 10, 18, 31, 2, 2},     /* 4 */
    {31, 16, 30, 1, 1, 17, 14},   /* 5 */
    {6, 8, 16, 30, 17, 17, 14},   /* 6 */
    {31, 1, 2, 4, 8, 8, 8},       /* 7 */
    {14, 17, 17, 14, 17, 17, 14}, /* 8 */
    {14, 17, 17, 15, 1, 2, 12},   /* 9 */
    {0, 0, 0, 31, 0, 0, 0},       /* - */
};
_Static_assert(sizeof glyph / sizeof *glyph == sizeof letters - 1, "a glyph for each letter");

void io_label(io_image *image, int x, int y, const char *text)
{
    for (; *text; text++, x += ADVANCE) {
        const char *at = strchr(letters, *text);
        for (int i = 0; i < ROWS && at; i++)
            for (int j = 0; j < COLUMNS; j++) {
                const int row = y + i, column = x + j;
                if (!(glyph[at - letters][i] >> (COLUMNS - 1 - j) & 1) || row < 0 || column < 0 ||
                    row >= image->height || column >= image->width)
                    continue;
                float *to = image->data + ((size_t)row * (size_t)image->width + (size_t)column) * 3;
                to[0] = to[1] = to[2] = 1;
            }
    }
}
