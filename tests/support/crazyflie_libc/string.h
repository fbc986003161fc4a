/* Stub of the C library's header, as math.h beside it. */
#ifndef STRING_H
#define STRING_H

#include <stddef.h>

int memcmp(const void *a, const void *b, size_t size);
int strcmp(const char *a, const char *b);
void *memcpy(void *to, const void *from, size_t size);
char *strncpy(char *to, const char *from, size_t size);

#endif
