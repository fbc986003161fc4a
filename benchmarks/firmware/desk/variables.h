#ifndef VARIABLES_H
#define VARIABLES_H

#include <stdbool.h>

/* Return a log variable; NaN if there is none of this name. */
double variables_log(const char *name);

/* Set a parameter; false if there is none of this name. */
bool variables_set(const char *name, double wanted);

#endif
