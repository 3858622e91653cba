"""The autopilot: arming, modes, missions. It decides where to be; the supervisor's laws decide how."""
