// PX4 on the desk of the Crazyflie: commander, land detector, hover thrust and topics around the module, which takes the place
// of the Crazyflie's app. Position mode is the desk's own controller on the desk's set-points; hold stays where it began.
//
// Frames: the desk has x forward, y left, z up, and degrees; PX4 has north, east, down, and rad.
#include <mc_nmpc/all.hpp>

extern "C" {
#include "controller.h"
#include "controller_pid.h"
#include "desk.h"
#include "log.h"
#include "supervisor.h"
#include "task.h"
}

extern "C" int mc_nmpc_main(int argc, char *argv[]);

#define DEFINE(name) static name##_s data_##name; Topic topic_##name {&data_##name, sizeof data_##name, 0, nullptr};
TOPICS(DEFINE)
static vehicle_control_mode_s data_config_control_setpoints;
Topic topic_config_control_setpoints{&data_config_control_setpoints, sizeof data_config_control_setpoints, 0, nullptr};

static constexpr float DEG = 57.29577951f;
static constexpr float FULL = 65535.f;
static constexpr uint8_t MPC = vehicle_status_s::NAVIGATION_STATE_EXTERNAL1;
static constexpr uint8_t POSITION = vehicle_status_s::NAVIGATION_STATE_POSCTL;

float stored_parameters[static_cast<int>(px4::params::COUNT)];
Parameter *first_parameter;

// What the pilot of the desk sets
static uint8_t wanted_mode = POSITION, estimate_ms = 10, is_silent, is_invalid, has_sticks, has_trajectory, slow_ms, stops, is_indoors, flies_rates;
static float hover = 0.6f, strength = 1.f, sticks[4], jump[3], jump_velocity[3], jump_heading, roll_error, setpoint_x;

// What they find
static uint8_t nav_state = POSITION, can_run;
static uint32_t heard; // attitude set-points, by PX4's attitude controller
static float roll_setpoint, pitch_setpoint, yaw_setpoint, throttle; // rad, share
static float offset[3], offset_velocity[3], offset_heading;         // of the estimator's frame, in PX4's
static float unseen[3];                                             // roll, pitch, yaw that the drone's estimator does not see, rad
static hrt_abstime delay; // what steps that take long have cost
static setpoint_t hold;
static uORB::Subscription attitude_setpoint{&topic_vehicle_attitude_setpoint};

static void *const PARAMETERS = stored_parameters;

#define FLOAT(name, place) { "float", name, place },
#define BYTE(name, place) { "uint8_t", name, place },
extern "C" const struct variable host_parameters[] = {
	{ "group", "px4", nullptr },
	BYTE("mode", &wanted_mode) BYTE("estimate_ms", &estimate_ms) BYTE("silent", &is_silent) BYTE("invalid", &is_invalid)
	BYTE("sticks", &has_sticks) BYTE("trajectory", &has_trajectory) BYTE("slow_ms", &slow_ms) BYTE("stop", &stops) BYTE("indoors", &is_indoors)
	BYTE("rates", &flies_rates)
	FLOAT("hover", &hover) FLOAT("strength", &strength) FLOAT("roll", &sticks[0]) FLOAT("pitch", &sticks[1]) FLOAT("yaw", &sticks[2]) FLOAT("throttle", &sticks[3])
	FLOAT("jump_x", &jump[0]) FLOAT("jump_y", &jump[1]) FLOAT("jump_z", &jump[2]) FLOAT("jump_heading", &jump_heading) FLOAT("roll_error", &roll_error)
	FLOAT("setpoint_x", &setpoint_x) FLOAT("jump_vx", &jump_velocity[0]) FLOAT("jump_vy", &jump_velocity[1]) FLOAT("jump_vz", &jump_velocity[2])
	FLOAT("SPEED", &stored_parameters[0]) FLOAT("BRAKE", &stored_parameters[1]) FLOAT("TILT", &stored_parameters[2])
	FLOAT("CLIMB", &stored_parameters[3]) FLOAT("DESCENT", &stored_parameters[4]) FLOAT("X_MIN", &stored_parameters[5])
	FLOAT("X_MAX", &stored_parameters[6]) FLOAT("Z_MIN", &stored_parameters[9]) FLOAT("Z_MAX", &stored_parameters[10])
	{ nullptr, "px4", nullptr }
};
extern "C" const struct variable host_logged[] = {
	{ "group", "px4", nullptr },
	BYTE("mode", &nav_state) BYTE("can_run", &can_run) FLOAT("roll", &roll_setpoint) FLOAT("pitch", &pitch_setpoint)
	FLOAT("yaw", &yaw_setpoint) FLOAT("throttle", &throttle) BYTE("attitude_only", &data_config_control_setpoints.flag_control_attitude_enabled)
	BYTE("position_controlled", &data_config_control_setpoints.flag_multicopter_position_control_enabled)
	BYTE("landed", &data_vehicle_land_detected.landed) BYTE("contact", &data_vehicle_land_detected.ground_contact) { "uint32_t", "heard", &heard },
	{ "uint32_t", "commands", &topic_vehicle_command.generation },
	{ "uint32_t", "statuses", &topic_mc_nmpc_status.generation }, { "uint32_t", "left", &topic_unregister_ext_component.generation },
	STATUS_FIELDS
	{ nullptr, "px4", nullptr }
};

static hrt_abstime now() { return 1000ULL * xTaskGetTickCount() + delay; }
hrt_abstime hrt_absolute_time() { delay += 1000 * slow_ms; return now(); }

uORB::PublicationBase::~PublicationBase()
{
	if (_advertises) { _topic->is_advertised = false; }
}

void uORB::PublicationBase::publish(const void *message)
{
	if (!_advertises) { _advertises = _topic->is_advertised = true; }

	memcpy(_topic->data, message, _topic->size);
	_topic->generation++;

	if (_topic->waits != nullptr) { _topic->waits->ScheduleNow(); }
}

template <class T> static void publish(Topic &topic, T &message)
{
	static uORB::Publication<T> publication{&topic}; // of one topic

	message.timestamp = now();
	publication.publish(message);
}

static bool is_due(uint32_t period_ms) { return (xTaskGetTickCount() % period_ms) == 0; }

static void command()
{
	static unsigned obeyed, registered;
	static uint8_t last_wanted = POSITION, intention = POSITION;

	if (registered != topic_register_ext_component_request.generation) {
		registered = topic_register_ext_component_request.generation;
		data_register_ext_component_reply.request_id = data_register_ext_component_request.request_id;
		data_register_ext_component_reply.success = data_register_ext_component_request.register_mode;
		data_register_ext_component_reply.mode_id = MPC;
		data_register_ext_component_reply.arming_check_id = 1;
		publish(topic_register_ext_component_reply, data_register_ext_component_reply);
	}

	can_run = data_arming_check_reply.can_arm_and_run;

	if (is_due(300)) {
		data_arming_check_request.request_id++;
		publish(topic_arming_check_request, data_arming_check_request);
	}

	if (wanted_mode != last_wanted) { // the pilot's switch
		last_wanted = wanted_mode;
		intention = (wanted_mode != MPC || can_run || !supervisorIsFlying()) ? wanted_mode : intention;
	}

	if (obeyed != topic_vehicle_command.generation) {
		obeyed = topic_vehicle_command.generation;
		const uint8_t asked = static_cast<uint8_t>(data_vehicle_command.param1);

		const bool is_refused = (asked == vehicle_status_s::NAVIGATION_STATE_AUTO_LOITER) ? is_indoors // it wants a global position
					: (asked == POSITION) && !has_sticks;

		if (!is_refused) {
			intention = last_wanted = wanted_mode = asked;
		}
	}

	// where the mode cannot run PX4 flies another one, and goes back to what the pilot selected as soon as it can
	const bool is_possible = intention != MPC || can_run || !supervisorIsFlying();
	const uint8_t fallback = is_indoors ? vehicle_status_s::NAVIGATION_STATE_AUTO_LAND : vehicle_status_s::NAVIGATION_STATE_AUTO_LOITER;

	nav_state = is_possible ? intention : fallback;
	data_vehicle_status.nav_state = nav_state;
	data_vehicle_status.nav_state_user_intention = intention;
	data_vehicle_status.arming_state = supervisorIsFlying() ? vehicle_status_s::ARMING_STATE_ARMED : 1;
	data_vehicle_status.system_id = data_vehicle_status.component_id = 1;
	publish(topic_vehicle_status, data_vehicle_status);
}

// Without climb and with low thrust for a third of a second, then with the least thrust of manual flight, twice as long. PX4's own
// modes, which fly the height, must also ask for a descent, for which the desk takes that the floor is near. Defaults of
// MPC_THR_MIN, MPC_MANTHR_MIN, LNDMC_Z_VEL_MAX, LNDMC_XY_VEL_MAX and LNDMC_TRIG_TIME; no range finder.
static void detect_landing(const state_t &state)
{
	static uint32_t contact_ms, maybe_ms, landed_ms;
	vehicle_land_detected_s &land = data_vehicle_land_detected;
	const bool is_flying = supervisorIsFlying();

	const bool is_light = throttle <= 0.12f + 0.6f * (hover - 0.12f);
	const bool is_still = fabsf(state.velocity.z) < (land.maybe_landed ? 0.625f : 0.25f) && hypotf(state.velocity.x, state.velocity.y) < 1.5f;

	contact_ms = (is_light && is_still && (nav_state == MPC || state.position.z < 0.05f)) ? contact_ms + 1 : 0;
	land.ground_contact = !is_flying || contact_ms > 333;
	maybe_ms = (land.ground_contact && throttle < 0.09f) ? maybe_ms + 1 : 0;
	land.maybe_landed = !is_flying || maybe_ms > 333;
	landed_ms = land.maybe_landed ? landed_ms + 1 : 0;
	land.landed = !is_flying || landed_ms > 333;
	publish(topic_vehicle_land_detected, land);
}

// The Crazyflie's estimator takes a drone that leans against the air for level, or turned, which PX4's does not; its noise stays.
static void find_unseen(const attitude_t &attitude)
{
	const float seen[] {attitude.roll, attitude.pitch, attitude.yaw};
	desk_state_t truth;

	desk_state(&truth);

	for (int i = 0; i < 3; i++) {
		unseen[i] += 0.01f * matrix::wrap_pi(static_cast<float>(truth.angles_rad[i]) - seen[i] / DEG - unseen[i]);
	}
}

static void estimate(const state_t &state)
{
	vehicle_local_position_s &at = data_vehicle_local_position;
	const bool jumps = jump[0] != 0 || jump[1] != 0 || jump[2] != 0;
	const bool kicks = jump_velocity[0] != 0 || jump_velocity[1] != 0 || jump_velocity[2] != 0;

	if (jumps) {
		for (int i = 0; i < 3; i++) { offset[i] += jump[i]; }
		at.delta_xy[0] = jump[0]; at.delta_xy[1] = jump[1]; at.delta_z = jump[2];
		at.xy_reset_counter++; at.z_reset_counter++;
		memset(jump, 0, sizeof jump);
	}

	if (kicks) {
		for (int i = 0; i < 3; i++) { offset_velocity[i] += jump_velocity[i]; }
		at.delta_vxy[0] = jump_velocity[0]; at.delta_vxy[1] = jump_velocity[1]; at.delta_vz = jump_velocity[2];
		at.vxy_reset_counter++; at.vz_reset_counter++;
		memset(jump_velocity, 0, sizeof jump_velocity);
	}

	if (jump_heading != 0) {
		offset_heading += at.delta_heading = jump_heading;
		at.heading_reset_counter++;
		jump_heading = 0;
	}

	for (int i = 0; i < 3; i++) { offset[i] += 0.001f * estimate_ms * offset_velocity[i]; }

	at.x = state.position.x + offset[0];
	at.y = -state.position.y + offset[1];
	at.z = -state.position.z + offset[2];
	at.vx = state.velocity.x + offset_velocity[0];
	at.vy = -state.velocity.y + offset_velocity[1];
	at.vz = -state.velocity.z + offset_velocity[2];
	at.heading = matrix::wrap_pi(-state.attitude.yaw / DEG - unseen[2] + offset_heading);
	at.xy_valid = at.z_valid = at.v_xy_valid = at.v_z_valid = at.heading_good_for_control = !is_invalid;
	at.timestamp_sample = now();
	matrix::Quatf(matrix::Eulerf(state.attitude.roll / DEG + unseen[0] + roll_error, state.attitude.pitch / DEG + unseen[1], at.heading)).copyTo(data_vehicle_attitude.q);
	publish(topic_vehicle_attitude, data_vehicle_attitude);
	publish(topic_vehicle_local_position, at);
}

static void receive(const setpoint_t &setpoint)
{
	static uint32_t last;
	static float known[static_cast<int>(px4::params::COUNT)];

	if (has_sticks) {
		data_manual_control_setpoint.valid = true;
		data_manual_control_setpoint.roll = sticks[0];
		data_manual_control_setpoint.pitch = sticks[1];
		data_manual_control_setpoint.yaw = sticks[2];
		data_manual_control_setpoint.throttle = sticks[3];
		publish(topic_manual_control_setpoint, data_manual_control_setpoint);
	}

	if (has_trajectory && setpoint.timestamp != last) {
		trajectory_setpoint_s &to = data_trajectory_setpoint;

		last = setpoint.timestamp;
		to = {0, {setpoint.position.x + offset[0] + setpoint_x, -setpoint.position.y + offset[1], -setpoint.position.z + offset[2]},
			{setpoint.velocity.x, -setpoint.velocity.y, -setpoint.velocity.z},
			{setpoint.acceleration.x, -setpoint.acceleration.y, -setpoint.acceleration.z},
			matrix::wrap_pi(-2.f * atan2f(setpoint.attitudeQuaternion.z, setpoint.attitudeQuaternion.w) + offset_heading)
		};
		publish(topic_trajectory_setpoint, to);
	}

	data_hover_thrust_estimate.hover_thrust = hover;
	data_hover_thrust_estimate.valid = true;
	publish(topic_hover_thrust_estimate, data_hover_thrust_estimate);

	if (memcmp(known, PARAMETERS, sizeof known) != 0) {
		static parameter_update_s update;
		memcpy(known, PARAMETERS, sizeof known);
		publish(topic_parameter_update, update);
	}
}

static McNmpc *module() { return static_cast<McNmpc *>(McNmpc::desc.object.load()); }

// The attitude set-point of the mode, for the desk's attitude loops
static setpoint_t flown(const setpoint_t &setpoint)
{
	setpoint_t to = setpoint;
	const matrix::Quatf wanted{data_vehicle_attitude_setpoint.q_d};
	const matrix::Eulerf euler{wanted};
	// as PX4: the thrust goes where it points in the world, whatever the heading is
	const matrix::Eulerf tilt{wanted * matrix::Quatf{matrix::Eulerf{0, 0, data_vehicle_local_position.heading - euler.psi()}}};

	to.mode = {modeDisable, modeDisable, modeDisable, modeAbs, modeAbs, modeAbs, modeDisable};
	to.attitude = {setpoint.timestamp, DEG * (tilt.phi() - unseen[0]), DEG * (tilt.theta() - unseen[1]), -DEG * matrix::wrap_pi(euler.psi() - offset_heading + unseen[2])};
	to.thrust = math::min(-data_vehicle_attitude_setpoint.thrust_body[2] * strength, 1.f) * FULL;
	return to;
}

static int run_command(const char *verb)
{
	char name[] {"mc_nmpc"};
	char *arguments[] {name, const_cast<char *>(verb)};

	return mc_nmpc_main(2, arguments);
}

extern "C" bool controllerOutOfTreeTest(void)
{
	static const float defaults[] {DEFAULT_PARAMETERS};

	memcpy(stored_parameters, defaults, sizeof defaults);
	return (run_command("start") == PX4_OK) && controllerPidTest();
}

extern "C" void controllerOutOfTreeInit(void) { controllerPidInit(); }

extern "C" void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
				    const stabilizerStep_t step)
{
	const uint8_t before = nav_state;

	find_unseen(state->attitude);
	detect_landing(*state);
	receive(*setpoint);

	if (!is_silent && is_due(estimate_ms)) {
		estimate(*state);
	}

	command();

	if (module() != nullptr && stops) {
		stops = 0;
		run_command("stop");
	}

	if (module() != nullptr && module()->due <= now()) {
		module()->due = UINT64_MAX;
		static_cast<px4::ScheduledWorkItem *>(module())->Run();
	}

	if (nav_state != before) {
		hold = *setpoint;
		hold.position = state->position;
		hold.velocity = hold.acceleration = {};
		hold.attitude.yaw = state->attitude.yaw;
		hold.mode = {modeAbs, modeAbs, modeAbs, modeDisable, modeDisable, modeAbs, modeDisable};
	}

	setpoint_t to = (nav_state == MPC) ? flown(*setpoint) : (nav_state == POSITION) ? *setpoint : hold;

	controllerPid(control, &to, sensors, state, step);
	throttle = control->thrust / FULL / strength;

	if (nav_state != MPC && !flies_rates) { // PX4's own controllers publish too, but those of rates alone
		matrix::Quatf(matrix::Eulerf(state->attitude.roll / DEG + unseen[0], state->attitude.pitch / DEG + unseen[1], data_vehicle_local_position.heading))
		.copyTo(data_vehicle_attitude_setpoint.q_d);
		data_vehicle_attitude_setpoint.thrust_body[2] = -throttle;
		publish(topic_vehicle_attitude_setpoint, data_vehicle_attitude_setpoint);
	}

	static vehicle_attitude_setpoint_s flown_last;
	heard += attitude_setpoint.update(&flown_last);

	const matrix::Eulerf euler{matrix::Quatf{data_vehicle_attitude_setpoint.q_d}};
	roll_setpoint = euler.phi();
	pitch_setpoint = euler.theta();
	yaw_setpoint = euler.psi();
}
