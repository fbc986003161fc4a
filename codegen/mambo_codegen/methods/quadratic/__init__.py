"""A quadratic cost, minimised exactly, with an observer and a model of the attitude loops."""
