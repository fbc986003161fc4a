/* Runs the self-test on an ATmega2560 and prints its result and `>` over the first serial port. */
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
    int result;
    int power;

    UCSR0B = 1 << TXEN0;
    result = nmpc_self_test(&scratch);
    for (power = 1000; power > 0; power /= 10) {
        put((char)('0' + ((result / power) % 10)));
    }
    put('>');
    for (;;) {
    }
}
