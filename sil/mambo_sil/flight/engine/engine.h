/* SPDX-License-Identifier: MIT-0
 *
 * The closed loop in C, with the bits of the NumPy simulation. Each header repeats the Python module of its name;
 * brackets fix the order of operations. Compile with -ffp-contract=off and without -ffast-math.
 */
#ifndef ENGINE_H
#define ENGINE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "lanes.h"
#include "columns.h"
#include "records.h"

#endif
