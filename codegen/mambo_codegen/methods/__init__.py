"""The methods of control: each folder is one, behind the interface `Method`; `method_of` finds it."""

from functools import lru_cache
from typing import Final

from mambo_codegen.methods.interface import LinearLaw, Method, ReferenceController, Step, StepResult
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.settings.sections import Sections

__all__ = ["LinearLaw", "Method", "ReferenceController", "Step", "StepResult", "method_of"]

_METHODS: Final[dict[str, type[Method]]] = {"1-norm": OneNorm, "quadratic": Quadratic}


@lru_cache(maxsize=32)
def method_of(settings: Sections) -> Method:
    """Return the method that `controller.method` names, with `settings`; its constants are derived once."""
    return _METHODS[settings.controller.method](settings)
