#ifndef SEMPHR_H
#define SEMPHR_H

#include "queue.h"

SemaphoreHandle_t desk_create_semaphore(uint32_t count);

#define xSemaphoreCreateBinary() desk_create_semaphore(0)
#define xSemaphoreCreateMutexStatic(buffer) ((void)(buffer), desk_create_semaphore(1))
#define xSemaphoreTake(semaphore, wait_ticks) xQueueReceive(semaphore, NULL, wait_ticks)
#define xSemaphoreGive(semaphore) xQueueSend(semaphore, NULL, 0)

#endif
