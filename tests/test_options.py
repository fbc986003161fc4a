"""Each option of the settings through each consumer: flown, with equal bits where two fly, or refused.

The table is tests/support/options.py.
"""

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from mambo_codegen.errors import MamboNmpcError
from mambo_codegen.settings.controller_keys import KEYS, SECTIONS
from mambo_codegen.settings.sections import DEFAULTS
from tests.support import option_commands, option_consumers
from tests.support.option_flights import OptionFlights
from tests.support.options import COMMANDS, CONSUMERS, OPTIONS, REFUSALS, TARGETS, installed
from tests.support.quadratic import settings_of
from tests.support.tools import require

QUICK_CC = Path(__file__).parent / "support" / "quick-cc"


def options() -> Iterator[tuple[str, object]]:
    """Yield each option of the settings: a path and a value, None for any that is not the default."""
    for path, key in KEYS.items():
        if key.kind == "one of":
            yield from ((path, choice.strip('"')) for choice in key.domain.split(" or "))
        elif key.low is None:
            yield path, None
        elif key.low <= 0.0:
            yield path, None if DEFAULTS.value(path) == 0.0 else 0.0
    yield from ((path, None) for path in SECTIONS if getattr(DEFAULTS, path, path) is None)


def test_every_option_of_the_settings_has_a_row() -> None:
    """Each choice, each optional section, and each number on the other side of 0, which switches it off."""
    rows = [option.settings for option in OPTIONS.values()]
    for path, value in options():
        others = {one.value(path) for one in rows if one.uses(path)} - {None, DEFAULTS.value(path)}
        found = others if value is None else {one.value(path) for one in rows if one.uses(path)} & {value}
        assert found, f"add {path} = {value or 'another value'} to a row of tests/support/options.py"


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", OPTIONS)
def test_consumers_fly_an_option_with_equal_bits_or_refuse_it(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As its row says; and the option acts in the flight, so that who leaves it out flies another one."""
    require("gcc", "gcc")
    monkeypatch.setenv("CC", str(QUICK_CC))
    option = OPTIONS[name]
    flights = OptionFlights(option.settings)
    there = installed(CONSUMERS)
    assert set(there) == set(installed(option_consumers.ALL))
    found = {one: mark_of(partial(option_consumers.ALL[one], flights, tmp_path)) for one in there}
    assert found == {one: option.mark(CONSUMERS, one) for one in there}
    for target in installed(TARGETS):  # those that write a folder are among the slow ones
        if option.mark(TARGETS, target) != "+":
            refused = mark_of(partial(option_commands.target, flights, target))
            assert (target, refused) == (target, option.mark(TARGETS, target))
    base = settings_of(option.base)
    if base != flights.settings and set(option.values) != {"code.prefix"}:
        other = OptionFlights(base).wrapped_trace
        assert other.command_rad.tobytes() != flights.wrapped_trace.command_rad.tobytes()


@pytest.mark.long
@pytest.mark.sampled(120)
@pytest.mark.usefixtures("in_an_empty_folder")
@pytest.mark.parametrize("name", OPTIONS)
@pytest.mark.parametrize("column", installed([*COMMANDS, *TARGETS]))
def test_commands_and_targets_take_an_option_or_refuse_it(column: str, name: str) -> None:
    """As its row says."""
    option = OPTIONS[name]
    flights = OptionFlights(option.settings)
    option_consumers.written(flights, Path())
    columns = TARGETS if column in TARGETS else COMMANDS
    assert mark_of(partial(option_commands.ALL[column], flights)) == option.mark(columns, column)


def mark_of(use: Callable[[], str]) -> str:
    """Return the mark of a consumer, or what went wrong."""
    try:
        return use()
    except AssertionError as error:
        return f"wrong: {error}"
    except (MamboNmpcError, option_commands.RefusedError) as error:
        return next((mark for mark, words in REFUSALS.items() if re.search(words, str(error))), str(error))
