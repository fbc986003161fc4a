/* In the place of the firmware's header: a task that calls functions for others. */
#ifndef WORKER_H
#define WORKER_H

int workerSchedule(void (*function)(void *), void *argument);

#endif
