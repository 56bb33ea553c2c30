/* The matrix unit's tile registers, all eight of 16 rows of 64 bytes. Only files in this folder include it, for
 * instruction sets with __AMX_BF16__. */
#ifndef TS_AMX_H
#define TS_AMX_H
#include <immintrin.h>
#include <stdint.h>

static inline void tiles_begin(void)
{
    /* In memory for good: gcc knows of the instruction that it reads eight bytes, and would leave the rest of a
     * variable unwritten. */
    static const struct {
        uint8_t palette, start_row, unused[14];
        uint16_t row_bytes[16];
        uint8_t rows[16];
    } shape = {.palette = 1, .row_bytes = {64, 64, 64, 64, 64, 64, 64, 64}, .rows = {16, 16, 16, 16, 16, 16, 16, 16}};
    _tile_loadconfig(&shape);
}

static inline void tiles_end(void) { _tile_release(); }
#endif
