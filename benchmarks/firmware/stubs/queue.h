#ifndef QUEUE_H
#define QUEUE_H

#include "FreeRTOS.h"

QueueHandle_t xQueueCreateStatic(uint32_t length, uint32_t item_bytes, uint8_t *items, StaticQueue_t *queue);
BaseType_t xQueueSend(QueueHandle_t queue, const void *item, uint32_t wait_ticks);
BaseType_t xQueueOverwrite(QueueHandle_t queue, const void *item);
BaseType_t xQueuePeek(QueueHandle_t queue, void *item, uint32_t wait_ticks);
BaseType_t xQueueReceive(QueueHandle_t queue, void *item, uint32_t wait_ticks);

#define xQueueSendFromISR(queue, item, woken) xQueueSend(queue, item, 0)

#endif
