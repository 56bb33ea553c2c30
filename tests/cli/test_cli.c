/* What the programs share. */
#include "cli/arguments.h"
#include "cli/camera.h"
#include "cli/cli.h"
#include "tests/support/comma.h"
#include "tests/test.h"
#include "train/state.h"
#include <fcntl.h>
#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

TEST(cli_numbers_are_whole_strings_in_range)
{
    int64_t i = -1;
    double d = -1;
    CHECK(cl_parse_int("42", 0, 100, &i) && i == 42, "42");
    const char *const bad[] = {"", " 1", "1 ", "1x", "0x10", "101", "-1", "99999999999999999999", "1.0", "1e2"};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
        CHECK(!cl_parse_int(bad[k], 0, 100, &i), "'%s' must be refused", bad[k]);
    CHECK(cl_parse_real("1e-3", 0, 1, &d) && d == 1e-3, "1e-3");
    CHECK(cl_parse_size("123", &d) && d == 123 && cl_parse_size("0.5G", &d) && d == 512 * 1048576.0, "0.5G is %g", d);
    const char *bad_size[] = {"", "G", "-1K", "0", "0K", "1T", "1 G", "1GG", "nanK"};
    for (size_t k = 0; k < sizeof bad_size / sizeof *bad_size; k++)
        CHECK(!cl_parse_size(bad_size[k], &d), "'%s' must be refused", bad_size[k]);
    CHECK(cl_parse_real("1e-310", 0, 1, &d) && d > 0, "a denormal is a number");
    const char *const bad_real[] = {"", "nan", "inf", "1,5", "0.5x", "2", "-0.1", " 0.5"};
    for (size_t k = 0; k < sizeof bad_real / sizeof *bad_real; k++)
        CHECK(!cl_parse_real(bad_real[k], 0, 1, &d), "'%s' must be refused", bad_real[k]);
}

TEST(cli_numbers_ignore_the_locale)
{
    comma_locale();
    CHECK(cl_init("test") == CL_OK, "init");
    double d = 0;
    CHECK(cl_parse_real("0.25", 0, 1, &d) && d == 0.25, "0.25 is %g", d);
    char text[32];
    snprintf(text, sizeof text, "%.2f", 0.25);
    CHECK(!strcmp(text, "0.25"), "printed as %s", text);
}

/* In a process of its own, whose exit status says what went wrong. */
static int with_closed_streams(int closed)
{
    for (int fd = 0; fd < 3; fd++)
        if (closed >> fd & 1) close(fd);
    cl_open_streams();
    for (int fd = 0; fd < 3; fd++)
        if (fcntl(fd, F_GETFD) == -1) return 10 + fd;
    const int next = open("/dev/null", O_RDWR);
    if (next < 3) return 20 + next;
    char byte = 0;
    for (int fd = 0; fd < 3; fd++) /* what is closed says so */
        if (closed >> fd & 1 && (fd ? write(fd, &byte, 1) : read(fd, &byte, 1)) != -1) return 30 + fd;
    return 0;
}

TEST(cli_closed_streams_are_opened)
{
    for (int closed = 0; closed < 8; closed++) {
        int status = -1;
        const pid_t child = fork();
        if (child == 0) _exit(with_closed_streams(closed));
        CHECK(child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status), "fork");
        CHECK(WEXITSTATUS(status) == 0, "streams %d closed: %d", closed, WEXITSTATUS(status));
    }
}

TEST(cli_folders)
{
    char path[300];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/a/b/c", test_folder());
    CHECK(cl_make_folder(path, NULL, &st) == TS_OK && cl_make_folder(path, NULL, &st) == TS_OK, "%s", st.message);
    struct stat info;
    CHECK(stat(path, &info) == 0 && S_ISDIR(info.st_mode), "not made");
    snprintf(path, sizeof path, "%s/file", test_folder());
    FILE *f = fopen(path, "w");
    CHECK(f && fclose(f) == 0, "file");
    CHECK(cl_make_folder(path, NULL, &st) == TS_IO && strstr(st.message, "file"), "a file is not a folder: '%s'",
          st.message);
    CHECK(cl_make_folder("", NULL, &st) == TS_INVALID, "empty");
}

TEST(cli_progress_is_silent_without_a_terminal)
{
    cl_progress p = cl_progress_start("work", 10);
    CHECK(!p.terminal || p.total == 10, "start");
    p.terminal = false;
    cl_progress_show(&p, 5, NULL);
    CHECK(p.last == 0, "nothing is shown without a terminal");
    cl_progress_end(&p);
}

/* lgd-eval --camera phone is what the model phone was trained on. */
TEST(phone_of_the_evaluation_is_that_of_the_training)
{
    ts_status st;
    tr_config c = tr_config_default();
    CHECK(tr_config_read(&c, "configs/single-phone.ini", &st) == TS_OK, "%s", st.message);
    io_camera trained = tr_camera_of(&c), phone = cl_camera_phone;
    for (int i = 0; i < CL_CAMERA_OPTIONS; i++)
        CHECK(*cl_camera_value(&phone, i) == *cl_camera_value(&trained, i), "%s is %g and was %g",
              cl_camera_options[i].name, (double)*cl_camera_value(&phone, i), (double)*cl_camera_value(&trained, i));
    CHECK(phone.jpeg == trained.jpeg && phone.quantise == trained.quantise, "JPEG %d, 8 bits %d; was %d, %d",
          phone.jpeg, phone.quantise, trained.jpeg, trained.quantise);
    CHECK(phone.told_view == 0 && phone.told_power == 0, "it says what a model is given");
}

/* One word of each kind that is wrong, with what is said of it. */
TEST(options_each_fault_has_its_message)
{
    static const cl_argument table[] = {
        {'s', "size", "N", ""},   {256, "seamless", NULL, ""}, {257, "seed", "N", ""},     {258, "maps", "LIST", ""},
        {259, "exact", NULL, ""}, {'q', "quiet", NULL, ""},    {260, "exactly", NULL, ""}, {0, NULL, NULL, NULL}};
    static const char *const cases[][2] = {{"--nonsense", "there is no option --nonsense"},
                                           {"--nonsense=3", "there is no option --nonsense"},
                                           {"--se", "--se may be --seamless or --seed: write it out"},
                                           {"--exact=1", "option --exact takes no value"},
                                           {"--qui=1", "option --quiet takes no value"},
                                           {"--maps", "option --maps needs a value"},
                                           {"-s", "option -s needs a value"},
                                           {"-x", "there is no option -x"},
                                           {"-qx", "there is no option -x"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char word[32], program[] = "lgd", *argv[] = {program, word, NULL};
        const char *value;
        int operands, key;
        ts_status st;
        snprintf(word, sizeof word, "%s", cases[i][0]);
        optind = 0; /* getopt begins anew */
        while ((key = cl_argument_next(2, argv, table, &value, &operands, &st)) == 'q') continue;
        CHECK(key == CL_ARGUMENT_BAD && !strcmp(st.message, cases[i][1]), "%s: %d, '%s'", word, key, st.message);
    }
    optind = 0;
}
