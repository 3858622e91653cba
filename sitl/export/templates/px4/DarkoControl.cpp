// DarkO's controller in PX4: from odometry and set-points to motors and servos.
#include "DarkoControl.hpp"

#include <drivers/drv_hrt.h>
#include <math.h>

#include "darko_design.h"
#include "darko_frames.h"

static constexpr bool HOVERS_LEVEL = true;
static constexpr uint32_t PERIOD_US = 2000; // 500 Hz
static constexpr darko_real HOVER_SPEED = 3; // over the ground [m/s]

DarkoControl::DarkoControl() : ScheduledWorkItem(MODULE_NAME, px4::wq_configurations::rate_ctrl)
{
	darko_init(&_darko, darko_exported_design(), 0);
	_reference = darko_hover_at(DarkoVector{0, 0, 0}, 0, HOVER_SPEED);
}

bool DarkoControl::init()
{
	ScheduleOnInterval(PERIOD_US);
	return true;
}

// False until there is an attitude and a place.
bool DarkoControl::seen(DarkoEstimate &estimate)
{
	vehicle_odometry_s odometry{};
	vehicle_local_position_s local{};
	vehicle_land_detected_s land{};

	if (!_odometry_sub.copy(&odometry) || !_local_sub.copy(&local)) {
		return false;
	}

	const float *p = odometry.position, *v = odometry.velocity, *q = odometry.q, *w = odometry.angular_velocity;
	estimate = darko_estimate(darko_from_ned(p[0], p[1], p[2]), darko_from_ned(v[0], v[1], v[2]),
				  darko_from_ned(local.ax, local.ay, local.az),
				  darko_attitude(q[0], q[1], q[2], q[3], HOVERS_LEVEL),
				  darko_rates(w[0], w[1], w[2], HOVERS_LEVEL));
	estimate.actuators = _actuators;
	estimate.on_ground = _land_sub.copy(&land) && land.landed;
	return odometry.pose_frame == vehicle_odometry_s::POSE_FRAME_NED
	       && odometry.velocity_frame == vehicle_odometry_s::VELOCITY_FRAME_NED;
}

void DarkoControl::Run()
{
	if (should_exit()) {
		ScheduleClear();
		exit_and_cleanup();
		return;
	}

	DarkoEstimate estimate{};

	if (!seen(estimate)) {
		return;
	}

	actuator_armed_s armed{};
	_armed_sub.copy(&armed);
	const bool turns = armed.armed && !armed.lockdown && !armed.kill;
	darko_arm(&_darko, turns);

	trajectory_setpoint_s asked{};

	if (_setpoint_sub.update(&asked) && PX4_ISFINITE(asked.position[0]) && PX4_ISFINITE(asked.position[1])
	    && PX4_ISFINITE(asked.position[2])) {
		const darko_real heading = PX4_ISFINITE(asked.yaw) ? darko_azimuth(asked.yaw) : _reference.heading;
		_reference = darko_hover_at(darko_from_ned(asked.position[0], asked.position[1], asked.position[2]), heading,
					    HOVER_SPEED);
		_lands = asked.position[2] > 0.5f; // below the origin: down to the ground
	}

	if (turns && !_lands) {
		darko_fly(&_darko, true);
	}

	darko_land(&_darko, _lands);

	DarkoReadings readings{};
	readings.velocity = estimate.velocity;
	readings.normal_force = darko_normal_force(estimate.attitude, estimate.acceleration, _darko.design->a.g);
	DarkoActuators command{};
	_status = darko_step(&_darko, &estimate, &_reference, &readings, &command);
	_actuators = darko_actuators_after(&_darko, &_actuators, DARKO_PERIOD);
	publish(command, hrt_absolute_time());
}

void DarkoControl::publish(const DarkoActuators &command, hrt_abstime now)
{
	actuator_motors_s motors{};
	actuator_servos_s servos{};

	for (float &value : motors.control) {
		value = NAN;
	}

	for (float &value : servos.control) {
		value = NAN;
	}

	// The share of the fastest speed: set THR_MDL_FAC and the ESCs so that a motor turns at it.
	const darko_real fastest = _darko.design->a.omega_max, most = _darko.design->a.delta_max;
	motors.control[0] = static_cast<float>(command.right_motor / fastest);
	motors.control[1] = static_cast<float>(command.left_motor / fastest);
	servos.control[0] = static_cast<float>(command.right_elevon / most); // positive: trailing edge up
	servos.control[1] = static_cast<float>(command.left_elevon / most);
	motors.timestamp = motors.timestamp_sample = now;
	servos.timestamp = servos.timestamp_sample = now;
	_motors_pub.publish(motors);
	_servos_pub.publish(servos);
}

int DarkoControl::print_status()
{
	PX4_INFO("law %d, last step %d", (int)_darko.flight.controller.law, (int)_status);
	return 0;
}

int DarkoControl::task_spawn(int argc, char *argv[])
{
	DarkoControl *instance = new DarkoControl();

	if (instance == nullptr) {
		PX4_ERR("alloc failed");
		return PX4_ERROR;
	}

	_object.store(instance);
	_task_id = task_id_is_work_queue;
	return instance->init() ? PX4_OK : PX4_ERROR;
}

int DarkoControl::custom_command(int argc, char *argv[])
{
	return print_usage("unknown command");
}

int DarkoControl::print_usage(const char *reason)
{
	if (reason) {
		PX4_WARN("%s", reason);
	}

	PRINT_MODULE_DESCRIPTION("Hybrid controller of the tail-sitter DarkO, which commands motors and elevons itself.");
	PRINT_MODULE_USAGE_NAME("darko_control", "controller");
	PRINT_MODULE_USAGE_COMMAND("start");
	PRINT_MODULE_USAGE_DEFAULT_COMMANDS();
	return 0;
}

extern "C" __EXPORT int darko_control_main(int argc, char *argv[])
{
	return DarkoControl::main(argc, argv);
}
