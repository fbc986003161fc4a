"""Files that say what is flown: sections with rules, drones, settings and controllers by name.

A message names file, key, value, rule and fix; all errors of a file are reported together.
"""

import difflib
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from mambo_codegen.errors import InvalidSettingsError, MamboNmpcError, echo, echo_value
from mambo_codegen.plain_file import guess_name
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.toml_file import parse_document, read_text
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError
from mambo_sil.flight.controllers.own_law import Law, LawFile, period_of
from mambo_sil.flight.names import PD_NAMES, PdName

NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")

Found = TypeVar("Found")


class FileSection(BaseModel):
    """A frozen section of a file that rejects unknown keys, conversions of type, infinity and NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


File = TypeVar("File", bound=FileSection)


@dataclass(frozen=True)
class Entrant:
    """One controller of a campaign: a PD, generated C, or a law of the user's own."""

    name: str
    kind: Literal[PdName, "nmpc", "law"]
    settings: Settings = field(default_factory=Settings)
    """A PD uses their update period only, a law nothing."""
    law: LawFile | Law | None = None
    """In a file, or an object of a program."""

    @property
    def update_period_s(self) -> float:
        """Time from one control step to the next; raises ArgumentError for that of a law."""
        return self.settings.horizon.update_period_s if self.law is None else period_of(self.law)

    @property
    def controller(self) -> str:
        """What a record of a flight calls it."""
        return self.law.named if isinstance(self.law, LawFile) else self.kind

    def document(self) -> dict[str, Any]:
        """Return the controller as plain values, for other processes and for files; of laws only a file's."""
        flies = (
            {"law": asdict(self.law)}
            if isinstance(self.law, LawFile)
            else {"settings": self.settings.model_dump()}
        )
        return {"name": self.name, "kind": self.kind, **flies}

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> "Entrant":
        """Return the controller that `document`, perhaps from a file, describes."""
        name, kind = document["name"], document["kind"]
        if "law" in document:
            return cls(name, kind, law=LawFile(**document["law"]))
        return cls(name, kind, Settings.model_validate_json(json.dumps(document["settings"])))


def read_as(model: type[File], path: Path) -> File:
    """Read the file at `path` as a `model` with sections like campaign.toml.

    Raises UnreadableFileError for a file that is missing or not TOML, InvalidSettingsError with all errors.
    """
    source = echo(str(path))
    return as_sections(model, parse_document(read_text(path), source), source)


def as_sections(model: type[File], document: Mapping[str, Any], source: str) -> File:
    """Return a document as a `model` with sections like campaign.toml.

    Raises InvalidSettingsError, whose lines begin with `source`, with all errors.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
        raise InvalidSettingsError(tuple(f"{source}: {_explain(one, model)}" for one in details)) from None


def _loaded(
    load: Callable[[str], Found], shipped: Iterable[str], named: str, folder: Path, place: str
) -> Found:
    """Load what is shipped under a name, or else a file in `folder`.

    Raises InvalidSettingsError, whose lines begin with `place`.
    """
    path = folder / named
    try:
        return load(named if named in shipped or not path.exists() else str(path))
    except MamboNmpcError as error:
        guess = "" if "(did you mean" in str(error) else guess_name(path, folder)
        raise InvalidSettingsError(
            tuple(f"{place}: {line}" for line in f"{error}{guess}".splitlines())
        ) from None


def load_drone(named: str, folder: Path, place: str) -> VehicleFile:
    """Load a shipped drone or a file in `folder`; raises InvalidSettingsError, which begins with `place`."""
    return _loaded(vehicle_toml.load, vehicle_toml.names(), named, folder, place)


def load_settings(named: str, folder: Path, place: str) -> Settings:
    """Load a preset or a file in `folder`; raises InvalidSettingsError, whose lines begin with `place`."""
    return _loaded(presets.load, presets.names(), named, folder, place)


def load_entrant(named: str, folder: Path, place: str) -> Entrant:
    """Return the controller called `named`: a law without a model, a preset or a file in `folder`.

    Raises InvalidSettingsError, whose lines begin with `place`.
    """
    for pd in PD_NAMES:
        if named == pd:
            return Entrant(pd, pd)
    settings = load_settings(named, folder, place)
    name = named if named in presets.names() else Path(named).stem
    if not NAME.fullmatch(name) or name in PD_NAMES:
        raise InvalidSettingsError(
            (
                f"{place}: {echo(named)} must have a name of at most 40 letters, digits, - and "
                f"_, other than {', '.join(PD_NAMES)}: results are named after it",
            )
        )
    return Entrant(name, "nmpc", settings)


def load_any_entrant(named: str, folder: Path, place: str) -> Entrant:
    """Return the same, or a law of the user's own, FILE.py:CLASS, with the name of the class.

    Raises InvalidSettingsError, whose lines begin with `place`.
    """
    if named.endswith(".py"):
        raise InvalidSettingsError(
            (f"{place}: {echo(named)} must be {echo(named)}:CLASS, a law of your own",)
        )
    if ".py:" not in named:
        return load_entrant(named, folder, place)
    try:
        law = LawFile.of(named, folder)
    except FlightError as error:
        raise InvalidSettingsError((f"{place}: {error}",)) from None
    name = named.rpartition(":")[2]
    if not NAME.fullmatch(name):
        rule = "must have a class of at most 40 letters, digits and _: results are named after it"
        raise InvalidSettingsError((f"{place}: {echo(named)} {rule}",))
    return Entrant(name, "law", law=law)


def _explain(details: ErrorDetails, model: type[FileSection]) -> str:
    """Return a message that names a wrong key, its value and the rule."""
    names = [str(part) for part in details["loc"]]
    dotted = echo(".".join(names))
    value = format_value(details["input"])
    match details["type"]:
        case "extra_forbidden":
            return _explain_unknown(names, dotted, model)
        case "model_type" | "dict_type":
            return f"{dotted} = {value} must be a section; write [{dotted}] and its keys below"
        case "greater_than_equal" | "less_than_equal" if all(isinstance(one, str) for one in details["loc"]):
            limits = _section(names, model).model_fields[names[-1]].metadata
            low, high = (next(getattr(m, k) for m in limits if hasattr(m, k)) for k in ("ge", "le"))
            return f"{dotted} = {value} must lie in {low}..{high}"
        case _:
            return f"{dotted} = {value} {details['msg'].replace('Input should', 'must')}"


def _section(names: Sequence[str], model: type[FileSection]) -> Any:
    """Return the model of the section to which the key at the path `names` belongs.

    The names of sections of one kind, as in dict[str, Section], are free; in a list they are its indices.
    """
    section: Any = model
    for name in names[:-1]:
        inner = get_args(section)
        one = inner[0] if get_origin(section) is tuple else inner[-1] if inner else None
        section = section.model_fields[name].annotation if one is None else one
    return section


def _explain_unknown(names: Sequence[str], dotted: str, model: type[FileSection]) -> str:
    """Return a message that a key does not exist, with similar keys that do."""
    keys = list(_section(names, model).model_fields)
    near = [key for key in keys if key.startswith(f"{names[-1]}_")]
    near = near or difflib.get_close_matches(names[-1], keys, n=1)
    what = "parameter" if names[0] == "draws" and len(names) == 2 else "key of this file"
    choice = f"did you mean {', '.join(near)}?" if near else f"there are {', '.join(keys)}"
    return f"{dotted} is not a {what}; {choice}"


def format_value(value: object) -> str:
    """Return a value in about the notation of TOML, shortened, for messages."""
    if isinstance(value, dict) and len(value) == 1:
        ((key, inner),) = value.items()
        return f"{{ {echo(str(key))} = {echo_value(inner)} }}"
    return echo_value(value)
