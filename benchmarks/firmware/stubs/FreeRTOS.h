/* In the place of FreeRTOS: what the firmware's stabilizer, commander and estimator use of it. Tasks are coroutines
 * (desk/tasks.c); a semaphore is a queue of items without content. */
#ifndef FREERTOS_H
#define FREERTOS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "cfassert.h"
#include "config.h"

typedef long BaseType_t;
typedef unsigned long UBaseType_t;
typedef uint32_t TickType_t;
typedef uint8_t StackType_t;
typedef void (*TaskFunction_t)(void *);

typedef struct {
    uint8_t *items;
    uint32_t length;
    uint32_t item_bytes;
    uint32_t first;
    uint32_t count;
} StaticQueue_t;

typedef StaticQueue_t *QueueHandle_t;
typedef StaticQueue_t StaticSemaphore_t;
typedef StaticQueue_t *SemaphoreHandle_t;
typedef struct { int unused; } StaticTask_t;
typedef struct { int unused; } StaticTimer_t;
typedef void *TaskHandle_t;
typedef void *TimerHandle_t;

#define portBASE_TYPE BaseType_t
#define portTickType TickType_t
#define portMAX_DELAY UINT32_MAX
#define portYIELD_FROM_ISR(woken)
#define xTaskHandle TaskHandle_t
#define xQueueHandle QueueHandle_t
#define xSemaphoreHandle SemaphoreHandle_t
#define xTimerHandle TimerHandle_t
#define pdTRUE 1
#define pdFALSE 0
#define pdPASS 1

#define configTICK_RATE_HZ 1000
#define configMINIMAL_STACK_SIZE 1
#define M2T(milliseconds) ((unsigned int)(milliseconds))
#define T2M(ticks) ((unsigned int)(ticks))
#define F2T(rate_hz) ((unsigned int)(configTICK_RATE_HZ / (rate_hz)))
#define S2T(seconds) ((portTickType)((seconds) * configTICK_RATE_HZ))
#define T2S(ticks) ((ticks) / (float)configTICK_RATE_HZ)
#define TASK_STABILIZER_ID_NBR 3
#define configASSERT(condition) ASSERT(condition)

#endif
