/* The board around the firmware's modules: motors, sensors, radio, console. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/* Give the sensors their next measurement. */
void board_measure(const double rates_deg_s[3], const double force_g[3]);

/* Let the stabilizer task run once. */
void board_wake_stabilizer(void);

/* Write what the motors are told, as shares of the largest thrust. */
void board_thrusts(double thrusts[4]);

void board_receive(int port, int channel, const uint8_t *data, int bytes);

const char *board_console(void);

#endif
