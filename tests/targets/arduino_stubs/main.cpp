/* Run a sketch for ten seconds of its own time. */
#include "Arduino.h"

void setup();
void loop();

Printer Serial;
static unsigned long now_us;

unsigned long micros()
{
    now_us += 100UL;
    return now_us;
}

int main()
{
    setup();
    while (now_us < 10000000UL) {
        loop();
    }
    return 0;
}
