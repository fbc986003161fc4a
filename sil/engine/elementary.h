#ifndef ENGINE_ELEMENTARY_H
#define ENGINE_ELEMENTARY_H
#include <math.h>
static inline void sine_cosine(double x, double *s, double *c) { *s = sin(x); *c = cos(x); }
static inline double arc_tangent(double x) { return atan(x); }
static inline double arc_sine(double x) { return asin(x); }
#endif
