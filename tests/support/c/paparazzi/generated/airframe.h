#ifndef AIRFRAME_H
#define AIRFRAME_H
#define COMMAND_ROLL 0
#define COMMAND_PITCH 1
#define COMMAND_YAW 2
#define COMMAND_THRUST 3
#endif
