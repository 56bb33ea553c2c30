/* Which weights file a program reads when none is named. */
#ifndef LGD_MODEL_PATH_H
#define LGD_MODEL_PATH_H
#include "tensor/status.h"

enum { LGD_PATH_MAX = 4096 };

/* The first of: option (--model), $LGD_MODEL, ../share/lgd/NAME.safetensors and ../../models/NAME.safetensors beside the
 * program's own folder, and the installation's data folder. The first two are taken as they are; TS_IO when nothing is found. */
ts_code lgd_model_path(const char *option, const char *name, char path[LGD_PATH_MAX], ts_status *st);
#endif
