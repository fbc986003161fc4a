/* Stub of the Crazyflie's firmware. */
#ifndef TASK_H
#define TASK_H

void vTaskDelay(unsigned int ticks);

#endif
