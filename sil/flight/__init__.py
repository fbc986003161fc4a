"""One simulated flight: closed loop, trajectories, traces, metrics and its record."""
