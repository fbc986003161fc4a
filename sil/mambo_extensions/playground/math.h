/* SPDX-License-Identifier: MIT-0
 *
 * What the engine uses of <math.h>, where there is no C library: each is one instruction of WebAssembly, or none.
 */
#ifndef PLAYGROUND_MATH_H
#define PLAYGROUND_MATH_H

#define NAN __builtin_nan("")
#define INFINITY __builtin_inf()
#define sqrt __builtin_sqrt

#endif
