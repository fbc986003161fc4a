/* Stub of the Crazyflie's firmware. */
#ifndef DEBUG_H
#define DEBUG_H

int consolePrintf(const char *format, ...) __attribute__((format(printf, 1, 2)));

#define DEBUG_PRINT(format, ...) consolePrintf(DEBUG_MODULE ": " format, ##__VA_ARGS__)

#endif
