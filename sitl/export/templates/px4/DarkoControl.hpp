// DarkO's controller in PX4: from odometry and set-points to motors and servos.
#pragma once

#include <px4_platform_common/module.h>
#include <px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp>

#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/topics/actuator_armed.h>
#include <uORB/topics/actuator_motors.h>
#include <uORB/topics/actuator_servos.h>
#include <uORB/topics/trajectory_setpoint.h>
#include <uORB/topics/vehicle_land_detected.h>
#include <uORB/topics/vehicle_local_position.h>
#include <uORB/topics/vehicle_odometry.h>

#include "darko_controller.h"

class DarkoControl : public ModuleBase<DarkoControl>, public px4::ScheduledWorkItem
{
public:
	DarkoControl();

	static int task_spawn(int argc, char *argv[]);
	static int custom_command(int argc, char *argv[]);
	static int print_usage(const char *reason = nullptr);
	int print_status() override;

	bool init();

private:
	void Run() override;
	bool seen(DarkoEstimate &estimate);
	void publish(const DarkoActuators &command, hrt_abstime now);

	uORB::Subscription _armed_sub{ORB_ID(actuator_armed)};
	uORB::Subscription _land_sub{ORB_ID(vehicle_land_detected)};
	uORB::Subscription _local_sub{ORB_ID(vehicle_local_position)};
	uORB::Subscription _odometry_sub{ORB_ID(vehicle_odometry)};
	uORB::Subscription _setpoint_sub{ORB_ID(trajectory_setpoint)};
	uORB::Publication<actuator_motors_s> _motors_pub{ORB_ID(actuator_motors)};
	uORB::Publication<actuator_servos_s> _servos_pub{ORB_ID(actuator_servos)};

	Darko _darko{};
	DarkoReference _reference{};
	DarkoActuators _actuators{}; // where they are by the model
	int32_t _status{0};
	bool _lands{false};
};
