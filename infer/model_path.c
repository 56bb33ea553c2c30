#include "infer/model_path.h"
#include "data/folders.h"
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LGD_NAME_MAX = 64 }; /* of a shipped model's name */

static ts_code take(const char *from, char path[LGD_PATH_MAX], ts_status *st)
{
    if (snprintf(path, LGD_PATH_MAX, "%s", from) >= LGD_PATH_MAX)
        return ts_fail(st, TS_INVALID, "the name of the weights file is too long");
    return TS_OK;
}

/* The file of a model that ships with the program or the library. */
static bool shipped(const char *name, char path[LGD_PATH_MAX])
{
    char folder[LGD_PATH_MAX - 64 - LGD_NAME_MAX]; /* the rest is appended */
    if (io_own_folder(folder, sizeof folder)) {
        static const char *const folders[] = {"../share/lgd", "../../models", "../models"};
        for (int i = 0; i < 3; i++) {
            snprintf(path, LGD_PATH_MAX, "%s/%s/%s.safetensors", folder, folders[i], name);
            if (access(path, F_OK) == 0) return true;
        }
    }
    snprintf(path, LGD_PATH_MAX, "%s/%s.safetensors", io_data_folder, name);
    return access(path, F_OK) == 0;
}

static bool is_name(const char *option)
{
    struct stat info;
    const bool file = stat(option, &info) == 0 && !S_ISDIR(info.st_mode); /* a folder holds no weights */
    return strlen(option) < LGD_NAME_MAX && !strpbrk(option, "/.") && !file;
}

ts_code lgd_model_path(const char *option, const char *name, char path[LGD_PATH_MAX], ts_status *st)
{
    const char *variable = getenv("LGD_MODEL");
    if (!option && variable && *variable) option = variable;
    if (option && !*option) return ts_fail(st, TS_INVALID, "the name of the weights is empty");
    if (option && !is_name(option)) return take(option, path, st);
    if (option) name = option;
    if (shipped(name, path)) return TS_OK;
    return ts_fail(
        st, TS_IO,
        "no %s.safetensors found in ../share/lgd or ../../models beside the program's folder, ../models beside "
        "the library's, or in %s: name a file with lgd-infer --model, or by LGD_MODEL",
        name, io_data_folder);
}
