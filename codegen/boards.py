"""The named boards: TOML files with what a board has, how C is built for it, what a controller may take.

Every section of such a file says where its values come from and how sure they are. A file of one's own in the
same shape is as good as a named board, and need not be trusted: it chooses among compilers on the PATH and
for which core they build, but can run no other program and name no file.
"""

import difflib
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Final, Generic, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from mambo_nmpc.codegen.errors import InvalidSettingsError, SourceNotFoundError, echo, echo_value
from mambo_nmpc.codegen.settings.toml_file import parse_document, read_text

_FOLDER = resources.files("mambo_nmpc.codegen") / "data" / "boards"
_PYDANTIC_SUBJECTS: Final = ("Input should", "String should", "Tuple should")

Value = TypeVar("Value")


def _matching(pattern: str, rule: str) -> AfterValidator:
    """Refuse text that `pattern` does not match as a whole; `rule` says what it must be."""

    def check(text: str) -> str:
        if not re.fullmatch(pattern, text, re.ASCII):
            raise PydanticCustomError("text", f"must be {rule}")
        return text

    return AfterValidator(check)


def _printable(text: str) -> str:
    """Refuse what moves the cursor of a terminal or breaks a line."""
    if not text.isprintable():
        raise PydanticCustomError("text", "must be printable, without line ends and control characters")
    return text


Words = Annotated[str, Field(min_length=1), AfterValidator(_printable)]
Command = Annotated[
    str,
    _matching(
        r"([\w.]+-)*(gcc|cc|clang)(-[\w.]+)?",
        "the name of a GCC or Clang on the PATH, as in arm-none-eabi-gcc",
    ),
]
Flag = Annotated[
    str,
    _matching(
        r"-m[\w=+.,-]+|-f[\w-]+|-std=[\w+]+|--target=[\w.-]+|-shared",
        "a flag for core, FPU or dialect: -m..., -f... without a value, -std=, --target= or -shared",
    ),
]
Library = Annotated[str, _matching(r"-l[\w.+-]+", "a library, as in -lgcc")]
Bytes = Annotated[int, Field(ge=1, le=2**40)]
Share = Annotated[float, Field(gt=0, le=1)]

_MANY: Final = Field(strict=False)
Commands = Annotated[tuple[Command, ...], _MANY]
Packages = Annotated[tuple[Words, ...], _MANY]
Flags = Annotated[tuple[Flag, ...], _MANY]
Libraries = Annotated[tuple[Library, ...], _MANY]


class _BoardSection(BaseModel):
    """What all sections share: frozen, no unknown keys, no silent conversion, and a source."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    source: Words = Field(description="where the values of this section come from")
    confidence: Literal["high", "medium", "low"] = Field(description='how sure: "high", "medium" or "low"')


class Fact(_BoardSection, Generic[Value]):
    """One value of a board."""

    value: Value = Field(description="the value itself, in the unit that the section's name ends in")


class Compiler(_BoardSection):
    """How C is built for a board."""

    candidates: Commands = Field(min_length=1, description="commands, the first that is there is taken")
    packages: Packages = Field(min_length=1, description="Debian packages that bring one of the candidates")
    flags: Flags = Field(description="what compiling and linking add: core, FPU, dialect")
    link_flags: Flags = Field((), description="what linking for the firmware adds to that")
    libraries: Libraries = Field(("-lgcc",), description="libraries that hold the compiler's own helpers")

    @property
    def common(self) -> str:
        """The candidate that Debian's packages bring, or else the first."""
        for candidate in self.candidates:
            if f"gcc-{candidate.removesuffix('-gcc')}" in self.packages:
                return candidate
        return self.candidates[0]


class Cycles(_BoardSection):
    """A clock cycle estimate from an instruction count, for caches and prefetch buffers that are warm."""

    per_instruction: float = Field(gt=0, le=100, description="clock cycles an instruction, on average")
    error_share: Share = Field(description="half-width of the estimate's band, as a share of it")


class Budget(_BoardSection):
    """What a controller may take of a board."""

    flash_bytes: Bytes = Field(description="code and constants, the compiler's helpers included, in bytes")
    ram_bytes: Bytes = Field(description="static memory, the controller's instance included, in bytes")
    stack_bytes: Bytes = Field(description="stack of one step, in bytes, on top of ram_bytes")
    period_share: Share = Field(description="time of one step, as a share of the update period")


class Board(BaseModel):
    """A board; `name` is the stem of its file."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: Words = Field(description="the stem of the file")
    title: Words = Field(description="the name of the board in full")
    core: Fact[Words] = Field(description="the core and its architecture")
    fpu: Fact[Literal["none", "single", "double"]] = Field(
        description="the widest floating-point format that the core computes itself"
    )
    emulated_core: Fact[Literal["arm926", "cortex-m0", "cortex-m4", "cortex-m7", "rv32", "avr"]] = Field(
        description="the emulated core that runs the same instructions"
    )
    clock_hz: Fact[Annotated[int, Field(ge=1, le=10**11)]] = Field(description="clock of the core, in hertz")
    flash_bytes: Fact[Bytes] = Field(description="memory for code and constants, in bytes")
    ram_bytes: Fact[Bytes] = Field(description="memory for data and stack, in bytes")
    compiler: Compiler = Field(description="how C is built for the board")
    cycles: Cycles = Field(description="clock cycles estimated from instructions")
    budget: Budget = Field(description="what a controller may take of the board")

    @field_validator("budget")
    @classmethod
    def _within_the_board(cls, budget: Budget, info: ValidationInfo) -> Budget:
        flash, ram = info.data.get("flash_bytes"), info.data.get("ram_bytes")
        if flash is not None and budget.flash_bytes > flash.value:
            raise PydanticCustomError(
                "budget",
                f"flash_bytes = {budget.flash_bytes} must lie in 1..{flash.value} (flash_bytes.value)",
            )
        if ram is not None and budget.ram_bytes + budget.stack_bytes > ram.value:
            raise PydanticCustomError(
                "budget",
                f"ram_bytes + stack_bytes = {budget.ram_bytes + budget.stack_bytes} must lie in "
                f"2..{ram.value} (ram_bytes.value)",
            )
        return budget


def names() -> tuple[str, ...]:
    """Return the names of the boards, sorted."""
    return tuple(sorted(file.name.removesuffix(".toml") for file in _FOLDER.iterdir()))


def load(name_or_path: str) -> Board:
    """Return a named board, or else the one in the file at a path (./mambo is a file, mambo a board).

    Raises SourceNotFoundError if there is neither, UnreadableFileError for what is not TOML and
    InvalidSettingsError with every broken rule.
    """
    if name_or_path in names():
        text = (_FOLDER / f"{name_or_path}.toml").read_text("utf-8")
        return _parse(text, f"board {name_or_path}", name_or_path)
    path = Path(name_or_path)
    try:
        found = path.exists()
    except OSError:
        found = False
    if not found:
        raise _not_found(name_or_path)
    return _parse(read_text(path), echo(name_or_path), path.stem)


def _parse(text: str, source: str, name: str) -> Board:
    """Return the board in `text`; `source` begins every message."""
    document = parse_document(text, source)
    if "name" in document:
        raise InvalidSettingsError(
            (f"{source}: name is not a key of a board, the file's name is; leave it out",)
        )
    try:
        return Board.model_validate({"name": name, **document})
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
        raise InvalidSettingsError(tuple(f"{source}: {_fault(one)}" for one in details)) from None


def _fault(details: ErrorDetails) -> str:
    """Say which key is wrong, with its value, and what to write instead."""
    *section, key = details["loc"]
    dotted = echo(".".join(str(part) for part in details["loc"]))
    match details["type"]:
        case "missing":
            return f"{dotted} is missing; add it: {_fields(section)[str(key)].description}"
        case "extra_forbidden":
            keys = _fields(section)
            near = difflib.get_close_matches(str(key), keys, n=1)
            return f"{dotted} is not a key of a board; " + (
                f"did you mean {near[0]}?" if near else f"there are {', '.join(keys)}"
            )
        case "model_type":
            value = echo_value(details["input"])
            return f"{dotted} = {value} must be a section; write [{dotted}] and its keys below"
        case "budget":
            return f"{dotted}.{details['msg']}"
        case _:
            rule = details["msg"]
            for subject in _PYDANTIC_SUBJECTS:
                rule = rule.replace(subject, "must")
            return f"{dotted} = {echo_value(details['input'])} {rule}"


def _fields(section: Sequence[int | str]) -> dict[str, Any]:
    """Return the fields that a section has, or a board for no section."""
    model: Any = Board
    for part in section:
        model = model.model_fields[part].annotation
    return {key: field for key, field in model.model_fields.items() if key != "name"}


def _not_found(name: str) -> SourceNotFoundError:
    near = difflib.get_close_matches(name, names(), n=1)
    guess = f" (did you mean {near[0]}?)" if near else ""
    return SourceNotFoundError(
        f"{echo(name)} is neither a board nor a file{guess}; boards are {', '.join(names())}, "
        "and a TOML file of the same shape describes another"
    )
