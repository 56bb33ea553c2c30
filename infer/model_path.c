#include "infer/model_path.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static ts_code take(const char *from, char path[LGD_PATH_MAX], ts_status *st)
{
    if (snprintf(path, LGD_PATH_MAX, "%s", from) >= LGD_PATH_MAX) return ts_fail(st, TS_INVALID, "the name of the weights file is too long");
    return TS_OK;
}

ts_code lgd_model_path(const char *option, const char *name, char path[LGD_PATH_MAX], ts_status *st)
{
    if (option) return take(option, path, st);
    const char *variable = getenv("LGD_MODEL");
    if (variable && *variable) return take(variable, path, st);

    char folder[LGD_PATH_MAX - 64]; /* room for what is appended */
    const ssize_t length = readlink("/proc/self/exe", folder, sizeof folder - 1);
    if (length > 0) {
        folder[length] = 0;
        char *slash = strrchr(folder, '/');
        if (slash) *slash = 0;
        static const char *const beside[] = {"../share/lgd", "../../models"};
        for (int i = 0; i < 2; i++) {
            snprintf(path, LGD_PATH_MAX, "%s/%s/%s.safetensors", folder, beside[i], name);
            if (access(path, F_OK) == 0) return TS_OK;
        }
    }
    snprintf(path, LGD_PATH_MAX, "%s/%s.safetensors", LGD_DATADIR, name);
    if (access(path, F_OK) == 0) return TS_OK;
    return ts_fail(st, TS_IO, "no %s.safetensors found in ../share/lgd or ../../models beside the program or in %s: name a file with --model or LGD_MODEL", name, LGD_DATADIR);
}
