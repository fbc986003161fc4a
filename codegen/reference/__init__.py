"""The executable paper: predictor, cost, optimizer and controller in NumPy, for n controllers at once.

Every operation stands in the order and with the brackets of the C templates, in the scalar type of the
settings, so that both compute the same bits. Nothing here calls `@`, `numpy.dot` or `numpy.sum`, which are
free to reorder additions.
"""

from mambo_nmpc.codegen.reference.controller import Memory, ReferenceController, Status, Step

__all__ = ["Memory", "ReferenceController", "Status", "Step"]
