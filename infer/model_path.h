/* Which weights file a program reads when none is named. */
#ifndef LGD_MODEL_PATH_H
#define LGD_MODEL_PATH_H
#include "tensor/status.h"

enum { LGD_PATH_MAX = 4096 };

/* The model for one photograph of which nothing needs to be known. */
#define LGD_DEFAULT_MODEL "phone"

/* Option (--model), else $LGD_MODEL: a file, or, without a slash or a dot and where there is no such file, the NAME of
 * a model that ships with the program; else NAME is name. The first of ../share/lgd/NAME.safetensors,
 * ../../models/NAME.safetensors and ../models/NAME.safetensors (of liblgd.so after make) beside the folder of the
 * program or of liblgd.so, and the installation's data folder; TS_IO when nothing is found. A file is taken as it is.
 */
ts_code lgd_model_path(const char *option, const char *name, char path[LGD_PATH_MAX], ts_status *st);
#endif
