"""The reference controller: predictor, cost, optimizer and controller in NumPy, for n controllers at once.

Every operation has the order and the brackets of the C templates, in the scalar type of the settings, so that
both compute the same bits. `@`, `numpy.dot` and `numpy.sum` are not used here, because they may reorder
additions. `paper.py` is the exception: eqs 8-12 and RPROP as a lecture would write them, equal up to
rounding.
"""

from mambo_nmpc.codegen.reference.controller import Memory, ReferenceController, Status, Step, choose

__all__ = ["Memory", "ReferenceController", "Status", "Step", "choose"]
