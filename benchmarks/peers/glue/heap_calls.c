/* Count calls of the allocators of C, and of the operators new of C++; link with --wrap for each. */
#include <stddef.h>

__attribute__((visibility("default"))) unsigned long heap_calls;

#define COUNTED(name, parameters, arguments) \
    void *__real_##name parameters __attribute__((weak)); \
    void *__wrap_##name parameters; \
    void *__wrap_##name parameters { heap_calls++; return __real_##name arguments; }

COUNTED(malloc, (size_t bytes), (bytes))
COUNTED(calloc, (size_t count, size_t bytes), (count, bytes))
COUNTED(realloc, (void *old, size_t bytes), (old, bytes))
COUNTED(_Znwm, (size_t bytes), (bytes))
COUNTED(_Znam, (size_t bytes), (bytes))
