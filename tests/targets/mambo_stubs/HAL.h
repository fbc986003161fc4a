/* Stub of the toolbox: what its estimator would find in the sensors, and what its loops would fly. */
#ifndef HAL_H
#define HAL_H

#ifndef REFERENCE_NUMBERS
#define REFERENCE_NUMBERS 4
#endif

typedef struct {
    float estimate[12]; /* X Y Z yaw pitch roll dx dy dz p q r */
    float reference[REFERENCE_NUMBERS];
    float thrust;
} HAL_acquisition_t;

typedef struct {
    float pitch;
    float roll;
    float status;
    float refused;
    float thrust;
    float has_taken_over;
} HAL_command_t;

#endif
