/* Stub of the Crazyflie's firmware: the members that an out-of-tree controller reads or writes, and their types. */
#ifndef STABILIZER_TYPES_H
#define STABILIZER_TYPES_H

#include <stdbool.h>
#include <stdint.h>

typedef uint32_t stabilizerStep_t;

typedef struct {
    uint32_t timestamp;
    float roll;
    float pitch;
    float yaw;
} attitude_t;

typedef struct {
    uint32_t timestamp;
    float x;
    float y;
    float z;
} vector_t;

typedef struct {
    float x;
    float y;
    float z;
    float w;
} quaternion_t;

typedef struct {
    vector_t gyro; /* degrees per second */
    vector_t acc;  /* g */
} sensorData_t;

typedef struct {
    attitude_t attitude; /* degrees, pitch nose up */
    quaternion_t attitudeQuaternion;
    vector_t position;
    vector_t velocity;
} state_t;

typedef enum {
    controlModeLegacy = 0,
    controlModeForceTorque
} control_mode_t;

typedef struct {
    float roll;
    float pitch;
    float yaw;
    float thrust;
    control_mode_t controlMode;
} control_t;

typedef enum {
    modeDisable = 0,
    modeAbs,
    modeVelocity
} stab_mode_t;

typedef struct {
    stab_mode_t x;
    stab_mode_t y;
    stab_mode_t z;
    stab_mode_t roll;
    stab_mode_t pitch;
    stab_mode_t yaw;
    stab_mode_t quat;
} setpoint_mode_t;

typedef struct {
    uint32_t timestamp;
    attitude_t attitude;
    attitude_t attitudeRate;
    quaternion_t attitudeQuaternion;
    float thrust;
    vector_t position;
    vector_t velocity;
    vector_t acceleration;
    vector_t jerk;
    bool velocity_body;
    setpoint_mode_t mode;
} setpoint_t;

#endif
