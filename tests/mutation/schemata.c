/* SPDX-License-Identifier: MIT-0
 *
 * Runs replay.c once for each mutant of one program, in a process of its own, up to the first outcome that is not
 * the expected one. Arguments: the tapes, the processor time in seconds, the expected outcomes, each with a byte in
 * front that is 0 where any outcome will do; then the numbers of the mutants. Prints the numbers of those that end
 * with all outcomes as expected.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

extern int mutant_number;
int mutant_number;

static unsigned char *expected;
static size_t expected_bytes;
static size_t written;

static size_t compare(const void *values, size_t bytes, size_t count, FILE *file)
{
    const size_t at = ((written / OUTCOME_BYTES) * (OUTCOME_BYTES + 1U)) + (written % OUTCOME_BYTES) + 1U;
    const size_t flag = (written / OUTCOME_BYTES) * (OUTCOME_BYTES + 1U);

    (void)file;
    if (((at + bytes) > expected_bytes)
        || ((expected[flag] != 0U) && (memcmp(&expected[at], values, bytes) != 0))) {
        _exit(1);
    }
    written += bytes;
    return count;
}

#define fwrite compare
#define main play
#include "fuzz/replay.c"
#undef main
#undef fwrite

static void read_expected(const char *path)
{
    FILE *file = fopen(path, "rb");

    if ((file == NULL) || (fseek(file, 0L, SEEK_END) != 0)) {
        exit(2);
    }
    expected_bytes = (size_t)ftell(file);
    expected = malloc(expected_bytes);
    rewind(file);
    if ((expected == NULL) || (fread(expected, expected_bytes, 1, file) != 1)) {
        exit(2);
    }
    (void)fclose(file);
}

int main(int count, char **arguments)
{
    int i;

    read_expected(arguments[3]);
    for (i = 4; i < count; i++) {
        const pid_t child = fork();
        int status = 1;

        if (child == 0) {
            mutant_number = atoi(arguments[i]);
            _exit(play(3, arguments));
        }
        if ((child < 0) || (waitpid(child, &status, 0) != child)) {
            return 2;
        }
        if (status == 0) {
            printf("%s\n", arguments[i]);
        }
    }
    return 0;
}
