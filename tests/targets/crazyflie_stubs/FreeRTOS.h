/* Stub of the Crazyflie's firmware: only what an out-of-tree controller uses. */
#ifndef FREERTOS_H
#define FREERTOS_H

#define M2T(milliseconds) ((unsigned int)(milliseconds))

#endif
