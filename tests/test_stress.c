/* The short form of the stress of the numerics (tests/stress; `make stress` is the long one). */
#include "data/rectify/tag_sheet.h"
#include "tensor/threads.h"
#include "tests/stress/stress.h"
#include "tests/test.h"

static void run(bool (*part)(const stress *))
{
    ts_threads_set(1); /* such small work is slower on several */
    const stress s = {false, test_folder()};
    CHECK(part(&s), "a bound is broken: see the table");
}

TEST(stress_shading_in_float) { run(stress_shading); }
TEST(stress_newton_in_float) { run(stress_newton); }
TEST(stress_refinement_from_any_picture) { run(stress_refinement); }
TEST(stress_training_with_spoilt_inputs) { run(stress_training); }
TEST(stress_gradient_of_the_unrolled_loop) { run(stress_unrolled); }
TEST(stress_long_sums_and_adam) { run(stress_sums); }
TEST(stress_any_number_of_threads) { run(stress_threads); }
TEST(stress_cameras_of_printed_sheets)
{
    io_tag_image black[IO_SHEET_TAGS];
    ts_status st = {0};
    if (io_tag_images(black, &st) == TS_UNSUPPORTED) test_skip("%s", st.message);
    run(stress_sheets);
}
