"""The simulated vehicle: rigid body, rotors, stock control loops and the integrator that moves them."""
