/* The descriptors of all ops, ended by a null pointer. The definition is made by make from the names of the files. */
#ifndef AG_OP_LIST_H
#define AG_OP_LIST_H
#include "autograd/tape.h"

extern const ag_op *const ag_op_list[];
#endif
