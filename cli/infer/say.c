#include "cli/infer/say.h"
#include "cli/cli.h"
#include "render/scene.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Says what makes a photograph a poor one: the maps will be guesses. The smallest of several tells whether their
 * squares were made larger. What is returned is why they should be looked at, in short; NULL: they need not. */
static const char *say_levels(const cl_item *item, int size)
{
    const int sources = cl_item_sources(item);
    const char *why = NULL;
    int least = 0;
    for (int k = 1; k < sources; k++)
        if (cl_item_source(item, k)->side < cl_item_source(item, least)->side) least = k;
    const io_capture_source *small = cl_item_source(item, least);
    if (size > small->side)
        cl_note("%s: note: upsampled: its square has %d pixels a side and --size is %d", cl_item_file(item, least),
                small->side, size);
    for (int k = 0; k < sources; k++) {
        const io_levels *l = &cl_item_source(item, k)->levels;
        const unsigned warning = cl_item_light(l);
        const char *file = cl_item_file(item, k);
        if (warning & CL_WARN_BLACK)
            cl_note("%s: warning: the photograph is black: %s", file,
                    sources > 1 ? "it says nothing of the sample" : "its maps mean nothing");
        else if (warning & CL_WARN_FULL)
            cl_note("%s: warning: the photograph is overexposed (%.0f%% of the values): %s", file, 100 * l->full,
                    sources > 1 ? "it says little of the sample" : "its maps mean little");
        else if (l->over > 0) cl_note("%s: note: %.1f%% of the values are above 1 and count as 1", file, 100 * l->over);
        if (warning && !why) why = cl_warning_names[warning & CL_WARN_BLACK ? 0 : 1];
    }
    return why;
}

/* Where the corners put the camera. */
static void say_angle(const cl_item *item)
{
    const lgd_rectified *r = &item->angle;
    cl_note("%s: camera at %.2f %.2f %.2f sides of the square, %.0f degrees from straight above (%s%.1f degrees across "
            "the photograph: %s%s)",
            item->job->photo, r->camera.at[0], r->camera.at[1], r->camera.at[2], io_pinhole_tilt(&r->camera),
            r->assumed ? "warning: assumed " : "", r->fov, r->fov_from, r->assumed ? "; --fov DEG sets it" : "");
}

static void say_profile(const char *photo, const char *profile)
{
    if (*profile) cl_note("%s: warning: its colour profile (%s) cannot be used: sRGB is assumed", photo, profile);
}

bool cl_say_sheet(const cl_item *item, bool quiet)
{
    const io_sheet_set *set = &item->sheet;
    int order[IO_SOLVE_MOST];
    for (int i = 0; i < set->photos; i++)
        if (set->photo[i].st.code && (set->good > 0 || i > 0)) cl_failed("%s", set->photo[i].st.message);
    for (int i = 0; i < set->photos && !quiet; i++) say_profile(set->photo[i].path, set->photo[i].profile);
    if (!quiet && set->good > 0 && !item->st.code) {
        const io_sheet_photo *p;
        lgd_sheet_order(set, order);
        p = &set->photo[order[0]];
        cl_note(
            "%s: %d of %d photographs; field of view %.1f degrees (%s), flash %.2f right and %.2f down of the lens in "
            "sides of the window",
            item->job->photo, set->good, set->photos,
            io_fov_of_focal(p->sight.camera.focal, p->sight.camera.width, p->sight.camera.height),
            set->sure ? "EXIF or --fov, refined" : "fitted: EXIF has no focal length", set->aside[0], set->aside[1]);
    }
    return set->good == set->photos;
}

/* What was assumed of the camera. */
static void say_fov(const cl_item *item)
{
    const double fov = rd_fov_of((double)item->photo[0].camera[2]);
    const char *how = cl_item_assumption(item);
    if (item->fov == LGD_FOV_OF_PHOTO) return;
    if (!*how) cl_note("%s: field of view %.1f degrees (%s)", item->job->photo, fov, item->fov_from);
    else if (*how == 'e')
        cl_note("%s: field of view %.1f degrees, estimated: %s", item->job->photo, fov, item->fov_from);
    else
        cl_note("%s: warning: a field of view of %.1f degrees is assumed: %s; --fov DEG sets it", item->job->photo, fov,
                item->fov_from);
}

void cl_say_replaced(const cl_item *item)
{
    char names[256] = "";
    if (item->replaced)
        cl_note("%s: note: the maps of another photograph in %s were replaced", item->job->photo, item->job->folder);
    if (!item->written.removed) return;
    for (int i = 0; i < LGD_FILES; i++)
        if (item->written.removed >> i & 1)
            snprintf(names + strlen(names), sizeof names - strlen(names), " %s", lgd_files[i]);
    cl_note("%s: note: removed from the folder, because they are of another estimate:%s", item->job->photo, names);
}

/* How near the maps come to the photograph. */
static void say_difference(const cl_command *c, const cl_item *item)
{
    const char *hint = c->iterations == -1 && item->last > CL_FAR ? "; --iterations auto may come nearer"
                                                                  : ""; /* each step halves what is left */
    if (item->steps > 0)
        cl_note("%s: difference from the photograph %.4f at first -> %.4f after %d step%s%s", item->job->photo,
                item->first, item->last, item->steps, item->steps == 1 ? "" : "s", hint);
    else cl_note("%s: difference from the photograph %.4f at first", item->job->photo, item->first);
}

const char *cl_say_photo(const cl_command *c, const cl_item *item)
{
    if (item->photos > 0 && item->photos < item->sheet.good)
        cl_note("%s: note: %d of its %d photographs are used, the most different: these weights read no more",
                item->job->photo, item->photos, item->sheet.good);
    else if (item->photos > 0 && item->photos < item->capture.images)
        cl_note("%s: note: the first %d of its %d photographs are used: these weights read no more", item->job->photo,
                item->photos, item->capture.images);
    if (item->warnings & CL_WARN_MASK) /* of another photograph, or black and white exchanged */
        cl_note("%s: warning: the mask %s is black all over its square: nothing is refined", item->job->photo, c->mask);
    say_profile(*item->capture.profile ? item->capture.profile_of : item->job->photo, item->profile);
    if (item->transparent)
        cl_note("%s: warning: it is transparent in places, black is taken there%s", item->job->photo,
                c->mask ? "" : ": with --mask and the same file they are not refined");
    const char *why = item->image ? say_levels(item, c->size) : NULL;
    if (item->st.code) return NULL;
    if (!why && item->last > CL_FAR) why = "its maps do not look like it";
    const bool one_file = c->metallic && c->outputs & LGD_OUT_GLB;
    if (one_file || c->outputs & (LGD_OUT_BASECOLOR | LGD_OUT_METALLIC | LGD_OUT_ORM))
        cl_note("%s: base colour and metalness miss diffuse by %.4f and F0 by %.4f (RMS, linear)", item->job->photo,
                item->written.lost.diffuse, item->written.lost.specular);
    if (c->corners) say_angle(item);
    else say_fov(item);
    if (fabs(item->power - 1) >= 0.005)
        cl_note("%s: light power %.2f of the %s", item->job->photo, item->power,
                item->capture.images ? "capture's" : "default");
    say_difference(c, item);
    return why;
}
