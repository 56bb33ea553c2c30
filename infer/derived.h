/* The maps that are computed from the estimated ones: height, occlusion, base colour and metalness. */
#ifndef LGD_DERIVED_H
#define LGD_DERIVED_H
#include "data/material.h"
#include "infer/order.h"

enum { LGD_DERIVED = LGD_OUT_HEIGHT | LGD_OUT_AO | LGD_OUT_ORM | LGD_OUT_BASECOLOR | LGD_OUT_METALLIC };

/* Those of which (bits of LGD_DERIVED) into the folder, by lgd_files' names; what each takes is computed once. facts
 * gets what it takes to read them. */
ts_code lgd_write_derived(const char *folder, const io_material *m, unsigned which, bool repeats,
                          lgd_output_result *facts, ts_status *st);
#endif
