"""The wire between DarkO and a ground station: dialect, codec, micro-services, plan files, logs."""
