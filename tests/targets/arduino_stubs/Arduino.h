/* Stub of an Arduino core for this machine: time passes by calls of micros(), and Serial prints to stdout. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <cstdio>

unsigned long micros();

struct Printer {
    void begin(unsigned long) {}
    void print(const char *text) { std::fputs(text, stdout); }
    void print(unsigned long number) { std::printf("%lu", number); }
    void print(double number, int digits) { std::printf("%.*f", digits, number); }
    void println(const char *text) { std::puts(text); }
    void println(int number) { std::printf("%d\n", number); }
};

extern Printer Serial;

#endif
