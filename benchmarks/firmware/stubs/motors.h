#ifndef MOTORS_H
#define MOTORS_H

#include <stdbool.h>
#include <stdint.h>

#define NBR_OF_MOTORS 4
#define MOTOR_M1 0
#define MOTOR_M2 1
#define MOTOR_M3 2
#define MOTOR_M4 3

typedef struct { int unused; } MotorPerifDef;

void motorsInit(const MotorPerifDef **mapping);
bool motorsTest(void);
void motorsResetESCs(void);
void motorsStop(void);
void motorsSetRatio(uint32_t motor, uint16_t ratio);
uint16_t motorsGetRatio(uint32_t motor);
float motorsCompensateBatteryVoltage(uint32_t motor, float thrust, float supply_v);

#endif
