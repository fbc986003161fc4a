/* The part of the firmware around an out-of-tree controller: it keeps what the PID controller was given to fly. */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "controller.h"
#include "controller_pid.h"
#include "crtp_commander_high_level.h"
#include "debug.h"
#include "log.h"
#include "power_distribution.h"
#include "supervisor.h"
#include "task.h"
#include "worker.h"

setpoint_t host_flown;
int host_pid_calls;
char host_console[1000];
uint32_t host_time_ms;
bool host_is_flying;
float host_variances[6]; /* of the Kalman filter: position and velocity along x, height, roll, pitch, yaw */
bool host_has_variances = true;
int host_scheduled; /* functions that the worker was given */

void controllerPidInit(void) {}
bool controllerPidTest(void) { return true; }

void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                   const stabilizerStep_t step)
{
    (void)control;
    (void)sensors;
    (void)state;
    (void)step;
    host_flown = *setpoint;
    host_pid_calls++;
}

uint32_t xTaskGetTickCount(void) { return host_time_ms; }
bool supervisorIsFlying(void) { return host_is_flying; }
enum trajectory_state crtpCommanderHighLevelGetPlannerState(void) { return TRAJECTORY_STATE_FLYING; }

int workerSchedule(void (*function)(void *), void *argument)
{
    host_scheduled++;
    function(argument);
    return 0;
}

float powerDistributionGetMaxThrust(void) { return 0.48f; }

logVarId_t logGetVarId(const char *group, const char *name)
{
    static const char *const names[] = { "varX", "varPX", "varZ", "varD0", "varD1", "varD2" };
    uint16_t k;

    for (k = 0; k < 6; k++) {
        if (host_has_variances && (strcmp(group, "kalman") == 0) && (strcmp(name, names[k]) == 0)) {
            return k;
        }
    }
    return 0xffffU;
}

void *logGetAddress(logVarId_t id) { return &host_variances[id]; }

int consolePrintf(const char *format, ...)
{
    const size_t used = strlen(host_console);
    va_list arguments;
    int length;

    va_start(arguments, format);
    length = vsnprintf(&host_console[used], sizeof host_console - used, format, arguments);
    va_end(arguments);
    return length;
}

const struct variable *host_find(const struct variable *table, const char *name)
{
    const struct variable *found;

    for (found = &table[1]; found->type != 0; found++) {
        if (strcmp(found->name, name) == 0) {
            return found;
        }
    }
    return 0;
}
