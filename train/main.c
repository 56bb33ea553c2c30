/* lgd-train: trains g and h as a configuration says. */
#include "cli/arguments.h"
#include "cli/cli.h"
#include "tensor/threads.h"
#include "train/trainer.h"
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char usage[] =
    "Usage: lgd-train CONFIG.ini [options]\n"
    "Trains a model on procedural materials with the configuration CONFIG.ini. The run's folder (output.folder,\n"
    "default runs/CONFIG) gets best.safetensors, last.safetensors, checkpoint.safetensors, config.ini, log.csv,\n"
    "val.csv and curve.svg.\n"
    "\n"
    "  --set SECTION.KEY=VALUE  change a key of the file; may be repeated\n"
    "  --resume                 continue from the folder's checkpoint, exactly as if the run had not stopped, on the\n"
    "                           same instruction set (LGD_ISA)\n"
    "  --init WEIGHTS           start from a weights file (the same as --set train.init=WEIGHTS); given twice, the\n"
    "                           second file has the parameters that the first lacks (train.init_rest)\n"
    "  --initial FILE           write the weights that the run would start from, and exit\n"
    "  --threads N              number of threads, 1 .. 1024; 0 = all that are allowed (default 0)\n"
    "  --help-config            print every key with its range, default and meaning\n"
    "  --print-config           print the configuration of the run\n"
    "  -h, --help               print this\n"
    "  -V, --version            print the version\n"
    "\n"
    "mpirun -np N lgd-train CONFIG.ini shares every batch out to N processes (docs/scaling.md).\n"
    "Ctrl-C, SIGTERM and SIGHUP finish the step, save a checkpoint and exit with status 130.\n";

typedef struct shown {
    cl_progress progress;
    int64_t first, log_every;
    double loss, seconds, waited;    /* sums since the last line */
    int steps, made, samples, ranks; /* steps: those that were not skipped */
    bool coder;
} shown;

static const char *trained(const shown *s, const tr_row *row)
{
    if (s->coder) return "auto-encoder";
    return row->pretraining ? "g alone" : row->g_fixed ? "h alone" : "g and h";
}

static void show_step(const tr_row *row, void *user)
{
    shown *s = user;
    char extra[160];
    if (!row->skip) s->loss += row->loss;
    s->made++;
    s->steps += !row->skip;
    s->samples += row->batch;
    s->seconds += row->seconds;
    s->waited += row->waited;
    const int64_t done = row->step - s->first;
    const bool line = row->step % s->log_every == 0 || row->step == row->total;
    const double mean = s->steps ? s->loss / s->steps : NAN, speed = s->seconds > 0 ? s->samples / s->seconds : 0;
    if (s->progress.terminal) {
        snprintf(extra, sizeof extra, "%s  step %lld  loss %.4f  %.1f samples/s", trained(s, row), (long long)row->step,
                 mean, speed);
        cl_progress_show(&s->progress, done, extra);
    } else if (line) {
        /* From the last lines' speed: a step of the second phase takes several times as long as one of the first. */
        const long left = s->made ? lround(s->seconds / s->made * (double)(row->total - row->step)) : 0;
        if (s->ranks > 1) snprintf(extra, sizeof extra, "  waiting %.1f%%", 100 * s->waited / s->seconds);
        cl_note("step %lld/%lld  %s  loss %.4f  rate %.2e  %.1f samples/s%s  ETA %ld:%02ld:%02ld", (long long)row->step,
                (long long)row->total, trained(s, row), mean, row->rate, speed, s->ranks > 1 ? extra : "", left / 3600,
                left / 60 % 60, left % 60);
    }
    if (line) s->loss = s->seconds = s->waited = 0, s->steps = s->made = s->samples = 0;
}

/* The results of a run are its validations: they go to standard output. */
static void show_validation(const tr_validation *v, void *user)
{
    shown *s = user;
    cl_progress_end(&s->progress);
    printf("validation at step %lld: render RMSE", (long long)v->step);
    for (int k = 0; k <= v->iterations; k++) printf(" %.4f", v->render[k]);
    printf("  diffuse %.4f specular %.4f roughness %.4f normal %.4f%s\n", v->diffuse, v->specular, v->roughness,
           v->normal, v->best ? "  (best)" : "");
    cl_flush();
}

static void show_note(const char *line, void *user)
{
    shown *s = user;
    cl_progress_end(&s->progress);
    cl_note("%s", line);
}

static bool stop(void *user)
{
    (void)user;
    return cl_interrupted();
}

/* The exit status. Of several ranks those say why that know it. */
static int failed(const ts_status *st)
{
    const bool stopped = st->code == TS_INTERRUPTED;
    if (!*st->message) return stopped ? CL_INTERRUPTED : CL_FAILED;
    return stopped ? cl_stopped("%s", st->message) : cl_failed("%s", st->message);
}

/* Rank 0's folder. */
static ts_code find_folder(const char *folder, bool resume, ts_status *st)
{
    if (!resume) return cl_make_folder(folder, NULL, st);
    return access(folder, F_OK) == 0 ? TS_OK : ts_fail(st, TS_IO, "%s: there is no run to resume", folder);
}

static int train(const tr_config *config, const char *folder, bool resume, const tr_ranks *ranks)
{
    ts_status st = {0};
    shown s = {.log_every = config->train.log_every, .ranks = ranks->count, .coder = config->coder.code > 0};
    const tr_listener listener = {
        .step = show_step, .validated = show_validation, .note = show_note, .stop = stop, .user = &s};
    const bool made = ranks->rank == 0 && access(folder, F_OK) != 0;
    if (tr_agree(ranks, ranks->rank ? TS_OK : find_folder(folder, resume, &st), &st) != TS_OK) return failed(&st);
    cl_catch_interrupt();
    tr_trainer *t = tr_create(config, folder, resume, ranks, &listener, &st);
    if (!t && made) rmdir(folder); /* of a run that did not begin */
    if (!t) return failed(&st);
    const int64_t total = config->train.pretrain_steps + config->train.steps;
    s.first = tr_step_now(t);
    s.progress = cl_progress_start("train", total - s.first);
    if (resume && s.first > 0 && ranks->rank == 0)
        cl_note("%s: %s step %lld of %lld", folder, s.first < total ? "going on from" : "complete at",
                (long long)s.first, (long long)total);
    const ts_code code = tr_run(t, &st);
    cl_progress_end(&s.progress);
    tr_destroy(&t);
    if (code != TS_OK) return failed(&st);
    char best[PATH_MAX];
    snprintf(best, sizeof best, "%s/best.safetensors", folder);
    if (ranks->rank == 0)
        cl_note("done: %s/%slast.safetensors", folder, access(best, F_OK) == 0 ? "best.safetensors and " : "");
    return CL_OK;
}

enum { SET = 256, RESUME, INIT, INITIAL, THREADS, HELP_CONFIG, PRINT_CONFIG, HELP = 'h', VERSION = 'V' };
static const struct option options[] = {
    {"set", required_argument, NULL, SET},
    {"resume", no_argument, NULL, RESUME},
    {"init", required_argument, NULL, INIT},
    {"initial", required_argument, NULL, INITIAL},
    {"threads", required_argument, NULL, THREADS},
    {"help-config", no_argument, NULL, HELP_CONFIG},
    {"print-config", no_argument, NULL, PRINT_CONFIG},
    {"help", no_argument, NULL, HELP},
    {"version", no_argument, NULL, VERSION},
    {0},
};

/* Results are rank 0's to print; of messages, each says which rank's it is. Before ranks can agree on who speaks, the
 * first on every host does. */
static void speak_as_rank(int rank, bool silent)
{
    static char name[32];
    snprintf(name, sizeof name, "rank %d", rank);
    cl_speak_as(silent ? NULL : rank ? name : "");
}

/* The configuration as file (NULL: none) and options have it. An exit status. */
static int configure(const char *file, const char *const *set, int sets, const char *const init[2], tr_config *config)
{
    ts_status st = {0};
    *config = tr_config_default();
    if (file && tr_config_read(config, file, &st) != TS_OK)
        return st.code == TS_INVALID ? cl_usage("%s", st.message) : cl_failed("%s", st.message);
    for (int i = 0; i < sets && st.code == TS_OK; i++) tr_config_set_assignment(config, set[i], &st);
    if (init[0] && st.code == TS_OK) tr_config_set(config, "--init", "train", "init", init[0], &st);
    if (init[1] && st.code == TS_OK) tr_config_set(config, "--init", "train", "init_rest", init[1], &st);
    if (st.code == TS_OK) tr_config_check(config, &st);
    return st.code == TS_OK ? CL_OK : cl_usage("%s", st.message);
}

/* As one process, or as one of those that a launcher has started. */
static int run(const tr_config *config, const char *file, bool resume, bool threads_given)
{
    tr_ranks ranks;
    ts_status st = {0};
    char folder[1100];
    if (tr_ranks_start(&ranks, &st) != TS_OK) return cl_failed("%s", st.message);
    speak_as_rank(ranks.rank, false);
    if (ranks.count > 1 && !threads_given) ts_threads_set(ts_threads_of_share(ranks.world.cpus, ranks.world.local));
    if (*config->output.folder) snprintf(folder, sizeof folder, "%s", config->output.folder);
    else tr_default_folder(file, folder, sizeof folder);
    const int code = cl_finish(train(config, folder, resume, &ranks));
    tr_ranks_end(&ranks, code);
    return code;
}

int main(int argc, char **argv)
{
    cl_open_streams();
    speak_as_rank(tr_launched_rank(), !tr_launched_first());
    if (tr_launched_rank() > 0 && !freopen("/dev/null", "w", stdout)) return CL_FAILED;
    bool resume = false, print = false, threads_given = false;
    const char *init[2] = {NULL, NULL}, *initial = NULL;
    const char **set = malloc((size_t)argc * sizeof *set);
    int sets = 0, option, code = cl_init("lgd-train");
    ts_status st = {0};
    if (code == CL_OK && !set) code = cl_failed("out of memory");
    if (code != CL_OK) goto end;
    cl_trace();
    while ((option = cl_option_next(argc, argv, ":hV", options, &st)) != CL_ARGUMENT_END) {
        int64_t threads;
        switch (option) {
        case SET: set[sets++] = optarg; break;
        case RESUME: resume = true; break;
        case INIT:
            if (init[1]) {
                code = cl_usage("--init may be given twice, not more often");
                goto end;
            }
            if (cl_check_name("--init", optarg, &st) != TS_OK) { /* a run would begin from nothing */
                code = cl_usage("%s", st.message);
                goto end;
            }
            init[init[0] != NULL] = optarg;
            break;
        case INITIAL: initial = optarg; break;
        case PRINT_CONFIG: print = true; break;
        case THREADS:
            if (!cl_parse_int(optarg, 0, 1024, &threads)) {
                code = cl_usage("--threads must be an integer from 0 to 1024, not \"%s\"", optarg);
                goto end;
            }
            ts_threads_set((int)threads);
            threads_given = threads > 0;
            break;
        case HELP_CONFIG:
            tr_config_help(stdout);
            code = cl_finish(CL_OK);
            goto end;
        case HELP:
            fputs(usage, stdout);
            code = cl_finish(CL_OK);
            goto end;
        case VERSION:
            cl_print_version();
            code = cl_finish(CL_OK);
            goto end;
        default: code = cl_usage("%s", st.message); goto end;
        }
    }
    const int files = argc - optind;
    if (files > 1 || (files == 0 && !print)) {
        code = cl_usage(files ? "one configuration file is expected, not %d"
                              : "a configuration file is expected, for example configs/single.ini",
                        files);
        goto end;
    }
    if ((files && cl_check_name("CONFIG", argv[optind], &st) != TS_OK) ||
        (initial && cl_check_name("--initial", initial, &st) != TS_OK)) {
        code = cl_usage("%s", st.message);
        goto end;
    }
    if (init[0] && resume) {
        code = cl_usage("--init begins a run and --resume goes on with one: choose one of them");
        goto end;
    }
    if (initial && resume) {
        code = cl_usage("--initial writes what a run begins with and --resume goes on with one: choose one of them");
        goto end;
    }
    tr_config config;
    code = configure(files ? argv[optind] : NULL, set, sets, init, &config);
    if (code != CL_OK) goto end;
    if (print) {
        tr_config_print(&config, true, stdout);
        code = cl_finish(CL_OK);
        goto end;
    }
    if (initial) {
        code = cl_finish(tr_initial(&config, initial, &st) == TS_OK ? CL_OK : cl_failed("%s", st.message));
        goto end;
    }
    code = run(&config, argv[optind], resume, threads_given);
end:
    free(set);
    return code;
}
