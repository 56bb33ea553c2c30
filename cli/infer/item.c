#include "cli/infer/item.h"
#include "infer/api_model.h"
#include <stdlib.h>

const char *const cl_warning_names[CL_WARNINGS] = {"black",
                                                   "overexposed",
                                                   "field of view assumed",
                                                   "colour profile not used",
                                                   "mask black",
                                                   "maps do not look like the photograph",
                                                   "transparent in places"};

const char *cl_item_assumption(const cl_item *item)
{
    if (item->angle.assumed) return "assumed: ";
    if (item->fov != LGD_FOV_UNKNOWN) return "";
    return lgd_fov_assumption(&item->photo[0]);
}

const char *cl_item_fov_is(const cl_item *item)
{
    const char *how = cl_item_assumption(item);
    return !*how ? "known" : *how == 'e' ? "estimated" : "assumed";
}

int cl_item_sources(const cl_item *item) { return item->capture.images ? item->photos : 1; }

const io_capture_source *cl_item_source(const cl_item *item, int k)
{
    return item->capture.images ? &item->capture.source[k] : &item->source;
}

const char *cl_item_file(const cl_item *item, int k)
{
    const char *file = cl_item_source(item, k)->file;
    return file ? file : item->job->photo;
}

unsigned cl_item_light(const io_levels *levels)
{
    return levels->dark >= 1 ? CL_WARN_BLACK : levels->full > 0.9 ? CL_WARN_FULL : 0;
}

void cl_item_clear(cl_item *item)
{
    free(item->square);
    item->square = NULL;
    io_capture_free(&item->capture);
    io_sheet_set_free(&item->sheet);
    free(item->mask);
    free(item->result);
    item->mask = NULL;
    item->result = NULL;
}

void cl_item_free(cl_item *item)
{
    cl_item_clear(item);
    io_material_free(&item->m);
}
