#ifndef PM_H
#define PM_H

float pmGetBatteryVoltage(void);

#endif
