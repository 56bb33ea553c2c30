#include "nn/hidden.h"
#include "tensor/kernels/vmath_arrays.h"
#include "tensor/maps.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <math.h>
#include <string.h>

enum {
    CELLS = 32, /* a side, at most */
    ROWS = 4    /* of pixels at a time, at least */
};
#define STIFFNESS 1        /* of the field between neighbours of one material, beside a weight of 1 */
#define SAME 0.05          /* squared difference of logarithms that neighbours of one material have */
#define HIDES 0.3          /* the same that a highlight makes, where nothing is seen */
#define WEIGHT_LEAST 1e-4  /* keeps the field defined where nothing is seen */
#define VALUE_LEAST 0.004f /* whose logarithm is taken: one step of 8 bits */
#define BURNT_OUT 2.94f    /* sum of a pixel's three values, of which noise leaves .98 */
#define BURNT_OUT_TELLS 0.1f

/* A map of three colours, seen in the part of the light that is mirrored or in the rest. edges: the level's field ends
 * where a material does. sharpness: the power of what is seen that weighs a cell. reach: how far a logarithm may be off
 * that is not seen; what differs by more is another material. */
typedef struct hidden_map {
    int at;
    bool mirrored, edges;
    double sharpness, reach;
} hidden_map;
enum { HIDDEN = 2 };
static const hidden_map hidden[HIDDEN] = {{MAP_DIFFUSE, false, true, 6, INFINITY}, {MAP_SPECULAR, true, false, 4, 1}};

/* The whole square is full; matt holds its maps without F0. */
typedef struct pictures {
    float *matt, *full, *diffuse; /* [size, size, channels]; [size, size, 3] each */
} pictures;

/* seen: the part of the light that shows the map. usual: the same were the map's value the picture's mean, so that dark
 * things are not taken for hidden ones. Both relative to the largest. */
typedef struct cells {
    double mean; /* of the sum of the map's three values */
    double seen[CELLS * CELLS], usual[CELLS * CELLS], weight[CELLS * CELLS], log_value[3][CELLS * CELLS],
        change[3][CELLS * CELLS], level[2][CELLS * CELLS]; /* level: its field, and that of its square */
} cells;

/* The maps' cells; [HIDDEN] where it says so. */
typedef struct field {
    int size, channels, side, threads;
    pictures p;
    const float *image;
    float *maps;
    double *sums, *band; /* [HIDDEN][size], [HIDDEN][side * side * (side + 1)] */
    cells *c;            /* [HIDDEN] */
} field;

/* The first pixel of a cell in a row or column of them. */
static int first_pixel(int size, int side, int64_t cell) { return (int)((cell * size + side - 1) / side); }

static float larger(float a, float b) { return a > b ? a : b; }

static float part_of(float shown, float other) { return shown / larger(shown + other, 1e-6f); }

/* What each pixel of row y shows: logarithm [size][3], seen and usual [size]. */
static void look(const field *j, const hidden_map *m, float mean, int y, float *logarithm, float *seen, float *usual)
{
    const int size = j->size;
    for (int x = 0; x < size; x++) {
        const size_t i = (size_t)y * (size_t)size + (size_t)x;
        const float *map = j->maps + i * (size_t)j->channels + (size_t)m->at;
        float full = 0, rest = 0, bright = 0, own = 0;
        for (size_t k = 0; k < 3; k++) {
            full += j->p.full[3 * i + k], rest += j->p.diffuse[3 * i + k], bright += j->image[3 * i + k];
            const float value = (map[k] + 1) / 2;
            own += value;
            logarithm[3 * (size_t)x + k] = larger(value, VALUE_LEAST);
        }
        const float mirrored = larger(full - rest, 0), shown = m->mirrored ? mirrored : rest,
                    other = m->mirrored ? rest : mirrored, tells = bright > BURNT_OUT ? BURNT_OUT_TELLS : 1;
        seen[x] = tells * part_of(shown, other);
        usual[x] = tells * part_of(shown * mean / larger(own, 3 * VALUE_LEAST), other);
    }
    ts_vmath_arrays_k()->log(3 * size, logarithm, logarithm);
}

/* What a row of cells of one map shows: sums over each cell, then means. Row r is of map r / side. */
static void gather_rows(const void *job, int64_t begin, int64_t end)
{
    const field *j = job;
    const int size = j->size, side = j->side;
    float *logarithm = ts_scratch(0, 5 * (size_t)size * sizeof *logarithm), *seen = logarithm + 3 * size,
          *usual = seen + size;
    for (int64_t r = begin; r < end; r++) {
        const int which = (int)(r / side), row = (int)(r % side), first = first_pixel(size, side, row),
                  last = first_pixel(size, side, row + 1);
        cells *c = &j->c[which];
        for (int y = first; y < last; y++) {
            look(j, &hidden[which], (float)c->mean, y, logarithm, seen, usual);
            for (int column = 0; column < side; column++) {
                double sum[5] = {0};
                for (int x = first_pixel(size, side, column); x < first_pixel(size, side, column + 1); x++) {
                    sum[0] += (double)seen[x], sum[1] += (double)usual[x];
                    for (int k = 0; k < 3; k++) sum[2 + k] += (double)logarithm[3 * x + k];
                }
                const int at = row * side + column;
                c->seen[at] += sum[0], c->usual[at] += sum[1];
                for (int k = 0; k < 3; k++) c->log_value[k][at] += sum[2 + k];
            }
        }
        for (int column = 0; column < side; column++) {
            const int at = row * side + column,
                      across = first_pixel(size, side, column + 1) - first_pixel(size, side, column);
            const double count = (double)(last - first) * across;
            c->seen[at] /= count, c->usual[at] /= count;
            for (int k = 0; k < 3; k++) c->log_value[k][at] /= count;
        }
    }
}

static void gather(const field *j)
{
    for (int i = 0; i < HIDDEN; i++) {
        double sum = 0;
        for (int y = 0; y < j->size; y++) sum += j->sums[i * j->size + y];
        j->c[i].mean = sum / (2.0 * j->size * j->size);
    }
    ts_for(j->threads, (int64_t)HIDDEN * j->side, 1, gather_rows, j);
}

static void weigh(const hidden_map *map, int count, cells *c)
{
    double most = 0, most_usual = 0;
    for (int i = 0; i < count; i++) most = fmax(most, c->seen[i]), most_usual = fmax(most_usual, c->usual[i]);
    for (int i = 0; i < count; i++) {
        c->seen[i] /= fmax(most, 1e-6), c->usual[i] /= fmax(most_usual, 1e-6);
        c->weight[i] = pow(c->seen[i], map->sharpness);
    }
}

static double squared(double x) { return x * x; }

/* How much of one material neighbours are: as far as their colours differ by no more than a highlight may make them. */
static double alike(const cells *c, int i, int j)
{
    const double may = SAME + HIDES * (squared(1 - c->usual[i]) + squared(1 - c->usual[j]));
    double apart = 0;
    for (int k = 0; k < 3; k++) apart += squared(c->log_value[k][i] - c->log_value[k][j]) / 3;
    return squared(may / (may + apart));
}

/* The lower band of the symmetric matrix: row i has entries i - side .. i, of which those of the neighbours before it
 * and its own are not 0. */
static void make_band(const cells *c, int side, bool edges, double *band)
{
    const int width = side + 1, before[2] = {side, 1};
    memset(band, 0, (size_t)(side * side * width) * sizeof *band);
    for (int i = 0; i < side * side; i++) {
        double *own = band + (size_t)i * (size_t)width + side;
        *own += c->weight[i] + WEIGHT_LEAST;
        for (int k = 0; k < 2; k++) { /* above, left */
            if (k ? i % side == 0 : i < side) continue;
            const double stiffness = STIFFNESS * (edges ? alike(c, i, i - before[k]) : 1);
            own[-before[k]] -= stiffness, *own += stiffness, own[-before[k] * width] += stiffness;
        }
    }
}

/* Cholesky's factor in place of the band. */
static void factor(int count, int side, double *band)
{
    const int width = side + 1;
    for (int j = 0; j < count; j++) {
        double column[CELLS + 1]; /* of rows j .. j + side, whose entry it is the one before the next's by width - 1 */
        double *const diagonal = band + (size_t)j * (size_t)width + side;
        const int below = count - 1 - j < side ? count - 1 - j : side;
        *diagonal = sqrt(*diagonal);
        for (int i = 1; i <= below; i++) column[i] = diagonal[i * (width - 1)] /= *diagonal;
        for (int i = 1; i <= below; i++) {
            double *row = diagonal + i * (width - 1);
            for (int k = 1; k <= i; k++) row[k] -= column[i] * column[k];
        }
    }
}

/* Some right-hand sides at once. */
static void solve(int count, int side, const double *band, int sides, double x[][CELLS * CELLS])
{
    const int width = side + 1;
    for (int i = 0; i < count; i++) {
        const double *row = band + (size_t)i * (size_t)width;
        for (int k = i < side ? 0 : i - side; k < i; k++)
            for (int c = 0; c < sides; c++) x[c][i] -= row[k - i + side] * x[c][k];
        for (int c = 0; c < sides; c++) x[c][i] /= row[side];
    }
    for (int i = count - 1; i >= 0; i--) {
        const double *row = band + (size_t)i * (size_t)width;
        for (int c = 0; c < sides; c++) x[c][i] /= row[side];
        for (int k = i < side ? 0 : i - side; k < i; k++)
            for (int c = 0; c < sides; c++) x[c][k] -= row[k - i + side] * x[c][i];
    }
}

/* Of the logarithms, each as far as it is seen. */
static double variance(const cells *c, int count, const double *x)
{
    double weight = 0, sum = 0, squares = 0;
    for (int i = 0; i < count; i++) {
        const double w = c->weight[i] + WEIGHT_LEAST;
        weight += w, sum += w * x[i], squares += w * x[i] * x[i];
    }
    const double mean = sum / weight;
    return fmax(squares / weight - mean * mean, 0);
}

/* The part of a difference from the field that is not the material's: cells of a print or of tiles differ anyway. */
static double part_hidden(double usual, double differ)
{
    const double away = (1 - usual) * (1 - usual);
    return away > 0 ? away / (away + differ) : 0;
}

static double mean_of_three(double x[3][CELLS * CELLS], int i) { return (x[0][i] + x[1][i] + x[2][i]) / 3; }

/* Of the colours' level, their mean logarithm. */
static double level_variance(cells *c, int count)
{
    double x[CELLS * CELLS];
    for (int i = 0; i < count; i++) x[i] = mean_of_three(c->log_value, i);
    return variance(c, count, x);
}

/* Of the hue, what each colour is beside the level. */
static double hue_variance(cells *c, int count)
{
    double x[CELLS * CELLS], sum = 0;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < count; i++) x[i] = c->log_value[k][i] - mean_of_three(c->log_value, i);
        sum += variance(c, count, x) / 3;
    }
    return sum;
}

/* How far a logarithm that is from away from the field is believed to be. */
static double believed(const hidden_map *map, double from)
{
    const double far = from / map->reach;
    return from / (1 + far * far);
}

/* Some values of the cells become their fields. */
static void find_fields(const cells *c, int side, bool edges, double *band, int sides, double x[][CELLS * CELLS])
{
    const int count = side * side;
    make_band(c, side, edges, band);
    factor(count, side, band);
    for (int k = 0; k < sides; k++)
        for (int i = 0; i < count; i++) x[k][i] *= c->weight[i] + WEIGHT_LEAST;
    solve(count, side, band, sides, x);
}

/* The level's field and that of its square, which end at edges: their difference is the variance around each cell. */
static void find_levels(int side, double *band, cells *c)
{
    for (int i = 0; i < side * side; i++) {
        c->level[0][i] = mean_of_three(c->log_value, i);
        c->level[1][i] = squared(c->level[0][i]);
    }
    find_fields(c, side, true, band, 2, c->level);
}

/* A material that is light and dark may be of one hue all over: each has a part of its own. */
static void find_changes(const void *job, int64_t which)
{
    const field *j = job;
    const hidden_map *map = &hidden[which];
    const int side = j->side, count = side * side;
    cells *c = &j->c[which];
    double *band = j->band + which * count * (side + 1);
    weigh(map, count, c);
    memcpy(c->change, c->log_value, sizeof c->change);
    find_fields(c, side, false, band, 3, c->change);
    if (map->edges) find_levels(side, band, c);
    const double hue = hue_variance(c, count), differs = map->edges ? 0 : level_variance(c, count);
    for (int i = 0; i < count; i++) {
        const double own = mean_of_three(c->log_value, i), smooth = mean_of_three(c->change, i),
                     level = map->edges ? c->level[0][i] : smooth,
                     varies = map->edges ? fmax(c->level[1][i] - level * level, 0) : differs,
                     tint = part_hidden(c->usual[i], hue),
                     grey = part_hidden(c->usual[i], varies) * believed(map, level - own);
        for (int k = 0; k < 3; k++)
            c->change[k][i] = grey + tint * believed(map, c->change[k][i] - smooth - (c->log_value[k][i] - own));
    }
}

/* Pixel i lies between the centres of cells *cell and the one after it, *part of the way. */
static void between(int i, int size, int side, int *cell, float *part)
{
    const float centre = ((float)i + 0.5f) * (float)side / (float)size - 0.5f, last = (float)(side - 1),
                at = centre < 0 ? 0
        : centre < last         ? centre
                                : last;
    *cell = (int)at < side - 1 ? (int)at : side > 1 ? side - 2 : 0;
    *part = at - (float)*cell;
}

/* factor: [size][3]; row: [side][3]. */
static void apply_row(const field *j, int which, int y, float *factor, float *row)
{
    const cells *c = &j->c[which];
    const int size = j->size, side = j->side, next = side > 1;
    int above, left;
    float down, right;
    between(y, size, side, &above, &down);
    for (int i = 0; i < side; i++)
        for (int k = 0; k < 3; k++) {
            const double *a = c->change[k] + above * side + i;
            row[3 * i + k] = (1 - down) * (float)a[0] + down * (float)a[next * side];
        }
    for (int x = 0; x < size; x++) {
        between(x, size, side, &left, &right);
        const float *a = row + 3 * left;
        for (int k = 0; k < 3; k++) factor[3 * x + k] = (1 - right) * a[k] + right * a[3 * next + k];
    }
    ts_vmath_arrays_k()->exp(3 * size, factor, factor);
    float *map = j->maps + (size_t)y * (size_t)size * (size_t)j->channels + (size_t)hidden[which].at;
    for (int x = 0; x < size; x++, map += j->channels)
        for (int k = 0; k < 3; k++) {
            const float value = (map[k] + 1) * factor[3 * x + k] - 1;
            map[k] = value < 1 ? value : 1;
        }
}

static void apply_rows(const void *job, int64_t begin, int64_t end)
{
    const field *j = job;
    float *factor = ts_scratch(0, (3 * (size_t)j->size + 3 * CELLS) * sizeof *factor), *row = factor + 3 * j->size;
    for (int y = (int)begin; y < (int)end; y++)
        for (int i = 0; i < HIDDEN; i++) apply_row(j, i, y, factor, row);
}

/* The maps without F0, and of each row the sums of both maps' three values. */
static void make_matt(const void *job, int64_t begin, int64_t end)
{
    const field *j = job;
    const int64_t row = (int64_t)j->size * j->channels;
    memcpy(j->p.matt + begin * row, j->maps + begin * row, (size_t)((end - begin) * row) * sizeof(float));
    for (int64_t y = begin; y < end; y++) {
        double sum[HIDDEN] = {0};
        for (int64_t at = y * row; at < (y + 1) * row; at += j->channels) {
            for (int i = 0; i < HIDDEN; i++) {
                const float *map = j->maps + at + hidden[i].at;
                sum[i] += ((double)map[0] + 1) + ((double)map[1] + 1) + ((double)map[2] + 1);
            }
            for (int k = 0; k < 3; k++) j->p.matt[at + MAP_SPECULAR + k] = -1;
        }
        for (int i = 0; i < HIDDEN; i++) j->sums[i * j->size + y] = sum[i];
    }
}

ts_code nn_fill_hidden(rd_grid grid, const float *image, const float number[RD_SCENE_NUMBERS], int channels,
                       ts_arena *arena, float *maps, ts_status *st)
{
    const int size = grid.w, side = size < CELLS ? size : CELLS;
    const size_t pixels = (size_t)size * (size_t)size, values = pixels * (size_t)channels,
                 bands = HIDDEN * (size_t)(side * side * (side + 1));
    const ts_mark mark = ts_arena_mark(arena);
    const field j = {
        .size = size,
        .channels = channels,
        .side = side,
        .threads = grid.threads,
        .p = {ts_arena_alloc(arena, values * sizeof(float)), ts_arena_alloc(arena, pixels * 3 * sizeof(float)),
              ts_arena_alloc(arena, pixels * 3 * sizeof(float))},
        .image = image,
        .maps = maps,
        .sums = ts_arena_alloc(arena, HIDDEN * (size_t)size * sizeof(double)),
        .band = ts_arena_alloc(arena, bands * sizeof(double)),
        .c = ts_arena_zalloc(arena, HIDDEN, sizeof(cells)),
    };
    ts_code code = TS_OK;
    if (j.p.matt && j.p.full && j.p.diffuse && j.sums && j.band && j.c) {
        ts_for(grid.threads, size, ROWS, make_matt, &j);
        rd_scene_photograph(grid, maps, channels, number, false, j.p.full);
        rd_scene_photograph(grid, j.p.matt, channels, number, false, j.p.diffuse);
        gather(&j);
        ts_tasks(grid.threads, HIDDEN, find_changes, &j);
        ts_for(grid.threads, size, ROWS, apply_rows, &j);
    } else code = ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", size, size);
    ts_arena_release(arena, mark);
    return code;
}
