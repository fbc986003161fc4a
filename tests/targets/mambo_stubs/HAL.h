/* Stub of the toolbox: what its estimator would find in the sensors, and what its loops would fly. */
#ifndef HAL_H
#define HAL_H

typedef struct {
    float estimate[12]; /* X Y Z yaw pitch roll dx dy dz p q r */
    float reference[4];
    float thrust;
} HAL_acquisition_t;

typedef struct {
    float pitch;
    float roll;
    float status;
    float refused;
} HAL_command_t;

#endif
