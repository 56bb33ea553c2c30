#include "data/capture.h"
#include "data/capture_ini.h"
#include "data/map_folder.h"
#include "eval/set_ini.h"
#include "tests/fuzz/fuzz.h"
#include "train/config.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A configuration that is taken can be printed, and what is printed is taken again as the same. */
void fuzz_config(const uint8_t *data, size_t size)
{
    ts_status st = {0};
    tr_config c = tr_config_default(), again = tr_config_default();
    if (tr_config_read(&c, fuzz_file(data, size), &st)) {
        if (!*st.message || strchr(st.message, '\n')) abort();
        return;
    }
    tr_config_check(&c, &st);
    char *text = NULL;
    size_t length = 0;
    FILE *f = open_memstream(&text, &length);
    if (!f) abort();
    tr_config_print(&c, true, f);
    fclose(f);
    st = (ts_status){0};
    if (tr_config_read(&again, fuzz_file((const uint8_t *)text, length), &st) ||
        tr_config_same(&c, &again, "print", &st)) {
        fprintf(stderr, "%s\n%s", st.message, text);
        abort();
    }
    free(text);
}

void fuzz_folder(const uint8_t *data, size_t size)
{
    static const char *const name[] = {"set.ini",        "meta.txt",      "image_size.txt", "light_power.txt",
                                       "camera_pos.txt", "light_pos.txt", "capture.ini"};
    static const char *const sound[] = {"10\n", "1,1,1\n", "0,0,10\n", "0,0,10\n"};
    if (size < 1) return;
    const int kind = data[0] % 7;
    ts_status st = {0};
    for (int i = 2; i < 6; i++)
        if (kind >= 2 && kind < 6 && i != kind)
            fuzz_named(name[i], (const uint8_t *)sound[i - 2], strlen(sound[i - 2]));
    const char *path = fuzz_named(name[kind], data + 1, size - 1);
    ts_code code = TS_OK;
    if (kind == 0) {
        io_map_convention c;
        code = ev_set_ini(fuzz_where, NULL, &c, &st);
    } else if (kind == 1) {
        io_map_set set;
        code = io_describe_map_folder(fuzz_where, NULL, &set, &st);
    } else {
        io_capture c;
        code = kind == 6 ? io_read_capture_ini(path, 8, 1, 1 << 16, &c, &st)
                         : io_read_capture(fuzz_where, 8, 1 << 16, &c, &st);
        if (!code) io_capture_free(&c);
    }
    if (code && (!*st.message || strchr(st.message, '\n'))) abort();
    remove(path);
}
