#ifndef CONSOLE_H
#define CONSOLE_H

int consolePrintf(const char *format, ...);

#endif
