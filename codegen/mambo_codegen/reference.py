"""The reference controller: predictor, cost, optimizer and controller in NumPy, for n controllers at once.

Every operation has the order and the brackets of the C templates, in the scalar type of the settings, so that
both compute the same bits. `@`, `numpy.dot` and `numpy.sum` are not used here, because they may reorder
additions. `paper.py` is the exception: eqs 8-12 and RPROP as a lecture would write them, equal up to
rounding.
"""

from mambo_codegen.design import Design
from mambo_codegen.methods.inputs import Status, choose
from mambo_codegen.methods.one_norm.controller import Memory, ReferenceController, Step
from mambo_codegen.methods.quadratic.controller import ExactReferenceController, ExactStep

__all__ = [
    "ExactReferenceController",
    "ExactStep",
    "Memory",
    "ReferenceController",
    "Status",
    "Step",
    "choose",
    "reference_controller",
]


def reference_controller(design: Design, n: int = 1) -> ReferenceController | ExactReferenceController:
    """Return n controllers in NumPy that compute the bits of the C of `design`."""
    return ExactReferenceController(design, n) if design.is_quadratic else ReferenceController(design, n)
