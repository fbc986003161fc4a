/* Stub of the Crazyflie's firmware: only what an out-of-tree controller uses. */
#ifndef FREERTOS_H
#define FREERTOS_H

#define T2M(ticks) ((unsigned int)(ticks))

#endif
