/* Tasks, queues and clock in the place of FreeRTOS. A task is a coroutine: it runs until it waits for a queue that is
 * empty. Nothing interrupts it, so a flight is the same on every run. */
#include "tasks.h"

#include <string.h>
#include <ucontext.h>

#include "queue.h"
#include "semphr.h"
#include "task.h"

#define MOST_TASKS 8
#define MOST_SEMAPHORES 32
#define STACK_BYTES (256 * 1024)

struct task {
    ucontext_t context;
    TaskFunction_t function;
    const StaticQueue_t *awaited; /* NULL: it can run */
    int priority;
    char stack[STACK_BYTES];
};

static struct task tasks[MOST_TASKS];
static int task_count;
static struct task *running; /* NULL: the program that drives the tasks */
static ucontext_t driver;
static StaticSemaphore_t semaphores[MOST_SEMAPHORES];
static int semaphore_count;
static uint32_t now_ms;

static void start(void) { running->function(NULL); }

TaskHandle_t desk_create_task(TaskFunction_t function, int priority)
{
    struct task *const task = &tasks[task_count++];

    configASSERT(task_count <= MOST_TASKS);
    task->function = function;
    task->priority = priority;
    getcontext(&task->context);
    task->context.uc_stack.ss_sp = task->stack;
    task->context.uc_stack.ss_size = sizeof task->stack;
    task->context.uc_link = &driver;
    makecontext(&task->context, start, 0);
    return task;
}

static struct task *next_task(void)
{
    struct task *next = NULL;

    for (int k = 0; k < task_count; k++) {
        const bool is_ready = (tasks[k].awaited == NULL) || (tasks[k].awaited->count > 0);

        if (is_ready && ((next == NULL) || (tasks[k].priority > next->priority))) {
            next = &tasks[k];
        }
    }
    return next;
}

void tasks_run(void)
{
    while ((running = next_task()) != NULL) {
        running->awaited = NULL;
        swapcontext(&driver, &running->context);
    }
}

void tasks_advance_clock(uint32_t milliseconds) { now_ms += milliseconds; }

uint32_t xTaskGetTickCount(void) { return now_ms; }
uint64_t usecTimestamp(void) { return 1000ULL * now_ms; }
void vTaskDelay(uint32_t ticks) { (void)ticks; }

void vTaskDelayUntil(uint32_t *last, uint32_t ticks) { *last += ticks; }

static bool await(const StaticQueue_t *queue, uint32_t wait_ticks)
{
    while (queue->count == 0) {
        if ((wait_ticks == 0) || (running == NULL)) {
            return false;
        }
        running->awaited = queue; /* for ever: no task of the desk depends on a timeout */
        swapcontext(&running->context, &driver);
    }
    return true;
}

static void *item(const StaticQueue_t *queue, uint32_t number)
{
    return &queue->items[queue->item_bytes * ((queue->first + number) % queue->length)];
}

QueueHandle_t xQueueCreateStatic(uint32_t length, uint32_t item_bytes, uint8_t *items, StaticQueue_t *queue)
{
    *queue = (StaticQueue_t){ items, length, item_bytes, 0, 0 };
    return queue;
}

BaseType_t xQueueSend(QueueHandle_t queue, const void *content, uint32_t wait_ticks)
{
    (void)wait_ticks;
    if (queue->count == queue->length) {
        return pdFALSE;
    }
    if (queue->item_bytes > 0) {
        memcpy(item(queue, queue->count), content, queue->item_bytes);
    }
    queue->count++;
    return pdTRUE;
}

BaseType_t xQueueOverwrite(QueueHandle_t queue, const void *content)
{
    queue->count = 0;
    return xQueueSend(queue, content, 0);
}

BaseType_t xQueuePeek(QueueHandle_t queue, void *content, uint32_t wait_ticks)
{
    if (!await(queue, wait_ticks)) {
        return pdFALSE;
    }
    if (queue->item_bytes > 0) {
        memcpy(content, item(queue, 0), queue->item_bytes);
    }
    return pdTRUE;
}

BaseType_t xQueueReceive(QueueHandle_t queue, void *content, uint32_t wait_ticks)
{
    if (xQueuePeek(queue, content, wait_ticks) == pdFALSE) {
        return pdFALSE;
    }
    queue->first = (queue->first + 1) % queue->length;
    queue->count--;
    return pdTRUE;
}

SemaphoreHandle_t desk_create_semaphore(uint32_t count)
{
    StaticSemaphore_t *const semaphore = &semaphores[semaphore_count++];

    configASSERT(semaphore_count <= MOST_SEMAPHORES);
    *semaphore = (StaticSemaphore_t){ NULL, 1, 0, 0, count };
    return semaphore;
}
