"""The paper's method: a 1-norm, minimised by RPROP with a fixed number of iterations."""
