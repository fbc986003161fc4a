"""One simulated flight: closed loop, trajectories, traces, metrics and the record that repeats it."""
