/* lgd-convert: weights between safetensors and PyTorch's files, and what is in them. */
#include "cli/arguments.h"
#include "cli/cli.h"
#include "nn/weights/weights.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { PREFIX = 256 };

static const cl_argument arguments[] = {
    {'l', "list", NULL, "print name, type and shape of every tensor of IN, and write nothing"},
    {'d', "dtype", "f32|f16|bf16", "f32, f16 or bf16 for all floating-point tensors (default: each keeps its own)"},
    {PREFIX, "prefix", "TEXT", "only tensors whose names begin with TEXT, without it (as in: model. or module.)"},
    {'h', "help", NULL, "print this help"},
    {'V', "version", NULL, "print the version"},
    {0, NULL, NULL, NULL}};

typedef struct command {
    const char *in, *out, *prefix;
    nn_dtype real;
    nn_form form;
    bool list, help, version;
} command;

static void print_help(void)
{
    puts("Usage: lgd-convert [options] IN OUT\n"
         "  or:  lgd-convert --list IN\n"
         "Writes the tensors of IN to OUT. IN is a safetensors file or what torch.save wrote of a state dict (since "
         "PyTorch 1.6 a ZIP archive, or the\n"
         "older form); its first bytes say which. OUT is safetensors when its name ends with .safetensors, PyTorch's "
         "ZIP archive when with .pth or .pt.\n"
         "Python is not needed and nothing in a pickle is executed: one that names anything but tensors, storages and "
         "OrderedDict is refused.\n"
         "In nested dictionaries a tensor's name is the keys from the outermost on, joined by dots; a \"state_dict\" "
         "or \"model_state_dict\" outermost\n"
         "is left out. Integer tensors are kept as they are; tensors that share memory become separate ones.\n");
    cl_argument_help(arguments, stdout);
    puts("\nExit status: 0 done, 1 IN cannot be read or OUT cannot be written, 2 wrong usage, 130 interrupted.");
}

static bool ends_with(const char *s, const char *end)
{
    size_t n = strlen(s), m = strlen(end);
    return n >= m && !strcmp(s + n - m, end);
}

static ts_code parse(int argc, char **argv, command *c, ts_status *st)
{
    *c = (command){.real = NN_DTYPES, .prefix = ""};
    const char *value = NULL;
    int key, operands = argc;
    while (!c->help && !c->version &&
           (key = cl_argument_next(argc, argv, arguments, &value, &operands, st)) != CL_ARGUMENT_END) {
        switch (key) {
        case 'l': c->list = true; break;
        case 'h': c->help = true; break;
        case 'V': c->version = true; break;
        case PREFIX: c->prefix = value; break;
        case 'd':
            c->real = !strcmp(value, "f32") ? NN_F32
                : !strcmp(value, "f16")     ? NN_F16
                : !strcmp(value, "bf16")    ? NN_BF16
                                            : NN_DTYPES;
            if (c->real == NN_DTYPES) return ts_fail(st, TS_INVALID, "--dtype: '%s' is not f32, f16 or bf16", value);
            break;
        default: return st->code;
        }
    }
    if (c->help || c->version) return TS_OK;
    if (argc - operands != (c->list ? 1 : 2))
        return ts_fail(st, TS_INVALID, "%s", c->list ? "--list takes one file" : "two files are needed: IN OUT");
    c->in = argv[operands];
    if (cl_check_name("IN", c->in, st) != TS_OK) return st->code;
    if (c->list)
        return c->real == NN_DTYPES ? TS_OK : ts_fail(st, TS_INVALID, "--list writes nothing: --dtype has no use");
    c->out = argv[operands + 1];
    if (cl_check_name("OUT", c->out, st) != TS_OK) return st->code;
    if (ends_with(c->out, ".safetensors")) c->form = NN_FORM_SAFETENSORS;
    else if (ends_with(c->out, ".pth") || ends_with(c->out, ".pt")) c->form = NN_FORM_TORCH_ZIP;
    else
        return ts_fail(st, TS_INVALID,
                       "%s: the name must end with .safetensors, .pth or .pt, which says what is written", c->out);
    return TS_OK;
}

/* Names are UTF-8; what would control a terminal is not printed. */
static void print_text(const char *s)
{
    for (; *s; s++) putchar((unsigned char)*s < ' ' || *s == 127 ? '?' : *s);
}

static void list(const nn_file *f, const nn_tensor *entry, int entries)
{
    static const char *const form[] = {"safetensors", "PyTorch, ZIP archive", "PyTorch before 1.6"};
    int64_t numbers = 0;
    const char *key;
    for (int i = 0; (key = nn_file_meta_key(f, i)); i++) {
        printf("# ");
        print_text(key);
        printf(" = ");
        print_text(nn_file_meta(f, key));
        putchar('\n');
    }
    for (int i = 0; i < entries; i++) {
        char shape[200];
        nn_shape_text(entry[i].rank, entry[i].dim, shape, sizeof shape);
        print_text(entry[i].name);
        printf("\t%s\t%s\n", nn_dtype_name(entry[i].dtype), shape);
        numbers += entry[i].count;
    }
    printf("# %s: %d tensors, %" PRId64 " numbers\n", form[nn_file_form(f)], entries, numbers);
}

static ts_code run(const command *c, ts_status *st)
{
    nn_file *f = nn_file_open(c->in, st);
    if (!f) return st->code;
    nn_tensor *entry = malloc(((size_t)nn_file_count(f) + 1) * sizeof *entry);
    nn_meta *meta = NULL;
    int entries = 0, metas = 0;
    const char *key;
    while (nn_file_meta_key(f, metas)) metas++;
    meta = malloc(((size_t)metas + 1) * sizeof *meta);
    ts_code code = entry && meta ? TS_OK : ts_fail(st, TS_NOMEM, "%s: no memory for the list of tensors", c->in);
    for (int i = 0; !code && (key = nn_file_meta_key(f, i)); i++) meta[i] = (nn_meta){key, nn_file_meta(f, key)};
    for (int i = 0; !code && i < nn_file_count(f); i++) {
        const nn_tensor *e = nn_file_tensor(f, i);
        if (strncmp(e->name, c->prefix, strlen(c->prefix)) != 0) continue;
        entry[entries] = *e;
        entry[entries++].name += strlen(c->prefix);
    }
    if (!code && *c->prefix && entries == 0)
        code = ts_fail(st, TS_FORMAT, "%s: no tensor's name begins with '%s'", c->in, c->prefix);
    if (!code && c->list) list(f, entry, entries);
    else if (!code) code = nn_file_write(c->out, c->form, entry, entries, c->real, meta, metas, cl_interrupted, st);
    free(entry);
    free(meta);
    nn_file_close(&f);
    return code;
}

int main(int argc, char **argv)
{
    cl_open_streams();
    command c;
    ts_status st = {0};
    int code = cl_init("lgd-convert");
    if (code) return code;
    if (parse(argc, argv, &c, &st) != TS_OK) return cl_usage("%s", st.message);
    cl_catch_interrupt();
    if (c.help) print_help();
    else if (c.version) cl_print_version();
    else if (run(&c, &st) != TS_OK)
        code = st.code == TS_INTERRUPTED ? cl_stopped("%s", st.message) : cl_failed("%s", st.message);
    return cl_finish(code);
}
