"""Find functions that a controller must not link: heap, printf, libm, arithmetic of a wider type."""

import re
from dataclasses import dataclass
from typing import Final

from mambo_sil.board.firmware.disassembly import is_readable
from mambo_sil.board.firmware.elf import Image, Symbol
from mambo_sil.board.firmware.stack import find_callers

_LIBM: Final = (
    "acos|acosh|asin|asinh|atan|atan2|atanh|cbrt|ceil|copysign|cos|cosh|erf|erfc|exp|exp2|expm1|fabs|fdim|floor|"
    "fma|fmax|fmin|fmod|frexp|hypot|ilogb|ldexp|lgamma|llrint|llround|log|log10|log1p|log2|logb|lrint|lround|"
    "modf|nan|nearbyint|nextafter|nexttoward|pow|remainder|remquo|rint|round|scalbln|scalbn|sin|sincos|sinh|"
    "sqrt|tan|tanh|tgamma|trunc"
)
"""ISO/IEC 9899:1999, 7.12, and sincos, by which compilers replace a sine and a cosine."""
_ALWAYS: Final = {
    "heap": (
        r"_*((re|m|c|aligned_)alloc|free|(posix_)?memalign|s?brk)(_r)?"
        r"|_Z(nw|na|dl|da)\w+"  # C++: new and delete
    ),
    "printf": r"\w*printf\w*|_*f?put(s|c|char)(_r)?",
    "libm": rf"_*(ieee754_)?({_LIBM})[fl]?|__(kernel|rem_pio2|ieee754)\w*",
}
_DOUBLE: Final = (
    r"__aeabi_(d(add|sub|rsub|mul|div|neg|cmp\w+|2\w+)|cdr?cmp\w+|\w+2d)"
    r"|__\w*df([23]|sf2|hf2|si|di|ti)?"
)
"""RTABI 2020Q2, tables 2 to 8; GCC internals, routines for floating-point emulation."""
_QUADRUPLE: Final = r"__\w*tf([23]|[dsh]f2|si|di|ti)?"
_FLOATING: Final = (
    rf"{_DOUBLE}|{_QUADRUPLE}"
    r"|__aeabi_(f(add|sub|rsub|mul|div|neg|cmp\w+|2\w+)|cfr?cmp\w+|\w+2f)"
    r"|__\w*sf([23]|df2|hf2|si|di|ti)?"
)
_DIVISION: Final = r"__aeabi_u?(i|l)div(mod)?|__u?(div|mod|divmod)[qhsd]i[34]|__u?divmod[qhsd]i4"
_WIDER: Final = {
    "float32": {"double precision": _DOUBLE, "quadruple precision": _QUADRUPLE},
    "float64": {"quadruple precision": _QUADRUPLE},
    "fixed": {"floating point": _FLOATING, "division": _DIVISION},
}


@dataclass(frozen=True)
class Forbidden:
    """A function that must not be linked, its kind, and its direct callers."""

    symbol: str
    kind: str
    callers: tuple[str, ...]


def find_forbidden(image: Image, scalar: str) -> tuple[Forbidden, ...]:
    """Return every linked function that a controller of type `scalar` must not link.

    Callers are known in ARM, AVR and RISC-V code only, and only if they call directly.
    """
    rules = _ALWAYS | _WIDER[scalar]
    found = {symbol: kind for symbol in image.symbols if (kind := _kind(symbol, rules))}
    callers = find_callers(image) if found and is_readable(image) else {}
    return tuple(
        Forbidden(symbol.name, kind, tuple(c for c in callers.get(symbol.name, ()) if c != symbol.name))
        for symbol, kind in found.items()
    )


def _kind(symbol: Symbol, rules: dict[str, str]) -> str | None:
    """Return the first kind whose pattern matches a name of the function, None if there is none."""
    for kind, pattern in rules.items():
        if symbol.kind == "function" and any(re.fullmatch(pattern, label) for label in symbol.labels):
            return kind
    return None
