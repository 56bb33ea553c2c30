#include "nn/likely_views.h"
#include <math.h>
#include <string.h>

const float nn_likely_distance[NN_LIKELY_VIEWS] = {0, 1.07f, 2.26f};
const float nn_likely_part[NN_LIKELY_VIEWS] = {0.4f, 0.25f, 0.35f};

int nn_likely_views(const nn_arch *a, int known)
{
    return a->conditions && a->descent == NN_DESCENT_POSTERIOR && !(known & NN_KNOWN_CAMERA) ? NN_LIKELY_VIEWS : 1;
}

bool nn_guess_in_likely_views(ag_tape *tape, const nn_model *model, const nn_input *in, nn_guess *guess)
{
    if (nn_likely_views(&model->arch, in->known[0]) == 1) return nn_guess_from(tape, model, in, guess);
    const float *const distance = nn_likely_distance, *const parts = nn_likely_part;
    rd_view views[NN_LIKELY_VIEWS];
    unsigned char known[NN_LIKELY_VIEWS];
    for (int t = 0; t < NN_LIKELY_VIEWS; t++) {
        views[t] = in->views[0], known[t] = in->known[0];
        if (distance[t] == 0) continue;
        known[t] |= NN_KNOWN_CAMERA;
        views[t].camera[0] = views[t].camera[1] = 0, views[t].camera[2] = distance[t];
    }
    nn_input again = *in;
    again.views = views;
    again.known = known;
    again.tellings = NN_LIKELY_VIEWS;
    again.parts = parts;
    if (!nn_guess_from(tape, model, &again, guess)) return false;
    float mean[2 * RD_SCENE_NUMBERS] = {0};
    for (int t = 0; t < NN_LIKELY_VIEWS; t++) {
        float *said = guess->scene->t.data + (size_t)t * 2 * RD_SCENE_NUMBERS;
        if (distance[t] > 0) said[RD_SCENE_DISTANCE] = logf(distance[t] / RD_FLASH_DISTANCE);
        for (int i = 0; i < 2 * RD_SCENE_NUMBERS; i++) mean[i] += parts[t] * said[i];
    }
    memcpy(guess->scene->t.data, mean, sizeof mean);
    return true;
}
