/* The flight process: load the library that is named, and call it for every record of sensors on stdin. */
#include <dlfcn.h>
#include <stdio.h>

#include "HAL.h"

int main(int count, char **names)
{
    void *library = dlopen(names[count - 1], RTLD_NOW);
    void (*control)(HAL_acquisition_t *, HAL_command_t *);
    HAL_acquisition_t sensors;
    HAL_command_t motors;

    if (library == NULL) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    *(void **)&control = dlsym(library, "RSEDU_control");
    while (fread(&sensors, sizeof sensors, 1, stdin) == 1) {
        control(&sensors, &motors);
        fwrite(&motors, sizeof motors, 1, stdout);
        fflush(stdout);
    }
    return 0;
}
