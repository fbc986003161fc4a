#include "board.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console.h"
#include "crtp.h"
#include "deck.h"
#include "estimator.h"
#include "eventtrigger.h"
#include "mem.h"
#include "motors.h"
#include "peer_localization.h"
#include "platform.h"
#include "pm.h"
#include "queue.h"
#include "semphr.h"
#include "sensors.h"
#include "task.h"

#define PORTS 16
#define PACKETS 8
#define CONSOLE_BYTES 20000

/* Motors: the battery is ideal, so that a motor gives the thrust that the firmware wants. */

static uint16_t ratios[NBR_OF_MOTORS];

void motorsInit(const MotorPerifDef **mapping) { (void)mapping; }
bool motorsTest(void) { return true; }
void motorsResetESCs(void) {}
void motorsStop(void) { memset(ratios, 0, sizeof ratios); }
void motorsSetRatio(uint32_t motor, uint16_t ratio) { ratios[motor] = ratio; }
uint16_t motorsGetRatio(uint32_t motor) { return ratios[motor]; }

float motorsCompensateBatteryVoltage(uint32_t motor, float thrust, float supply_v)
{
    (void)motor;
    (void)supply_v;
    return thrust;
}

float pmGetBatteryVoltage(void) { return 4.0f; }
const MotorPerifDef **platformConfigGetMotorMapping(void) { return NULL; }

void board_thrusts(double thrusts[4])
{
    for (int k = 0; k < NBR_OF_MOTORS; k++) {
        thrusts[k] = ratios[k] / (double)UINT16_MAX;
    }
}

/* Sensors. */

static sensorData_t measured;
static SemaphoreHandle_t is_measured;

void board_measure(const double rates_deg_s[3], const double force_g[3])
{
    for (int k = 0; k < 3; k++) {
        measured.gyro.axis[k] = (float)rates_deg_s[k];
        measured.acc.axis[k] = (float)force_g[k];
    }
}

void board_wake_stabilizer(void) { xSemaphoreGive(is_measured); }

void sensorsInit(void) { is_measured = xSemaphoreCreateBinary(); }
bool sensorsTest(void) { return true; }
bool sensorsAreCalibrated(void) { return true; }
bool isSensorsSuspended(void) { return false; }
void sensorsWaitDataReady(void) { xSemaphoreTake(is_measured, portMAX_DELAY); }

void sensorsAcquire(sensorData_t *sensors)
{
    const measurement_t rates = { .type = MeasurementTypeGyroscope, .data.gyroscope.gyro = measured.gyro };
    const measurement_t force = { .type = MeasurementTypeAcceleration, .data.acceleration.acc = measured.acc };

    *sensors = measured;
    estimatorEnqueue(&rates);
    estimatorEnqueue(&force);
}

/* Radio: a packet goes to the function that asked for those of its port, or into the queue of a task. */

static CrtpCallback callbacks[PORTS];
static StaticQueue_t queues[PORTS];
static CRTPPacket waiting[PORTS][PACKETS];

void crtpInit(void) {}
void crtpRegisterPortCB(int port, CrtpCallback callback) { callbacks[port] = callback; }

void crtpInitTaskQueue(CRTPPort port)
{
    xQueueCreateStatic(PACKETS, sizeof(CRTPPacket), (uint8_t *)waiting[port], &queues[port]);
}

int crtpReceivePacketBlock(CRTPPort port, CRTPPacket *packet) { return xQueueReceive(&queues[port], packet, portMAX_DELAY); }

int crtpSendPacketBlock(CRTPPacket *packet)
{
    (void)packet;
    return 0;
}

void board_receive(int port, int channel, const uint8_t *data, int bytes)
{
    CRTPPacket packet = { .size = (uint8_t)bytes };

    ASSERT((bytes > 0) && (bytes <= CRTP_MAX_DATA_SIZE));
    packet.port = (uint8_t)port;
    packet.channel = (uint8_t)channel;
    memcpy(packet.data, data, (size_t)bytes);
    if (callbacks[port] != NULL) {
        callbacks[port](&packet);
    } else {
        ASSERT(xQueueSend(&queues[port], &packet, 0) == pdTRUE);
    }
}

/* Console. */

static char console[CONSOLE_BYTES];

int consolePrintf(const char *format, ...)
{
    const size_t used = strlen(console);
    va_list arguments;
    int length;

    va_start(arguments, format);
    length = vsnprintf(&console[used], sizeof console - used, format, arguments);
    va_end(arguments);
    return length;
}

const char *board_console(void) { return console; }

void assertFail(char *condition, char *file, int line)
{
    fprintf(stderr, "%s:%d: the firmware asserts %s\n", file, line, condition);
    abort();
}

/* What the desk has not. */

void systemWaitStart(void) {}
bool healthShallWeRunTest(void) { return false; }
void healthRunTests(sensorData_t *sensors) { (void)sensors; }
void memoryRegisterHandler(const MemoryHandlerDef_t *handler) { (void)handler; }
void eventTrigger(const eventtrigger *event) { (void)event; }
bool deckGetRequiredKalmanEstimatorAttitudeReversionOff(void) { return false; }
bool crtpSupervisorIsEmergencyStopRequested(void) { return false; }
uint32_t crtpSupervisorGetEmergencyStopWatchdogNotificationTick(void) { return 0; }

peerLocalizationOtherPosition_t *peerLocalizationGetPositionByIdx(uint8_t number)
{
    static peerLocalizationOtherPosition_t nobody;

    (void)number;
    return &nobody;
}
