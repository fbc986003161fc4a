#ifndef TASK_H
#define TASK_H

#include "FreeRTOS.h"

uint32_t xTaskGetTickCount(void);
void vTaskDelay(uint32_t ticks);
void vTaskDelayUntil(uint32_t *last, uint32_t ticks);
TaskHandle_t desk_create_task(TaskFunction_t function, int priority);

#define vTaskSetApplicationTaskTag(task, tag)
#define xTaskCreateStatic(function, name, depth, argument, priority, stack, buffer) \
    ((void)(stack), (void)(buffer), desk_create_task(function, priority))

#endif
