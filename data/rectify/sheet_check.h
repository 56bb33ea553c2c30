/* What is wrong with photographs of a printed sheet that can be used all the same. */
#ifndef IO_SHEET_CHECK_H
#define IO_SHEET_CHECK_H
#include "data/rectify/sheet_set.h"

#define IO_SHEET_SHARP 2.5  /* pixels of a window of 512: wider edges smear what the maps show */
#define IO_SHEET_CLEAR 0.1  /* share of the window's values that may be burnt out */
#define IO_SHEET_FLAT 1.0   /* pixels of 512 that the tags' corners may be off */
#define IO_SHEET_STEEP 55.0 /* degrees from straight above */
#define IO_SHEET_APART 10.0 /* degrees between two cameras of a set at least, seen from the sample */

/* Bits. */
enum {
    IO_FAULT_MISSING = 1, /* not all tags are seen */
    IO_FAULT_BLURRED = 2,
    IO_FAULT_BURNT = 4, /* the window; st says when it is the paper */
    IO_FAULT_BENT = 8,
    IO_FAULT_STEEP = 16
};

/* Those of a photograph whose st is TS_OK. */
unsigned io_sheet_faults(const io_sheet_photo *photo);

/* How far the tags' corners are off a flat sheet, in pixels of a window of 512 straight under the camera. */
double io_sheet_bend(const io_sheet_photo *photo);

/* The widest angle at the sample between two good photographs' cameras, degrees; 0 where there are not two. */
double io_sheet_apart(const io_sheet_set *set);
#endif
