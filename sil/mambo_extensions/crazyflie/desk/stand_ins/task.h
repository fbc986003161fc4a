/* Stub of the Crazyflie's firmware. */
#ifndef TASK_H
#define TASK_H

#include <stdint.h>

uint32_t xTaskGetTickCount(void);

#endif
