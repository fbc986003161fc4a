// In the place of PX4's headers: what the module of `generate --for px4` uses, as PX4's documentation describes it.
#pragma once

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define MODULE_NAME "mc_nmpc"
#define __EXPORT
#define PX4_OK 0
#define PX4_ERROR (-1)
#define PX4_ISFINITE(x) isfinite(x)

extern "C" int consolePrintf(const char *format, ...);
#define PX4_INFO(format, ...) consolePrintf(format "\n", ##__VA_ARGS__)
#define PX4_WARN(format, ...) consolePrintf("WARN: " format "\n", ##__VA_ARGS__)
#define PX4_ERR(format, ...) consolePrintf("ERROR: " format "\n", ##__VA_ARGS__)
#define mavlink_log_critical(publication, format, ...) (*(publication) = nullptr, consolePrintf("GCS: " format "\n", ##__VA_ARGS__))
#define mavlink_log_warning(publication, format, ...) mavlink_log_critical(publication, format, ##__VA_ARGS__)
typedef void *orb_advert_t;

// Time, in microseconds
typedef uint64_t hrt_abstime;
hrt_abstime hrt_absolute_time();
inline hrt_abstime hrt_elapsed_time(const hrt_abstime *then) { return hrt_absolute_time() - *then; }
namespace time_literals
{
constexpr hrt_abstime operator""_ms(unsigned long long ms) { return 1000 * ms; }
constexpr hrt_abstime operator""_s(unsigned long long s) { return 1000000 * s; }
}

// Mathematics
namespace math
{
template <class T> const T &min(const T &a, const T &b) { return (a < b) ? a : b; }
template <class T> const T &max(const T &a, const T &b) { return (a > b) ? a : b; }
template <class T> T constrain(T value, T least, T most) { return (value < least) ? least : (value > most) ? most : value; }
}
namespace matrix
{
inline float wrap_pi(float angle) { return remainderf(angle, 6.2831853f); }

class Eulerf;
class Quatf
{
public:
	explicit Quatf(const float q[4]) { memcpy(_q, q, sizeof _q); }
	explicit Quatf(const Eulerf &euler);
	Quatf operator*(const Quatf &p) const
	{
		const float product[4] {_q[0] *p._q[0] - _q[1] *p._q[1] - _q[2] *p._q[2] - _q[3] *p._q[3],
			_q[0] *p._q[1] + _q[1] *p._q[0] + _q[2] *p._q[3] - _q[3] *p._q[2],
			_q[0] *p._q[2] - _q[1] *p._q[3] + _q[2] *p._q[0] + _q[3] *p._q[1],
			_q[0] *p._q[3] + _q[1] *p._q[2] - _q[2] *p._q[1] + _q[3] *p._q[0]};
		return Quatf{product};
	}
	void copyTo(float q[4]) const { memcpy(q, _q, sizeof _q); }
	float operator()(int k) const { return _q[k]; }
private:
	float _q[4];
};
class Eulerf
{
public:
	Eulerf(float phi, float theta, float psi) : _angles{phi, theta, psi} {}
	explicit Eulerf(const Quatf &q) :
		_angles{atan2f(2 * (q(0) *q(1) + q(2) *q(3)), 1 - 2 * (q(1) *q(1) + q(2) *q(2))),
			asinf(math::constrain(2 * (q(0) *q(2) - q(3) *q(1)), -1.f, 1.f)),
			atan2f(2 * (q(0) *q(3) + q(1) *q(2)), 1 - 2 * (q(2) *q(2) + q(3) *q(3)))} {}
	float phi() const { return _angles[0]; }
	float theta() const { return _angles[1]; }
	float psi() const { return _angles[2]; }
private:
	float _angles[3];
};
class Dcmf
{
public:
	explicit Dcmf(const Quatf &q) :
		_rows{{1 - 2 * (q(2) *q(2) + q(3) *q(3)), 2 * (q(1) *q(2) - q(0) *q(3)), 2 * (q(1) *q(3) + q(0) *q(2))},
		{2 * (q(1) *q(2) + q(0) *q(3)), 1 - 2 * (q(1) *q(1) + q(3) *q(3)), 2 * (q(2) *q(3) - q(0) *q(1))},
		{2 * (q(1) *q(3) - q(0) *q(2)), 2 * (q(2) *q(3) + q(0) *q(1)), 1 - 2 * (q(1) *q(1) + q(2) *q(2))}} {}
	float operator()(int row, int column) const { return _rows[row][column]; }
private:
	float _rows[3][3];
};
inline Quatf::Quatf(const Eulerf &euler)
{
	const float c[3] {cosf(euler.phi() / 2), cosf(euler.theta() / 2), cosf(euler.psi() / 2)};
	const float s[3] {sinf(euler.phi() / 2), sinf(euler.theta() / 2), sinf(euler.psi() / 2)};
	_q[0] = c[0] * c[1] * c[2] + s[0] * s[1] * s[2];
	_q[1] = s[0] * c[1] * c[2] - c[0] * s[1] * s[2];
	_q[2] = c[0] * s[1] * c[2] + s[0] * c[1] * s[2];
	_q[3] = c[0] * c[1] * s[2] - s[0] * s[1] * c[2];
}
}

// Work queues
namespace px4
{
struct wq_config_t {};
namespace wq_configurations
{
constexpr wq_config_t nav_and_controllers;
}
class ScheduledWorkItem
{
public:
	ScheduledWorkItem(const char *, const wq_config_t &) {}
	virtual ~ScheduledWorkItem() = default;
	void ScheduleNow() { due = 0; }
	void ScheduleDelayed(uint32_t delay) { due = hrt_absolute_time() + delay; }
	void ScheduleClear() { due = UINT64_MAX; }
	virtual void Run() = 0;
	hrt_abstime due{UINT64_MAX};
};
}

// Modules
class ModuleBase
{
public:
	struct Descriptor {
		Descriptor(int (*spawn)(int, char **), int (*)(int, char **), int (*)(const char *)) : task_spawn(spawn) {}
		struct { ModuleBase *load() const { return kept; } void store(ModuleBase *it) { kept = it; } ModuleBase *kept{nullptr}; } object;
		int (*task_spawn)(int, char **);
		int task_id{-1};
	};
	virtual ~ModuleBase() = default;
	virtual int print_status() = 0;
	bool should_exit() const { return stops; }
	static void exit_and_cleanup(Descriptor &desc) { delete desc.object.load(); desc.object.store(nullptr); }
	static int main(Descriptor &desc, int argc, char **argv)
	{
		if (strcmp(argv[1], "stop") == 0) {
			desc.object.load()->stops = true;
			return PX4_OK;
		}

		return desc.task_spawn(argc - 1, argv + 1);
	}
	static constexpr int task_id_is_work_queue = -2;
	bool stops{false};
};
#define PRINT_MODULE_DESCRIPTION(text) consolePrintf("%s", text)
#define PRINT_MODULE_USAGE_NAME(name, category) consolePrintf("%s %s\n", name, category)
#define PRINT_MODULE_USAGE_COMMAND(name) consolePrintf("%s\n", name)
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS() consolePrintf("stop, status\n")

// Parameters, whose values a module takes over at updateParams()
namespace px4
{
enum class params {
	MC_NMPC_SPEED, MC_NMPC_BRAKE, MC_NMPC_TILT, MC_NMPC_CLIMB, MC_NMPC_DESCENT, MC_NMPC_X_MIN, MC_NMPC_X_MAX, MC_NMPC_Y_MIN,
	MC_NMPC_Y_MAX, MC_NMPC_Z_MIN, MC_NMPC_Z_MAX, MPC_THR_HOVER, COUNT
};
}
extern float stored_parameters[static_cast<int>(px4::params::COUNT)];
extern struct Parameter *first_parameter;
struct Parameter {
	Parameter() : next(first_parameter) { first_parameter = this; }
	virtual void update() = 0;
	Parameter *next;
};
template <px4::params name> class ParamFloat : Parameter
{
public:
	ParamFloat() { update(); }
	void update() override { _value = stored_parameters[static_cast<int>(name)]; }
	float get() const { return _value; }
private:
	float _value;
};
class ModuleParams
{
public:
	explicit ModuleParams(ModuleParams *) {}
	void updateParams() { for (Parameter *each = first_parameter; each != nullptr; each = each->next) { each->update(); } }
};
#define WITHOUT_BRACKETS(...) __VA_ARGS__
#define DEFINE_PARAMETERS(a, b, c, d, e, f, g, h, i, j, k, l) WITHOUT_BRACKETS a; WITHOUT_BRACKETS b; WITHOUT_BRACKETS c; \
	WITHOUT_BRACKETS d; WITHOUT_BRACKETS e; WITHOUT_BRACKETS f; WITHOUT_BRACKETS g; WITHOUT_BRACKETS h; WITHOUT_BRACKETS i; \
	WITHOUT_BRACKETS j; WITHOUT_BRACKETS k; WITHOUT_BRACKETS l;

// uORB
struct Topic {
	void *data;
	size_t size;
	unsigned generation;
	px4::ScheduledWorkItem *waits;
	bool is_advertised;
};
#define ORB_ID(name) (&topic_##name)
namespace uORB
{
class Subscription
{
public:
	explicit Subscription(Topic *topic) : _topic(topic) {}
	bool update(void *to) { return (_seen != _topic->generation) && copy(to); }
	bool copy(void *to)
	{
		if (!_topic->is_advertised) { return false; }

		_seen = _topic->generation;
		memcpy(to, _topic->data, _topic->size);
		return _seen > 0;
	}
protected:
	Topic *_topic;
private:
	unsigned _seen{0};
};
class SubscriptionCallbackWorkItem : public Subscription
{
public:
	SubscriptionCallbackWorkItem(px4::ScheduledWorkItem *item, Topic *topic) : Subscription(topic), _item(item) {}
	bool registerCallback() { _topic->waits = _item; return true; }
	void unregisterCallback() { _topic->waits = nullptr; }
private:
	px4::ScheduledWorkItem *_item;
};
class PublicationBase
{
public:
	explicit PublicationBase(Topic *topic) : _topic(topic) {}
	PublicationBase(const PublicationBase &) = delete;
	~PublicationBase(); // takes the topic from all who publish it, until one advertises it anew
protected:
	void publish(const void *message);
private:
	Topic *_topic;
	bool _advertises{false};
};
template <class T> class Publication : PublicationBase
{
public:
	explicit Publication(Topic *topic) : PublicationBase(topic) {}
	void publish(const T &message) { PublicationBase::publish(&message); }
};
}

// Topics: the fields that the module or what surrounds it on the desk uses
struct vehicle_local_position_s {
	hrt_abstime timestamp, timestamp_sample;
	bool xy_valid, z_valid, v_xy_valid, v_z_valid, heading_good_for_control;
	float x, y, z, vx, vy, vz, heading, delta_xy[2], delta_z, delta_vxy[2], delta_vz, delta_heading;
	uint8_t xy_reset_counter, z_reset_counter, vxy_reset_counter, vz_reset_counter, heading_reset_counter;
};
struct vehicle_attitude_s { hrt_abstime timestamp; float q[4]; };
struct vehicle_attitude_setpoint_s { hrt_abstime timestamp; float q_d[4], thrust_body[3]; };
struct vehicle_status_s {
	static constexpr uint8_t ARMING_STATE_ARMED = 2, NAVIGATION_STATE_POSCTL = 2, NAVIGATION_STATE_AUTO_LOITER = 4, NAVIGATION_STATE_AUTO_LAND = 18, NAVIGATION_STATE_EXTERNAL1 = 23;
	hrt_abstime timestamp;
	uint8_t arming_state, nav_state, nav_state_user_intention, system_id, component_id;
};
struct vehicle_land_detected_s { hrt_abstime timestamp; bool ground_contact, maybe_landed, landed; };
struct hover_thrust_estimate_s { hrt_abstime timestamp; float hover_thrust; bool valid; };
struct manual_control_setpoint_s { hrt_abstime timestamp; bool valid; float roll, pitch, yaw, throttle; };
struct trajectory_setpoint_s { hrt_abstime timestamp; float position[3], velocity[3], acceleration[3], yaw; };
struct parameter_update_s { hrt_abstime timestamp; };
struct vehicle_command_s {
	static constexpr uint32_t VEHICLE_CMD_SET_NAV_STATE = 100001;
	hrt_abstime timestamp;
	uint32_t command;
	float param1;
	uint8_t target_system, target_component, source_system;
	uint16_t source_component;
};
struct vehicle_control_mode_s {
	hrt_abstime timestamp;
	bool flag_multicopter_position_control_enabled, flag_control_manual_enabled, flag_control_climb_rate_enabled;
	bool flag_control_attitude_enabled, flag_control_rates_enabled, flag_control_allocation_enabled;
	uint8_t source_id;
};
struct register_ext_component_request_s {
	static constexpr uint16_t LATEST_PX4_ROS2_API_VERSION = 1;
	hrt_abstime timestamp;
	uint64_t request_id;
	char name[25];
	uint16_t px4_ros2_api_version;
	bool register_arming_check, register_mode;
};
struct register_ext_component_reply_s { hrt_abstime timestamp; uint64_t request_id; bool success; int8_t arming_check_id, mode_id; };
struct unregister_ext_component_s { hrt_abstime timestamp; char name[25]; int8_t arming_check_id, mode_id, mode_executor_id; };
struct arming_check_request_s { hrt_abstime timestamp; uint8_t request_id; };
struct arming_check_reply_s {
	static constexpr uint8_t HEALTH_COMPONENT_INDEX_NONE = 0;
	hrt_abstime timestamp;
	uint8_t request_id, registration_id, health_component_index;
	bool can_arm_and_run, mode_req_angular_velocity, mode_req_attitude, mode_req_local_alt, mode_req_local_position;
};
#include "mc_nmpc_status.hpp" // made of McNmpcStatus.msg

#define TOPICS(DO) DO(vehicle_local_position) DO(vehicle_attitude) DO(vehicle_attitude_setpoint) DO(vehicle_status) \
	DO(vehicle_land_detected) DO(hover_thrust_estimate) DO(manual_control_setpoint) DO(trajectory_setpoint) DO(parameter_update) \
	DO(vehicle_command) DO(register_ext_component_request) DO(register_ext_component_reply) DO(unregister_ext_component) \
	DO(arming_check_request) DO(arming_check_reply) DO(mc_nmpc_status)
#define DECLARE(name) extern Topic topic_##name;
TOPICS(DECLARE)
extern Topic topic_config_control_setpoints;
