/* Runs the self-test of a bundle whose nmpc.c has many broken lines, of which `mutant_number` chooses one, 0 none. Arguments:
 * numbers of broken lines. Prints a line for each: its number and 1 if the start-up test notices it, else 2 if the digest of
 * all episodes does, else 0; a broken line that crashes or does not end is noticed too. The program itself ends with such
 * a number, for the C with broken line 0. */
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "nmpc_self_test.h"

extern int mutant_number;
int mutant_number;

/* Digests of the C as it is, up to each episode. */
static unsigned long right[NMPC_SELF_TEST_EPISODES];

static int notices(void)
{
    static nmpc_t self;
    unsigned long digest = 0UL;
    int episode;

    if (nmpc_self_test(&self) != 0) {
        return 1;
    }
    for (episode = 0; episode < NMPC_SELF_TEST_EPISODES; episode++) {
        digest = nmpc_self_test_episode(&self, episode, digest);
        if (digest != right[episode]) {
            return 2;
        }
    }
    return 0;
}

int main(int count, char **arguments)
{
    static nmpc_t self;
    struct rlimit limit;
    unsigned long digest = 0UL;
    int episode;
    int i;

    if (nmpc_self_test(&self) != 0) {
        return 1;
    }
    for (episode = 0; episode < NMPC_SELF_TEST_EPISODES; episode++) {
        digest = nmpc_self_test_episode(&self, episode, digest);
        right[episode] = digest;
    }
    if (digest != NMPC_SELF_TEST_DIGEST) {
        return 2;
    }
    limit.rlim_cur = limit.rlim_max = 2 + (3 * (rlim_t)(clock() / CLOCKS_PER_SEC));
    for (i = 1; i < count; i++) {
        const pid_t child = fork();
        int status = 0;

        if (child == 0) {
            (void)setrlimit(RLIMIT_CPU, &limit);
            mutant_number = atoi(arguments[i]);
            _exit(notices());
        }
        if ((child < 0) || (waitpid(child, &status, 0) != child)) {
            return 2;
        }
        printf("%s %d\n", arguments[i], WIFEXITED(status) ? WEXITSTATUS(status) : 1);
    }
    return 0;
}
