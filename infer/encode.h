/* From what lgd_estimate gives back to what the renderer and the writers read. */
#ifndef LGD_ENCODE_H
#define LGD_ENCODE_H

/* maps as in infer/lgd.h, [side, side, 9], to the encoding of tensor/maps.h, the same shape; encoded may be maps. */
void lgd_encode(const float *maps, int side, float *encoded, int threads);
#endif
