"""What the commands do with the settings of an option, in an empty folder, with short flights.

Each function returns "=" if it compares bits, "+" if there is nothing to compare with; a command that refuses
the settings exits with 2, which `RefusedError` reports.
"""

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest
from typer.testing import CliRunner

from mambo_codegen.bundle.render import render, render_target, with_prefix
from mambo_codegen.bundle.targets import find_target, target_names
from mambo_sil.cli.app import app
from mambo_sil.flight.engine.engine_library import VARIABLE
from mambo_sil.flight.engine.simulate import fly as fly_in_engine
from mambo_sil.flight.scenario import flight_of
from mambo_sil.flight.traces import read_npz
from tests.support.bundles import place
from tests.support.command import unwrapped
from tests.support.option_flights import OptionFlights
from tests.support.shell import shell
from tests.support.tools import board_builder, require_module

SETTINGS: Final = "controller.toml"
STUBS: Final = Path(__file__).parents[1] / "targets"
STRICT: Final = "-fsyntax-only -Wall -Wextra -Werror"
GLUE: Final = {
    "arduino": [
        f"g++ -x c++ -include Arduino.h -I{STUBS}/arduino_stubs -Isrc",
        "examples/Hover/Hover.ino",
    ],
    "fmu": ["gcc -std=c99 -Isources", "sources/fmi?.c", "sources/nmpc_fmu.c"],
    "mambo": [f"gcc -std=gnu89 -I{STUBS}/mambo_stubs -Isrc", "src/nmpc_mambo.c"],
    "pil": ["gcc -std=c99 -D_GNU_SOURCE", "pil*.c", "board_host.c"],
    "px4": ["g++ -std=gnu++17 -Wno-missing-field-initializers -Wno-unused-parameter -Ipx4", "*.cpp"],
}
"""How the code around the controller is compiled, and its files; the Crazyflie's app is flown."""


class RefusedError(Exception):
    """A command refused its input; the text is what it printed, on one line."""


def command(*arguments: str) -> dict[str, Any]:
    """Run a command with `--json` and return its summary; raises RefusedError."""
    result = CliRunner().invoke(app(), [*arguments, "--json"])
    if result.exit_code == 2:
        raise RefusedError(unwrapped(result.stderr.replace("│", "")))
    assert result.exit_code in (0, 1), (arguments, result.output, result.exception)
    assert isinstance(result.exception, SystemExit | None), result.exception
    summary: dict[str, Any] = json.loads(result.stdout)
    return summary


def fly(flights: OptionFlights, options: Sequence[str] = (), expected: str | None = None) -> str:
    """Compare the flight of the command with that of the engine, or with an expected digest."""
    flown = flights.scenario
    command(
        *("fly", SETTINGS, "--vehicle", flights.name, "--trajectory", flown.trajectory),
        *("--size-m", str(flown.size_m), "--rate-rad-s", str(flown.rate_rad_s)),
        *(
            "--yaw-rad",
            str(flown.yaw_rad),
            "--duration-s",
            str(flown.duration_s),
            "--no-pictures",
            "-o",
            "flown",
            *options,
        ),
    )
    assert read_npz(Path("flown/trace.npz")).digest() == (expected or _flown(flights))
    return "="


def _flown(flights: OptionFlights) -> str:
    """Return the digest of the same flight in the engine."""
    flight = flight_of([flights.scenario], flights.settings.horizon.update_period_s)
    return fly_in_engine(flight, flights.compiled()).digest()


def numpy(flights: OptionFlights) -> str:
    """Fly in NumPy, and compare with the flight of the engine."""
    flown = _flown(flights)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, "numpy")
        return fly(flights, expected=flown)


def flown_app(flights: OptionFlights) -> str:
    """Fly the app of the Crazyflie on the desk."""
    found = command(
        "fly", SETTINGS, "--app", "crazyflie", "--duration-s", "2", "--no-pictures", "-o", "flown"
    )
    assert found["settings"] == flights.settings.digest
    return "+"


def campaign(flights: OptionFlights) -> str:
    """Fly one flight of a campaign."""
    text = f'controllers = ["{SETTINGS}"]\n[flight]\nduration_s = 1.0\nvehicle = "{flights.name}"\n'
    Path("campaign.toml").write_text(text, "utf-8")
    found = command("campaign", "campaign.toml", "--flights", "1", "--workers", "1", "-o", "flown")
    assert found["flights"] == 1
    return "+"


def faults(flights: OptionFlights) -> str:
    """Fly all faults."""
    found = command("faults", SETTINGS, "--vehicle", flights.name, "-o", "flown")
    assert {one["course"] for one in found["flights"]} == {"eight", "hover"}
    return "+"


def sweep(flights: OptionFlights) -> str:
    """Vary a number in two steps."""
    board_builder("crazyflie")
    value = flights.settings.value(_number(flights))
    vary = f"{_number(flights)}={value}:{1.1 * value}:2"
    found = command("sweep", SETTINGS, "--vary", vary, "--vehicle", flights.name, "-o", "swept")
    assert len(found["points"]) == 2
    return "+"


def tune(flights: OptionFlights) -> str:
    """Try once."""
    require_module("optuna")
    key = _number(flights)
    value = flights.settings.value(key)
    text = f'base = "{SETTINGS}"\nflights = 1\nflight.duration_s = 1.0\nflight.vehicle = "{flights.name}"\n'
    search = f"[search]\n{key} = {{ uniform = [{0.9 * value}, {1.1 * value}] }}\n"
    Path("tune.toml").write_text(text + search, "utf-8")
    found = command("tune", "tune.toml", "--trials", "1", "--workers", "1", "-o", "tuned")
    assert found["trials"] == 1
    return "+"


def _number(flights: OptionFlights) -> str:
    """Return the path of a number that the settings use."""
    is_quadratic = flights.settings.controller.method == "quadratic"
    return "cost.response_time_s" if is_quadratic else "cost.tracking_weight"


def diff(flights: OptionFlights) -> str:
    """Compare it with itself: nothing differs."""
    Path("other.toml").write_text(Path(SETTINGS).read_text("utf-8"), "utf-8")
    command("diff", SETTINGS, "other.toml", "--vehicle", flights.name)
    return "+"


def regress(flights: OptionFlights) -> str:
    """Fly a suite of one flight."""
    text = f'[flights.eight]\nduration_s = 11.0\nvehicle = "{flights.name}"\nbounds = {{ iae_m_s = 9.0 }}\n'
    Path("suite.toml").write_text(text, "utf-8")
    found = command("regress", "suite.toml", "--controller", SETTINGS, "-o", "flown")
    assert len(found["flights"]) == 1
    return "+"


def footprint(_flights: OptionFlights) -> str:
    """Measure it on a board."""
    board_builder("crazyflie")
    command("footprint", SETTINGS, "--board", "crazyflie")
    return "+"


def board(flights: OptionFlights) -> str:
    """Compare the flight on an emulated board with that on this machine."""
    board_builder("crazyflie")
    return fly(flights, ("--on", "crazyflie"))


def same_bits(_flights: OptionFlights) -> str:
    """Compare the self-test of a build with the reference."""
    board_builder("crazyflie")
    command("check-bits", SETTINGS, "--board", "crazyflie", "--steps", "100")
    return "="


def port(flights: OptionFlights) -> str:
    """Compare the flight on a board behind a serial line with that on this machine."""
    from tests.extensions.pil.support.option import fly_on_line  # noqa: PLC0415 - an extension

    fly_on_line(flights)
    return "="


def verify(_flights: OptionFlights) -> str:
    """Compare builds of the C with the reference, call by call."""
    found = command("verify", SETTINGS, "--only", "bits", "-o", "verified")
    assert found["checks"]
    return "="


def margins(flights: OptionFlights) -> str:
    """Measure its margins; a 1-norm has none, which the command says."""
    found = command("margins", SETTINGS, "--vehicle", flights.name)
    assert (found["axes"] is None) == (flights.settings.controller.method == "1-norm")
    assert len(found["axes"] or "xy") == 2 + flights.method.has_height
    return "+"


def target(flights: OptionFlights, name: str) -> str:
    """Write the folder of a target: its C is that of the bundle, and the code around it compiles."""
    prefix, settings = flights.settings.code.prefix, flights.settings
    files = render_target(settings, find_target(name), with_digest=False)
    controller = with_prefix("nmpc.c", prefix)
    found = files[f"{find_target(name).source_folder}{controller}"]
    assert found == find_target(name).opening + render(settings, with_digest=False)[controller]
    folder = Path(name).absolute()
    if name == "px4":
        from tests.extensions.px4.support import px4_files  # noqa: PLC0415 - an extension

        files = px4_files(settings)
    place(files, folder)
    compiler, *patterns = GLUE.get(name, [""])
    for pattern in patterns:
        (source, *others) = sorted(folder.glob(with_prefix(pattern, prefix)))
        shell(*compiler.split(), *STRICT.split(), source, *others, folder=folder)
    return "+"


ALL: Final[dict[str, Callable[[OptionFlights], str]]] = {
    **{name: partial(target, name=name) for name in target_names()},
    "fly": fly,
    "reference": partial(fly, options=("--controller", "reference")),
    "numpy": numpy,
    "board": board,
    "port": port,
    "app": flown_app,
    "campaign": campaign,
    "faults": faults,
    "margins": margins,
    "diff": diff,
    "tune": tune,
    "sweep": sweep,
    "regress": regress,
    "footprint": footprint,
    "check-bits": same_bits,
    "verify": verify,
}
