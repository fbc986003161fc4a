"""Render the templates: settings in, {path: text} of a bundle out; no clock and no path of the machine."""

import hashlib
import math
import re
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Final

import jinja2

from mambo_codegen import __version__, boards
from mambo_codegen.bundle.comments import fitted
from mambo_codegen.bundle.digest import TICKS, episode_count, kept_digest, start_up_test
from mambo_codegen.bundle.draws import input_scales
from mambo_codegen.bundle.episodes import FIRST_LOST, TICKS_PER_INPUT, lost_inputs, target_moves
from mambo_codegen.bundle.flags import (
    COMPILE_FLAGS,
    PROOF_FLAGS,
    PROOF_PREPROCESSING,
    RULE_FLAGS,
    WARNING_FLAGS,
)
from mambo_codegen.bundle.kernel import KernelLoader
from mambo_codegen.bundle.limits_context import limits_context
from mambo_codegen.bundle.products import infix
from mambo_codegen.bundle.sbom import with_sbom
from mambo_codegen.bundle.targets import TARGETS_FOLDER, FirmwareTarget
from mambo_codegen.bundle.template_cache import TemplateCache
from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.heading import TURN_RAD, TURNS_PER_RAD
from mambo_codegen.numbers import literals
from mambo_codegen.numbers.fixed_point import SINE_BITS
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.reach import FLOWN_SHARE, flown_acceleration_m_s2
from mambo_codegen.numbers.representation import (
    ATTITUDE_LIMIT_RAD,
    YAW_LIMIT_RAD,
    Representation,
)
from mambo_codegen.numbers.trigonometry import SINE_ERRORS
from mambo_codegen.port.row import AIM, BESIDE, CHANCE, COUNT
from mambo_codegen.port.taken import MOST_KNOWN, TAKEN
from mambo_codegen.settings.controller_toml import to_toml
from mambo_codegen.settings.model import Settings

FLOW_NOISE_M: Final = 0.02
"""From this noise density of the position on, in m per root Hz, settings are for a flow deck: its position is
an integral."""
LIBRARY: Final = ("nmpc.h", "nmpc.c", "nmpc_self_test.h", "nmpc_self_test.c")
"""The controller, two files, and its self-test, two more, in the folder of a bundle."""

PROJECT: Final = {
    "README.md": "README.md",
    "Makefile": "Makefile",
    "CMakeLists.txt": "CMakeLists.txt",
    "deviations.txt": "deviations.txt",
    "main.c": "example/main.c",
    "nmpc_fuzz.c": "fuzz/nmpc_fuzz.c",
    "nmpc_proof.c": "proof/nmpc_proof.c",
}

_OWN_NAME = re.compile(r"(?<!mambo-)\b(nmpc|NMPC)(?=[_.])")
_OWN_INCLUDE = re.compile(r'^#include "nmpc[a-z_]*\.h"\n', re.MULTILINE)
_REFUSAL: Final = """
#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != {})
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif
"""


def render(settings: Settings, *, with_digest: bool = True) -> dict[str, str]:
    """Render the bundle of `settings`: {relative POSIX path: text}.

    Without `with_digest` the self-test does not state its digest, which takes a second to compute; flights do
    not need it.
    """
    context = template_context(settings, with_digest=with_digest)
    templates = environment()
    library = {name: templates.select_template(_places(name, context)).render(context) for name in LIBRARY}
    project = {
        path: templates.get_template(f"project/{name}.j2").render(context) for name, path in PROJECT.items()
    }
    return with_sbom(_finish(library | project, settings))


def render_target(settings: Settings, target: FirmwareTarget, *, with_digest: bool = True) -> dict[str, str]:
    """Render the folder of `target`, {relative POSIX path: text}: the library and the target's own templates.

    `with_digest` as in `render`. Raises InvalidSettingsError if the firmware cannot keep the update
    period, or wants a controller of another kind.
    """
    target.refuse_level(has_height=settings.height is not None)
    ticks = target.ticks_per_update(settings.horizon.update_period_s)
    bundle = render(settings, with_digest=with_digest)
    library = {
        f"{target.source_folder}{name}": (target.opening if name.endswith(".c") else "") + bundle[name]
        for name in (
            with_prefix(name, settings.code.prefix) for name in LIBRARY[: 4 if target.self_test else 2]
        )
    }
    templates = environment()
    context = template_context(settings, with_digest=with_digest) | {
        "ticks_per_update": ticks,
        "update_period_ns": round(1e9 * settings.horizon.update_period_s),
        "for_flow": settings.observer is not None and settings.observer.position_noise >= FLOW_NOISE_M,
        "flown_m_s2": flown_acceleration_m_s2(settings),
        "flown_share": FLOWN_SHARE,
        "real_type": "float" if settings.code.scalar == "fixed" else "nmpc_real_t",
        **({} if target.context is None else target.context(settings)),
    }
    own = f"{TARGETS_FOLDER}/{target.name}/"
    paths = [path for path in templates.list_templates(extensions=["j2", "py"]) if path.startswith(own)]
    files = {
        path.removeprefix(own).removesuffix(".j2"): templates.get_template(path).render(context)
        for path in paths
        if path.endswith(".j2") and not path.rpartition("/")[2].startswith("_")
    }
    scripts = {path.removeprefix(own): _source(path) for path in paths if path.endswith(".py")}
    return with_sbom(library | _finish(files, settings) | scripts)


def _source(path: str) -> str:
    """Return the text of a script, which is the same for all settings."""
    return KernelLoader("mambo_templates", "").get_source(environment(), path)[0]


def _places(name: str, context: Mapping[str, object]) -> list[str]:
    """Return where the template of a file of the library may be: the method's folder, or the common one."""
    return [f"{context['method_folder']}/{name}.j2", f"common/{name}.j2"]


def _finish(files: Mapping[str, str], settings: Settings) -> dict[str, str]:
    """Return rendered `files` with guards and the prefix of `settings`, and their controller.toml."""
    prefix, settings_id = settings.code.prefix, _settings_id(settings)
    named = {
        with_prefix(path, prefix): with_prefix(_add_guard(path, _fitted(path, text), settings_id), prefix)
        for path, text in files.items()
    }
    return named | {"controller.toml": to_toml(settings)}


def _fitted(path: str, text: str) -> str:
    """Return a file, the comments of C in lines that are not too long."""
    return fitted(text) if path.endswith((".c", ".h")) else text


def with_prefix(text: str, prefix: str) -> str:
    """Replace nmpc in every name of the controller: nmpc_step becomes prefix_step, NMPC_OK PREFIX_OK."""
    return _OWN_NAME.sub(lambda name: prefix if name[1] == "nmpc" else prefix.upper(), text)


@cache
def environment() -> jinja2.Environment:
    """Return the Jinja environment; its number filters use the `Spelling` under "spelling" in the context."""
    made = jinja2.Environment(
        loader=KernelLoader("mambo_templates", ""),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
        bytecode_cache=TemplateCache(),
    )
    made.filters |= {name: _number_filter(name) for name in ("real", "row", "rows")}
    made.filters["infix"] = jinja2.pass_context(_infix)
    return made


def _number_filter(name: str) -> Callable[..., str]:
    """Return a filter that calls the method `name` of the context's `Spelling`."""

    @jinja2.pass_context
    def spell(context: jinja2.runtime.Context, *arguments: Any, **options: Any) -> str:
        text: str = getattr(context["spelling"], name)(*arguments, **options)
        return text

    return spell


def _infix(context: jinja2.runtime.Context, text: str) -> str:
    """Write the products of a chapter with operators, in floating point."""
    return text if context["fixed"] else infix(text)


def template_context(settings: Settings, *, with_digest: bool) -> dict[str, object]:
    """Return all values that the templates insert; `with_digest` as in `render`."""
    method = method_of(settings)
    numbers = method.numbers
    scalar = settings.code.scalar
    return (
        {"height": None, "guard": None, "vector": None}
        | method.context
        | {f"WITH_{name.upper()}": is_there for name, is_there in method.presence.items()}
        | {
            "settings": settings,
            "method_folder": method.folder,
            "chapters": method.chapters,
            "spelling": literals.Spelling(scalar, numbers.bits),
            "parameters": [
                (f"{section}.{key}", value)
                for section, values in settings.in_use.items()
                for key, value in values.items()
                if key != "prefix"  # every public name shows it
            ],
            "version": __version__,
            "semantic_version": __version__.replace(".dev", "-dev"),
            "digest": settings.short_digest,
            "settings_id": _settings_id(settings),
            "fixed": numbers.formats is not None,
            "formats": numbers.formats,
            "sine_bits": SINE_BITS,
            "scales": _powers(numbers, 1),
            "units": _powers(numbers, -1),
            "c_type": literals.C_TYPES[scalar],
            "shell": "nmpc_float_" if numbers.formats else "nmpc_",
            "sum_type": literals.SUM_TYPES[scalar],
            "scalar_bytes": numbers.bytes[0],
            "instance_bytes": method.instance_bytes,
            "tracker": method.tracker,
            "limiting": method.limiting,
            "tilt_limit": "self->bounds.tilt_rad" if method.has_limits else "NMPC_TILT_LIMIT_RAD",
            **limits_context(method),
            "port": method.port,
            "aim": AIM,
            "beside_target": BESIDE,
            "chance": CHANCE,
            "counted": COUNT,
            "target_moves": target_moves(method),
            "most_known": MOST_KNOWN,
            "feedback": method.feedback_steps is not None,
            "feedback_steps": method.feedback_steps,
            "trigonometry": method.trigonometry,
            "sine_error": SINE_ERRORS[scalar],
            "attitude_limit_rad": ATTITUDE_LIMIT_RAD,
            "yaw_limit_rad": YAW_LIMIT_RAD,
            "turn_rad": TURN_RAD,
            "turns_per_rad": TURNS_PER_RAD,
            "start_up": start_up_test(settings),
            "episodes": episode_count(method),
            "ticks": TICKS,
            "held": TICKS_PER_INPUT,
            "self_test_steps": TICKS * episode_count(method),
            "self_test_digest": kept_digest(method) if with_digest else None,
            "spread": input_scales(method),
            "first_lost": FIRST_LOST,
            "found_again": [FIRST_LOST + lost for lost in lost_inputs(method)],
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
            "proofs": {name: " ".join((*PROOF_FLAGS, *flags)) for name, flags in method.proofs.items()},
            "rule_flags": " ".join(RULE_FLAGS),
        }
    )


def _settings_id(settings: Settings) -> str:
    """Return a C constant, 32 bits of a hash of the settings and of the generator's version."""
    digest = hashlib.sha256(f"{__version__} {settings.digest}".encode()).hexdigest()
    return f"0x{digest[:8].upper()}UL"


def _add_guard(path: str, text: str, settings_id: str) -> str:
    """Make a C file stop the compiler, after its includes, if they are headers of another bundle."""
    includes = list(_OWN_INCLUDE.finditer(text))
    if not path.endswith((".c", ".h")) or not includes:
        return text
    end = includes[-1].end()
    return text[:end] + _REFUSAL.format(settings_id) + text[end:]


def _powers(numbers: Representation, sign: int) -> dict[str, str]:
    """Spell 2^(sign * bits) of each quantity as float: integers per unit; for sign -1 units per integer."""
    bits = numbers.bits or {}
    taken = {row.quantity for rows in TAKEN.values() for row in rows}
    return {
        name: literals.real(math.ldexp(1.0, sign * bits[name]), "float32")
        for name in sorted(taken | {"cost"})
        if name in bits
    }
