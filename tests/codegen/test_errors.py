"""Errors pass between processes, such as from a worker to the campaign."""

import pickle
import re
from importlib import import_module
from pathlib import Path
from typing import Final

import pytest

from mambo_codegen.errors import ForeignFilesError, InvalidSettingsError, MamboNmpcError
from mambo_codegen.settings.controller_toml import parse
from mambo_sil.errors import LogError
from mambo_sil.experiment.campaign.executors import processes

ROOT = Path(__file__).parents[2]
ARGUMENTS: dict[type[MamboNmpcError], tuple[object, ...]] = {
    InvalidSettingsError: (("first", "second"),),
    ForeignFilesError: ("what to do", ("a.c", "b.c")),
    LogError: (("first", "second"),),
}
TEXTS: dict[type[MamboNmpcError], str] = {
    InvalidSettingsError: "first\nsecond",
    ForeignFilesError: "what to do",
    LogError: "first\nsecond",
}


def error_classes() -> list[type[MamboNmpcError]]:
    """Return every error class of codegen and sil."""
    found = []
    for path in sorted(path for folder in ("codegen", "sil") for path in (ROOT / folder).rglob("*.py")):
        names = re.findall(r"^class (\w+Error)\b", path.read_text("utf-8"), re.MULTILINE)
        if names:
            module = import_module(".".join(path.relative_to(ROOT).with_suffix("").parts[1:]))
            found += [getattr(module, name) for name in names]
    return found


ERRORS: Final = error_classes()


@pytest.mark.parametrize("kind", ERRORS)
def test_every_error_survives_pickling(kind: type[MamboNmpcError]) -> None:
    """Class, text and attributes; also when it is pickled again."""
    error = kind(*ARGUMENTS.get(kind, ("what to do",)))
    assert str(error) == TEXTS.get(kind, "what to do")
    again = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(error))))
    assert (type(again), str(again), again.args, vars(again)) == (kind, str(error), error.args, vars(error))
    assert issubclass(kind, MamboNmpcError)


def test_all_error_classes_are_found() -> None:
    """Those of both packages, and one beside what raises it."""
    names = {kind.__name__ for kind in ERRORS}
    assert {
        "MamboNmpcError",
        "ForeignFilesError",
        "InvalidSettingsError",
        "CacheError",
        "FootprintError",
    } <= names


def test_an_error_of_a_worker_process_arrives_as_it_was_raised() -> None:
    """All its faults, each on a line."""
    text = "[horizon]\ncontrol = 99\n[limits]\ntilt_rad = -1.0\n"
    with pytest.raises(InvalidSettingsError) as here:
        parse(text, "mine.toml")
    assert len(here.value.faults) > 1
    with processes(1) as pool, pytest.raises(InvalidSettingsError) as there:
        list(pool.run(parse, [(text, "mine.toml")]))
    assert (str(there.value), there.value.faults) == (str(here.value), here.value.faults)
