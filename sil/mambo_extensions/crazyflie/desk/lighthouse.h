/* Two base stations of the second kind of Lighthouse in opposite corners of a room, and the four sensors of the drone's deck.
 *
 * The rotor of a station turns 50 times a second and sends two planes of light, tilted by 30 degrees to either side. A sensor
 * that a plane passes measures the angle of the rotor then. */
#ifndef LIGHTHOUSE_H
#define LIGHTHOUSE_H

#include <stdint.h>

#include "airframe.h"
#include "estimator.h"

void lighthouse_start(void);

/* Measure by the planes that pass the drone in a millisecond; a share of the sweeps is a reflection. */
void lighthouse_look(estimator_t *filter, const airframe_t *airframe, double reflections, uint32_t clock_ms);

#endif
