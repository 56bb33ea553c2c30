#include "nn/middle_view.h"
#include <math.h>

enum { TELLINGS = 2 };

int nn_middle_tellings(const nn_arch *a, int known)
{
    return a->conditions && a->descent == NN_DESCENT_POSTERIOR && !(known & NN_KNOWN_CAMERA) ? TELLINGS : 1;
}

bool nn_guess_in_middle_view(ag_tape *tape, const nn_model *model, const nn_input *in, nn_guess *guess)
{
    if (nn_middle_tellings(&model->arch, in->known[0]) == 1) return nn_guess_from(tape, model, in, guess);
    rd_view views[TELLINGS] = {in->views[0], in->views[0]};
    const unsigned char known[TELLINGS] = {in->known[0], in->known[0] | NN_KNOWN_CAMERA};
    views[1].camera[0] = views[1].camera[1] = 0;
    views[1].camera[2] = NN_MIDDLE_DISTANCE;
    static const float parts[TELLINGS] = {1 - NN_MIDDLE_PART, NN_MIDDLE_PART};
    nn_input twice = *in;
    twice.views = views;
    twice.known = known;
    twice.tellings = TELLINGS;
    twice.parts = parts;
    if (!nn_guess_from(tape, model, &twice, guess)) return false;
    float *mean = guess->scene->t.data, *told = mean + 2 * RD_SCENE_NUMBERS;
    told[RD_SCENE_DISTANCE] = logf(NN_MIDDLE_DISTANCE / RD_FLASH_DISTANCE);
    for (int i = 0; i < 2 * RD_SCENE_NUMBERS; i++) mean[i] = parts[0] * mean[i] + parts[1] * told[i];
    return true;
}
