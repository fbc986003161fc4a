#ifndef DEBUG_H
#define DEBUG_H

#include "console.h"

#ifndef DEBUG_MODULE
#define DEBUG_MODULE "firmware"
#endif

#define DEBUG_PRINT(format, ...) consolePrintf(DEBUG_MODULE ": " format, ##__VA_ARGS__)
#define DEBUG_PRINT_OS(format, ...) DEBUG_PRINT(format, ##__VA_ARGS__)

#endif
