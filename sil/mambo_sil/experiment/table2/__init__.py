"""Table II of the paper, reproduced in simulation."""
