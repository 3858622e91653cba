// The public interface of PX4 that the module uses, without what is behind it.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>

#define MODULE_NAME "darko_control"
#define ORB_ID(name) 0
#define PX4_OK 0
#define PX4_ERROR -1
#define PX4_ISFINITE(x) std::isfinite(x)
#define PX4_INFO(...) printf(__VA_ARGS__)
#define PX4_WARN(...) printf(__VA_ARGS__)
#define PX4_ERR(...) printf(__VA_ARGS__)
#define PRINT_MODULE_DESCRIPTION(text) puts(text)
#define PRINT_MODULE_USAGE_NAME(name, group) puts(name)
#define PRINT_MODULE_USAGE_COMMAND(name) puts(name)
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS() puts("")
#define __EXPORT

using hrt_abstime = uint64_t;
inline hrt_abstime hrt_absolute_time() { return 0; }

struct actuator_armed_s { bool armed, lockdown, kill; };
struct actuator_motors_s { uint64_t timestamp, timestamp_sample; float control[12]; };
struct actuator_servos_s { uint64_t timestamp, timestamp_sample; float control[8]; };
struct trajectory_setpoint_s { float position[3]; float yaw; };
struct vehicle_land_detected_s { bool landed; };
struct vehicle_local_position_s { float ax, ay, az; };
struct vehicle_odometry_s {
	static constexpr uint8_t POSE_FRAME_NED = 1, VELOCITY_FRAME_NED = 1;
	float position[3], q[4], velocity[3], angular_velocity[3];
	uint8_t pose_frame, velocity_frame;
};

namespace uORB
{
struct Subscription {
	int id;
	template <typename T> bool copy(T *) { return true; }
	template <typename T> bool update(T *) { return true; }
};
template <typename T> struct Publication {
	int id;
	bool publish(const T &) { return true; }
};
} // namespace uORB

namespace px4
{
namespace wq_configurations
{
constexpr int rate_ctrl = 0;
}
class ScheduledWorkItem
{
public:
	ScheduledWorkItem(const char *, int) {}
	virtual ~ScheduledWorkItem() = default;
	void ScheduleOnInterval(uint32_t) {}
	void ScheduleClear() {}
	virtual void Run() = 0;
};
} // namespace px4

constexpr int task_id_is_work_queue = -2;
template <typename T> struct ModuleBase {
	struct { void store(T *) {} } static _object;
	static int _task_id;
	virtual ~ModuleBase() = default;
	virtual int print_status() { return 0; }
	static bool should_exit() { return false; }
	static void exit_and_cleanup() {}
	static int main(int argc, char *argv[]) { return T::task_spawn(argc, argv); }
};
