/* Stub of the Crazyflie's firmware: its mass. */
#ifndef PLATFORM_DEFAULTS_H
#define PLATFORM_DEFAULTS_H

#define CF_MASS 0.029f /* kg */

#endif
