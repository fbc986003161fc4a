/* In the place of the firmware's header: what the high-level commander plans. */
#ifndef CRTP_COMMANDER_HIGH_LEVEL_H
#define CRTP_COMMANDER_HIGH_LEVEL_H

#include "planner.h"

enum trajectory_state crtpCommanderHighLevelGetPlannerState(void);

#endif
