/* The only object that knows PREFIX: another one compiles this file alone. */
#include "data/folders.h"

const char io_data_folder[] = LGD_PREFIX "/share/lgd";
const char io_library_folder[] = LGD_LIBDIR;
