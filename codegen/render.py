"""Render the templates: settings in, {path: text} of a bundle out; a pure function, no clock and no path."""

import re
from functools import partial
from typing import Final

import jinja2

import codegen
from codegen import boards, literals
from codegen.flags import (
    COMPILE_FLAGS,
    PROOF_FLAGS,
    PROOF_PREPROCESSING,
    PROOFS,
    RULE_FLAGS,
    WARNING_FLAGS,
)
from codegen.frozen import HELD, HOVER_M_S2, TICKS, episodes, frozen_digest, spread
from codegen.horizon import horizon_tables
from codegen.reference.controller import ATTITUDE_LIMIT_RAD, WEIGHT_LIMIT
from codegen.self_test import hover_thrust, self_test
from codegen.settings import Settings
from codegen.settings.controller_toml import to_toml
from codegen.trigonometry import SINE_ERRORS, YAW_LIMIT_RAD, trigonometry

PUBLIC_HEADERS: Final = ("nmpc_config.h", "nmpc.h", "nmpc_self_test.h")
SUB_BLOCKS: Final = ("nmpc_math", "nmpc_predictor", "nmpc_cost", "nmpc_optimizer")
SOURCES: Final = (*(f"{block}.c" for block in SUB_BLOCKS), "nmpc.c", "nmpc_self_test.c")
PROJECT: Final = {
    "README.md": "README.md",
    "Makefile": "Makefile",
    "CMakeLists.txt": "CMakeLists.txt",
    "main.c": "example/main.c",
    "nmpc_fuzz.c": "fuzz/nmpc_fuzz.c",
    "nmpc_proof.c": "proof/nmpc_proof.c",
}
DEVIATIONS: Final = "deviations.txt"
"""Names files of a bundle in folders, which an amalgamated one has not."""

_OWN_NAME = re.compile(r"(?<!mambo-)\b(nmpc|NMPC)(?=[_.])")
_OWN_INCLUDE = re.compile(r'^#include "(nmpc[a-z_]*\.h)"\n', re.MULTILINE)
_REAL_BYTES: Final = {"float32": 4, "float64": 8}


def render(settings: Settings, *, amalgamate: bool = False, with_digest: bool = True) -> dict[str, str]:
    """Render the bundle of `settings`: {relative POSIX path: text}.

    With `amalgamate` the library is one header and one source in the bundle's folder. Only `with_digest` does
    the header state the digest of the frozen steps: what is compiled to run at once need not wait for it.
    """
    environment = _environment(settings.code.scalar)
    headers = {name: environment.get_template(f"include/{name}.j2") for name in PUBLIC_HEADERS}
    privates = {f"{block}.h": environment.get_template(f"src/{block}.h.j2") for block in SUB_BLOCKS}
    sources = {name: environment.get_template(f"src/{name}.j2") for name in SOURCES}
    others = PROJECT if amalgamate else PROJECT | {DEVIATIONS: DEVIATIONS}
    project = {path: environment.get_template(f"project/{name}.j2") for name, path in others.items()}

    context = _context(settings) | {
        "amalgamated": amalgamate,
        "frozen_digest": frozen_digest(settings, episodes(settings)) if with_digest else None,
    }
    text = {name: template.render(context) for name, template in (headers | privates | sources).items()}
    if amalgamate:
        layout = {"header_folder": "", "source_folder": "", "sources": ["nmpc.c"]}
        library = _amalgamated(text)
    else:
        layout = {
            "header_folder": "include/",
            "source_folder": "src/",
            "sources": [f"src/{name}" for name in SOURCES],
        }
        library = {_home(name): content for name, content in text.items()}
    files = library | {path: template.render(context | layout) for path, template in project.items()}
    prefix = settings.code.prefix
    named = {with_prefix(path, prefix): with_prefix(text, prefix) for path, text in files.items()}
    return named | {"controller.toml": to_toml(settings)}


def with_prefix(text: str, prefix: str) -> str:
    """Give every name of the controller its prefix: nmpc_step becomes prefix_step, NMPC_OK PREFIX_OK."""
    return _OWN_NAME.sub(lambda name: prefix if name[1] == "nmpc" else prefix.upper(), text)


def _environment(scalar: str) -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("templates", ""),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters |= {
        spell.__name__: partial(spell, scalar=scalar)
        for spell in (literals.real, literals.row, literals.rows)
    }
    return environment


def _context(settings: Settings) -> dict[str, object]:
    """Decide everything that the templates only arrange."""
    tables = horizon_tables(settings)
    scalar = settings.code.scalar
    return {
        "settings": settings,
        "parameters": [
            (f"{section}.{key}", value)
            for section, values in settings.model_dump().items()
            for key, value in values.items()
            if key != "prefix"  # the one text of the user's; the names show it
        ],
        "version": codegen.__version__,
        "digest": settings.digest[:16],
        "c_type": literals.C_TYPES[scalar],
        "scalar_bytes": _REAL_BYTES[scalar],
        "instance_bytes": _instance_bytes(settings, has_lag=tables.has_lag),
        "backtracking": settings.optimizer.variant == "rprop+",
        "yaw_sign": "" if settings.model.yaw_convention == "printed" else "-",
        "tables": tables,
        "trigonometry": trigonometry(scalar),
        "sine_error": SINE_ERRORS[scalar],
        "weight_limit": WEIGHT_LIMIT,
        "attitude_limit_rad": ATTITUDE_LIMIT_RAD,
        "yaw_limit_rad": YAW_LIMIT_RAD,
        "vectors": self_test(settings),
        "episodes": episodes(settings),
        "ticks": TICKS,
        "held": HELD,
        "hover_m_s2": HOVER_M_S2,
        "frozen_steps": TICKS * episodes(settings),
        "spread": spread(settings),
        "boards": [
            {
                "name": board.name,
                "compiler": board.compiler.common,
                "flags": " ".join(board.compiler.flags),
            }
            for board in map(boards.load, boards.names())
        ],
        "hover_thrust_m_s2": hover_thrust(settings),
        "example_position_m": min(1.0, settings.ranges.position_m / 2),
        "example_speed_m_s": min(0.2, settings.ranges.velocity_m_s / 2),
        "steps_per_line": max(1, round(0.5 / settings.horizon.update_period_s)),
        "compile_flags": " ".join(COMPILE_FLAGS),
        "warning_flags": " ".join(WARNING_FLAGS),
        "proof_preprocessing": " ".join(PROOF_PREPROCESSING),
        "proofs": {name: " ".join((*PROOF_FLAGS, *flags)) for name, flags in PROOFS.items()},
        "rule_flags": " ".join(RULE_FLAGS),
    }


def _instance_bytes(settings: Settings, *, has_lag: bool) -> int:
    """Count the members of nmpc_t: scalars, then single bytes, padded to a whole scalar."""
    moves = 2 * settings.horizon.control
    weights, gains, tilt, walks, command, cost = 2, 4, 2, 2 * (5 if has_lag else 3), 2, 1
    flags = 2
    scalars = weights + gains + tilt + walks + command + cost + (2 * moves)
    scalar_bytes = _REAL_BYTES[settings.code.scalar]
    return (scalars + -(-flags // scalar_bytes)) * scalar_bytes


def _home(name: str) -> str:
    return f"include/{name}" if name in PUBLIC_HEADERS else f"src/{name}"


def _amalgamated(text: dict[str, str]) -> dict[str, str]:
    """Join the library into one header and one source: each file once, in order, without our own includes."""
    header = [text[name] for name in PUBLIC_HEADERS]
    source = [text[f"{block}{ending}"] for ending in (".h", ".c") for block in SUB_BLOCKS]
    source += [text["nmpc.c"], text["nmpc_self_test.c"]]
    return {
        "nmpc.h": _OWN_INCLUDE.sub("", "\n".join(header)),
        "nmpc.c": '#include "nmpc.h"\n\n' + _OWN_INCLUDE.sub("", "\n".join(source)),
    }
