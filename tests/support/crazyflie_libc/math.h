/* Stub of the C library's header: what the code for a flight stack uses, also where a compiler comes without a C library. */
#ifndef MATH_H
#define MATH_H

#define NAN __builtin_nanf("")
#define isfinite(value) __builtin_isfinite(value)
#define isnan(value) __builtin_isnan(value)

float asinf(float x);
float atan2f(float y, float x);
float copysignf(float size, float sign);
float cosf(float x);
float fabsf(float value);
float fmaxf(float a, float b);
float fminf(float a, float b);
float remainderf(float a, float b);
float sinf(float x);
float sqrtf(float x);

#endif
