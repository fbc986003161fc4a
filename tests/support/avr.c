/* Runs the self-test and two frozen episodes on an ATmega2560, and prints the first difference, the digest in
 * hexadecimal and `>` over the first serial port. */
#include <avr/io.h>

#include "nmpc_self_test.h"

static nmpc_t scratch;

static void put(char character)
{
    while ((UCSR0A & (1 << UDRE0)) == 0) {
    }
    UDR0 = (unsigned char)character;
}

int main(void)
{
    unsigned long digest = 0UL;
    int result;
    int power;
    int i;

    UCSR0B = 1 << TXEN0;
    result = nmpc_self_test(&scratch);
    for (power = 1000; power > 0; power /= 10) {
        put((char)('0' + ((result / power) % 10)));
    }
    for (i = 0; i < 2; i++) {
        digest = nmpc_self_test_episode(&scratch, i, digest);
    }
    put(' ');
    for (i = 28; i >= 0; i -= 4) {
        put("0123456789ABCDEF"[(digest >> i) & 15U]);
    }
    put('>');
    for (;;) {
    }
}
