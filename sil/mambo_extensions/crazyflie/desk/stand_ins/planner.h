/* In the place of the firmware's header: the states of a planner. */
#ifndef PLANNER_H
#define PLANNER_H

enum trajectory_state {
    TRAJECTORY_STATE_IDLE = 0,
    TRAJECTORY_STATE_FLYING = 1,
    TRAJECTORY_STATE_LANDING = 3,
    TRAJECTORY_STATE_DISABLED = 4
};

#endif
