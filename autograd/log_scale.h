/* The range in which the logarithm of a Laplace density's scale is held (autograd/op_laplace.c, and whoever reads what
 * it trained): narrower or wider than anything that is learned, it keeps a first step's exponentials finite. */
#ifndef AG_LOG_SCALE_H
#define AG_LOG_SCALE_H
#define AG_LOG_SCALE_LEAST (-6.0f)
#define AG_LOG_SCALE_MOST 4.0f

/* s held there; NaN to the least. Comparisons, which become instructions, where fminf and fmaxf are calls. */
static inline float ag_log_scale_held(float s)
{
    return s > AG_LOG_SCALE_LEAST ? s < AG_LOG_SCALE_MOST ? s : AG_LOG_SCALE_MOST : AG_LOG_SCALE_LEAST;
}
#endif
