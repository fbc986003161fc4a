/* Stub of the Crazyflie's firmware: the most thrust of its motors. */
#ifndef POWER_DISTRIBUTION_H
#define POWER_DISTRIBUTION_H

float powerDistributionGetMaxThrust(void); /* N, of all four */

#endif
