/* SPDX-License-Identifier: MIT-0
 *
 * Functions that compilers call even without a C library.
 */
#include <stddef.h>

void *memset(void *destination, int value, size_t count);
void *memcpy(void *destination, const void *source, size_t count);

void *memset(void *destination, int value, size_t count)
{
    unsigned char *to = (unsigned char *)destination;
    size_t i;

    for (i = 0; i < count; i++) {
        to[i] = (unsigned char)value;
    }
    return destination;
}

void *memcpy(void *destination, const void *source, size_t count)
{
    unsigned char *to = (unsigned char *)destination;
    const unsigned char *from = (const unsigned char *)source;
    size_t i;

    for (i = 0; i < count; i++) {
        to[i] = from[i];
    }
    return destination;
}
