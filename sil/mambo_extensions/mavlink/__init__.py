"""Flying drones with an autopilot of their own, PX4 or ArduCopter, by MAVLink; in simulation so far."""
