#ifndef TIMERS_H
#define TIMERS_H

#include "FreeRTOS.h"

#endif
