/* What is given of photographs, for g and the steps alike. */
#include "nn/lgd_internal.h"

int nn_given(const nn_input *in) { return in->given > 0 ? in->given : 1; }
int nn_times_told(const nn_input *in) { return in->tellings > 0 ? in->tellings : 1; }
int nn_materials(const nn_input *in) { return in->image.shape.n / nn_given(in); }

rd_view nn_view_of(const nn_model *model, const nn_input *in, int photograph)
{
    rd_view view = in->views ? in->views[photograph] : in->view;
    if (model->arch.compat == NN_COMPAT_PUBLISHED && view.kind == RD_POINT) view.kind = RD_PUBLISHED;
    return view;
}
