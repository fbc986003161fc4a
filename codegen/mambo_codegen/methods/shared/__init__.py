"""What both methods use: inputs, limits, target tracker, and the constants of any method."""
