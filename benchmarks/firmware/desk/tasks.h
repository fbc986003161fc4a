#ifndef TASKS_H
#define TASKS_H

#include <stdint.h>

/* Run the tasks by their priority until all wait. */
void tasks_run(void);

void tasks_advance_clock(uint32_t milliseconds);

#endif
