/* SPDX-License-Identifier: MIT-0
 *
 * What Python and the engine exchange. cffi reads this file as the C compiler does, behind columns.h, which Python
 * writes. Every member is 8 bytes wide,
 * so that the records have the same layout in both; lanes.h has real_t and whole_t. Units are in the names; frames and
 * signs are as in the Python modules that the names of the headers repeat.
 */

/* What the flights of a simulation have in common. Pairs are in the order roll, pitch. */
typedef struct {
    int64_t flights;
    int64_t updates;          /* of the position controller */
    int64_t ticks_per_update;
    int64_t first_tick;       /* on the trajectory's clock: negative for a take-off */
    int64_t open_loop_updates;  /* updates with the constant thrust of a take-off */
    int64_t disturbed;        /* whether any flight has gusts, payload, push, impulse, battery sag or ground
                               * effect */
    int64_t windy;            /* whether any flight has gusts */
    int64_t dropping;         /* whether any flight drops updates */
    int64_t sensed;           /* whether controllers receive estimates */
    int64_t captured;         /* whether these come from motion capture */
    int64_t drifting;         /* whether from a filter whose estimates drift */
    int64_t derotated;        /* whether the gyro's rotation is subtracted from the optical flow */
    int64_t near_ground;      /* whether any flight has ground effect */
    int64_t landing;          /* whether the ground carries any drone */
    int64_t commands_thrust;  /* whether the controllers command the thrust */
    int64_t seen_beside;      /* whether any drone is seen at another place than its controller was told */
    int64_t target_columns;   /* of a row of targets: TARGET_COLUMNS if courses have heights */

    double step_s;            /* a tick */
    double gravity_m_s2;
    double lost_m;
    double height_reference_m;
    double rotor_height_m;    /* above the feet */

    double gust_across[2];    /* gains of the states a and b of the gust across the wind */

    int64_t attitude;         /* the kind of attitude loop, see vehicle.h; only its members are in use */

    /* Stock loop. */
    double attitude_p_n_m[2];
    double attitude_i_n_m_s[2];
    double attitude_d_n_m_s[2];
    double integral_limit_rad_s;
    double integral_leak_1_s;
    double yaw_p_n_m;
    double yaw_d_n_m_s;

    /* Cascade: of roll, pitch and yaw P, I, D and limit of the angle, then of the rate. */
    double cascade[3][8];
    double rate_max_rad_s;
    double output_max;

    /* First order: shares that remain at the later nodes and at the end of a tick, see first_order.py. */
    double response_gain[2];
    double response_lag_s[2];
    int64_t late_ticks[2];
    double decay_before[2][3];
    double decay_after[2][3];
    double yaw_lag_s;
    double yaw_decay[3];
    double acceleration_per_tilt_g;
    double trim_rad[2];
    int64_t thrust_lags;      /* whether the thrust has a response of its own */
    double thrust_gain;
    int64_t thrust_late_ticks;
    double thrust_decay_before[3];
    double thrust_decay_after[3];

    /* Altitude loop. */
    double altitude_p_n_m;
    double altitude_d_n_s_m;
    double weight_n;
    double thrust_limit_n;
    int64_t altitude_law;     /* see vehicle.h; the members below are in use with FEEDFORWARD and PID */
    double altitude_i_n_m_s;
    double altitude_mass_kg;
    double least_level;       /* cosine of the tilt */
    double integrated_error_m;
    double integral_limit_n;
    double take_off_thrust_n;
    double capped_n;          /* a larger difference of thrusts is reported to the controller */

    /* Mixer: the wrench that one unit of command of all rotors gives. */
    double wrench_per_command[4];
    double nominal_mass_kg;
    double rotor_offset_m;
    double speed_squared_per_command_rad2_s2;
    double command_min;
    double command_max;
    int64_t mixer;            /* what gives way at command_max, see vehicle.h */
    double least_yaw;         /* command that YAW_LAST keeps for yaw in any case */

    /* Instruments. */
    double imu_transition[4]; /* by rows */
    double imu_input_gain[2];
    double imu_limits[6];
    double sonar_min_m;
    double pa_per_m;
    double flow_coupling;
    int64_t flow_images;      /* in flow_ticks ticks */
    int64_t flow_ticks;

    /* Estimators. */
    double accelerometer_taps[6];
    double tilt_weight;
    double tilt_gate;
    double altitude_gains[2];
    double low_pass_a[3];
    double low_pass_b;
    double sonar_jump_m;
    double pressure_jump_m;
    double slow_jump_m;
    double velocity_gain;
    double acceleration_gain;
    double flow_tilt_rad;
    double flow_rate_rad_s;
    double flow_slow_rad_s;
    double flow_jump_m_s;
    double flow_min_height_m;

    /* Motion capture. */
    int64_t mocap_period_ticks;
    int64_t mocap_delay_ticks;
    double mocap_period_s;
    double mocap_share;
    int64_t mocap_beside;     /* whether the measured place is another than the centre of mass */
    double mocap_lever_m[3];

    /* Estimates that drift. */
    double drift_keep;
    double drift_corrected_s[3];
} engine_simulation_t;

/* A group of flights, one in each lane; with one lane one flight. Rows of body_start are those of a state of the rigid
 * body. */
typedef struct {
    real_t body_start[12];
    real_t rotor_start_rad_s[4];
    real_t thrust_start_n;    /* the steady demand before the start, of a drone without rotors */
    real_t yaw_rad;
    real_t yaw_rate_rad_s;
    whole_t landing;          /* all bits if the ground carries the drone, else 0 */

    real_t mass_kg;
    real_t inertia_kg_m2[3];
    real_t thrust_factor_n_s2;
    real_t torque_per_thrust_m;
    real_t rotor_decay[4];    /* at the nodes and at the end of a tick */
    real_t drag_1_s;
    real_t push_m_s2[2]; /* added by `derivative` of rigid_body.h, or `advance` of first_order.h */

    real_t gust_mean_m_s;
    real_t gust_sigma_m_s;
    real_t gust_heading[2];   /* cosine and sine */
    real_t gust_decay;
    real_t gust_x;
    real_t gust_roots[3];     /* Cholesky factor: aa, ab, bb */

    real_t battery_sag_1_s;
    real_t payload_kg;
    whole_t payload_tick;     /* on the trajectory's clock */
    real_t impulse_n_s[3];
    whole_t impulse_tick;        /* on the trajectory's clock */
    real_t vertical_gust_m_s2;
    whole_t vertical_gust_tick; /* on the trajectory's clock */
    real_t ground_effect_radius_m;

    whole_t delay_ticks;
    real_t dropped_share;

    real_t noise[8];          /* standard deviations: accelerometer, gyro, sonar, pressure; position, angles; velocity */
    real_t bias[6];           /* accelerometer, gyro */
    real_t lever_error_m[3];  /* in the body, from where the controller takes what measures to be */
} engine_flight_t;

/* Random numbers of a group, for each lane a row for each tick: sensors (lanes, ticks, 8, 6 or 3), gusts
 * (lanes, 1 + ticks, 3) with a first row for their start, and drops (lanes, updates). NULL where the simulation needs
 * none. */
typedef struct {
    const double *sensors;
    const double *gusts;
    const double *drops;
} engine_draws_t;

/* Arrays of a trace, (flights, updates, axes). Without sensors the last three are NULL. */
typedef struct {
    double *position_m;
    double *velocity_m_s;
    double *euler_rad;
    double *command_rad;
    double *thrust_acceleration_m_s2;
    int64_t *status;
    double *seen_position_m;
    double *seen_velocity_m_s;
    double *seen_euler_rad;
} engine_trace_t;

/* A position controller: reads a state of 7 and a target of 6 numbers, to which a course with a height adds height,
 * climb and vertical acceleration; writes roll and pitch, returns a status. One that commands the thrust reads states
 * of 10 and targets of 9 numbers; its thrust is the reported one, NaN for the commanded one, and it writes the thrust
 * over mass behind the angles. */
typedef int64_t (*engine_controller_t)(void *self, const double *state, const double *target,
                                       double thrust_acceleration_m_s2, double *command_rad);

/* The lanes of this engine. */
int64_t engine_lanes(void);

/* How many lanes are fastest with this compiler on this processor: 1, 2 or 4. */
int64_t engine_fastest_lanes(void);

/* Simulate a group of flights from start to end, with their rows of `targets` (flights, updates, target_columns), and
 * write their rows of the trace. The first flight has index `index` and the controller `self`; the controllers lie `stride` bytes
 * apart. A lane beyond the last flight of the simulation has no controller and no rows. */
void engine_fly(const engine_simulation_t *simulation, const engine_flight_t *flight, int64_t index,
                const double *times_s, const double *targets, const engine_draws_t *draws,
                engine_controller_t controller, void *self, int64_t stride, const engine_trace_t *trace);

/* How a trace is evaluated: see sil/mambo_sil/flight/engine/evaluate.py. */
typedef struct {
    int64_t flights;
    int64_t updates;
    int64_t first_update;     /* at t >= 0: metrics and crashes count from there */
    int64_t not_called;       /* the status of an update for which the controller was not called */
    double limit_rad;         /* a command of this size is saturated */
    double least_level;       /* cosine of the tilt beyond which a drone has crashed */
    double low_target_m;      /* on the ground a drone has crashed if its target is higher */
} engine_evaluation_t;

/* Of each flight: whether it crashed, its refused updates and saturated commands, and its metrics (flights, 13) as
 * flown and, with sensors, as seen. */
typedef struct {
    int64_t *crashed;
    int64_t *refused;
    int64_t *saturated;
    double *metrics;
    double *seen_metrics;
} engine_results_t;

/* Evaluate a group of flights with their targets (flights, updates, 3), x, y and height; the first has index `index`. */
void engine_evaluate(const engine_evaluation_t *evaluation, int64_t index, const double *times_s,
                     const double *targets, const engine_trace_t *trace, const engine_results_t *results);

/* The stock PD position controller; it has no state. Its constants: see engine_pd_t. */
typedef struct {
    double position_p_rad_m;
    double position_d_rad_s_m;
    double error_limit_m;
} engine_pd_t;

int64_t engine_pd_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                       double *command_rad);

/* The PD with feed-forward: PdFeedForwardController. */
typedef struct {
    double position_rad_m;
    double velocity_rad_s_m;
    double acceleration_rad_s2_m;
    double tilt_limit_rad;
} engine_pd_feedforward_t;

int64_t engine_pd_feedforward_step(void *self, const double *state, const double *target,
                                   double thrust_acceleration_m_s2, double *command_rad);

/* The PID with feed-forward: PidFeedForwardController. */
typedef struct {
    double position_rad_m;
    double velocity_rad_s_m;
    double acceleration_rad_s2_m;
    double jerk_rad_s3_m;
    double integral_rad_m_s;
    double tilt_feedback;
    double low_pass_share;
    double update_period_s;
    double gravity_m_s2;
    double integral_limit_rad;
    double integrated_error_m;
    double jerk_limit_m_s3;
    double tilt_limit_rad;

    double acceleration_m_s2[2]; /* of the target at the last update; initially NaN */
    double integral_rad[2];
    double tilt_rad[2];          /* behind the low-pass */
} engine_pid_feedforward_t;

int64_t engine_pid_feedforward_step(void *self, const double *state, const double *target,
                                    double thrust_acceleration_m_s2, double *command_rad);

/* A controller with a fault: sil/mambo_sil/experiment/faults/fault.py. Initially update is 0. */
typedef struct {
    engine_controller_t controller;
    void *self;
    int64_t states;           /* numbers of a state, of a target, and of a command */
    int64_t targets;
    int64_t commands;
    int64_t effect;
    double values[STATE_COLUMNS];
    int64_t columns[2];
    int64_t on;
    int64_t of;
    int64_t begin;            /* update */
    int64_t end;              /* update */
    int64_t drop_every;
    int64_t late_updates;
    char *memory;             /* of the controller, which a dropped update leaves as it is; NULL if it has none */
    char *saved;              /* as long as memory */
    int64_t memory_bytes;
    double *computed;         /* (late_updates + 1, COMMAND_COLUMNS): the last commands, at the remainder of their update */
    double began[STATE_COLUMNS];         /* state at the onset */
    int64_t update;
} engine_faulty_t;

int64_t engine_faulty_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                           double *command_rad);

/* nmpc_host_reset or nmpc_host_set_weights of a generated controller. */
typedef void (*engine_setter_t)(void *controllers, int n, const void *values, int *status);

/* A caller that commands hover after `patience` rejected steps: LevellingCaller. */
typedef struct {
    engine_controller_t controller;
    void *self;
    engine_setter_t reset;
    void *memory;             /* of the generated controller */
    const void *level;        /* zero tilt, and the thrust of hover if it has one, in its numbers */
    double hover[COMMAND_COLUMNS];
    int64_t commands;         /* numbers of a command */
    int64_t patience;
    int64_t refused;
} engine_levelling_t;

int64_t engine_levelling_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                              double *command_rad);

/* Weights or limits in the numbers of a generated controller, and the status with which it answers. */
typedef struct {
    int64_t update;
    engine_setter_t set;
    const void *values;
    int64_t *status;
} engine_adjustment_t;

/* A generated controller whose weights or limits change: AdjustedController. */
typedef struct {
    engine_controller_t controller;
    void *memory;
    const engine_adjustment_t *adjustments;
    int64_t count;
    int64_t update;
} engine_adjusted_t;

int64_t engine_adjusted_step(void *self, const double *state, const double *target, double thrust_acceleration_m_s2,
                             double *command_rad);
