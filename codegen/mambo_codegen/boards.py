"""Boards: TOML files with the core, memory, compiler and budget of a board.

Each section states the source of its values and how reliable they are. A file by the user has the same form.
It need not be trusted: it chooses a compiler on the PATH and flags for core and FPU, but names no other
program and no file.
"""

import difflib
import re
from collections.abc import Sequence
from typing import Annotated, Any, Final, Generic, Literal, TypeVar, get_args

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

from mambo_codegen.errors import InvalidSettingsError, echo, echo_value
from mambo_codegen.settings.toml_file import BOARDS, parse_document, read_text

_PYDANTIC_SUBJECTS: Final = ("Input should", "String should", "Tuple should")

Value = TypeVar("Value")


def _matching(pattern: str, rule: str) -> AfterValidator:
    """Return a validator that refuses text unless `pattern` matches all of it; `rule` ends the message."""

    def check(text: str) -> str:
        if not re.fullmatch(pattern, text, re.ASCII):
            raise PydanticCustomError("text", f"must be {rule}")
        return text

    return AfterValidator(check)


def _printable(text: str) -> str:
    """Refuse control characters, which could write to the terminal, and line ends."""
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

_LIST: Final = Field(strict=False)
Commands = Annotated[tuple[Command, ...], _LIST]
Packages = Annotated[tuple[Words, ...], _LIST]
Flags = Annotated[tuple[Flag, ...], _LIST]
Libraries = Annotated[tuple[Library, ...], _LIST]


class _BoardSection(BaseModel):
    """Base of all sections: frozen, without unknown keys and implicit conversion, with a source."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)

    source: Words = Field(description="where the values of this section come from")
    confidence: Literal["high", "medium", "low"] = Field(description='reliability: "high", "medium" or "low"')


class Fact(_BoardSection, Generic[Value]):
    """One value of a board."""

    value: Value = Field(description="the value itself, in the unit that the section's name ends in")


class Compiler(_BoardSection):
    """Compiler and flags for a board."""

    candidates: Commands = Field(min_length=1, description="compilers; the first one on the PATH is used")
    packages: Packages = Field(min_length=1, description="Debian packages that contain one of the candidates")
    flags: Flags = Field(description="flags for compiling and linking: core, FPU, dialect")
    link_flags: Flags = Field((), description="further flags for linking the firmware")
    libraries: Libraries = Field(("-lgcc",), description="libraries of the compiler's helper functions")

    @property
    def common(self) -> str:
        """The candidate that is in Debian's packages, or else the first."""
        for candidate in self.candidates:
            if f"gcc-{candidate.removesuffix('-gcc')}" in self.packages:
                return candidate
        return self.candidates[0]


MODELLED: Final = ("cortex-m0", "cortex-m4", "avr")
"""Emulated cores whose cycles are modelled from their manuals, if the board's file has no [cycles]."""


class CycleEstimate(_BoardSection):
    """Estimate of clock cycles from an instruction count, with warm caches and prefetch buffers."""

    per_instruction: float = Field(gt=0, le=100, description="mean clock cycles per instruction")
    error_share: Share = Field(description="half-width of the band around the estimate, as a share of it")


class FlashWait(_BoardSection):
    """Wait states of the flash, behind caches that replace the line used longest ago."""

    cycles_per_line: int = Field(ge=1, le=10_000, description="clock cycles that the core waits for a line")
    line_bytes: int = Field(ge=2, le=4096, description="line of the flash and of its caches, in bytes")
    code_lines: int = Field(ge=1, le=2**20, description="lines of code in the cache; 1 without a cache")
    data_lines: int = Field(ge=1, le=2**20, description="lines of constants in the cache; 1 without a cache")


class Budget(_BoardSection):
    """Limits of a controller on a board."""

    flash_bytes: Bytes = Field(description="code and constants with the compiler's helpers, in bytes")
    ram_bytes: Bytes = Field(description="static memory with the controller's instance, in bytes")
    stack_bytes: Bytes = Field(description="stack of one step, in bytes, on top of ram_bytes")
    period_share: Share = Field(description="time of one step, as a share of the update period")


class Board(BaseModel):
    """A board; its name is the stem of its file."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: Words = Field(description="the stem of the file")
    title: Words = Field(description="the name of the board in full")
    core: Fact[Words] = Field(description="the core and its architecture")
    fpu: Fact[Literal["none", "single", "double"]] = Field(
        description="the widest floating-point format that the core computes itself"
    )
    emulated_core: Fact[
        Literal["arm926", "cortex-m0", "cortex-m3", "cortex-m4", "cortex-m7", "cortex-m33", "rv32", "avr"]
    ] = Field(description="the emulated core that runs the same instructions")
    clock_hz: Fact[Annotated[int, Field(ge=1, le=10**11)]] = Field(description="clock of the core, in hertz")
    flash_bytes: Fact[Bytes] = Field(description="memory for code and constants, in bytes")
    ram_bytes: Fact[Bytes] = Field(description="memory for data and stack, in bytes")
    compiler: Compiler = Field(description="compiler and flags")
    cycles: CycleEstimate | None = Field(
        None,
        validate_default=True,
        description="estimate of clock cycles from instructions; without it the model of the core",
    )
    flash_wait: FlashWait | None = Field(
        None, description="wait states of the flash, for the model; without it there are none"
    )
    budget: Budget = Field(description="limits of a controller on the board")

    @field_validator("cycles")
    @classmethod
    def _estimated_without_a_model(
        cls, cycles: CycleEstimate | None, info: ValidationInfo
    ) -> CycleEstimate | None:
        core = info.data.get("emulated_core")
        if cycles is None and core is not None and core.value not in MODELLED:
            raise PydanticCustomError("cycles", f"add it: {core.value} has no model of its cycles")
        return cycles

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

    def is_called(self, words: str) -> bool:
        """Return whether title or core contain `words`, as in STM32F405."""
        return bool(words) and (words in self.title or words in self.core.value)


def names() -> tuple[str, ...]:
    """Return the names of the boards, sorted."""
    return BOARDS.names()


def load(name_or_path: str) -> Board:
    """Return the board of that name, or else the one in the file at that path (./mambo is a file).

    Raises SourceNotFoundError if there is neither, UnreadableFileError if the file is not TOML, and
    InvalidSettingsError with all broken rules.
    """
    path = BOARDS.own_file(name_or_path)
    if path is None:
        return _parse(BOARDS.text(name_or_path), f"board {name_or_path}", name_or_path)
    return _parse(read_text(path), echo(name_or_path), path.stem)


def called(words: str) -> tuple[Board, ...]:
    """Return the named boards whose title or core contain `words`."""
    return tuple(board for board in map(load, names()) if board.is_called(words))


def _parse(text: str, source: str, name: str) -> Board:
    """Return the board in `text`; `source` begins every error message."""
    document = parse_document(text, source)
    if "name" in document:
        raise InvalidSettingsError(
            (f"{source}: name is not a key of a board; remove it, the file name is the name",)
        )
    try:
        return Board.model_validate({"name": name, **document})
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
        # Pydantic also says of a list whose items are wrong that it is too short.
        wrong_items = {one["loc"][:-1] for one in details}
        faults = [one for one in details if not (one["type"] == "too_short" and one["loc"] in wrong_items)]
        raise InvalidSettingsError(tuple(f"{source}: {_fault(one)}" for one in faults)) from None


def _fault(details: ErrorDetails) -> str:
    """Return a message with key, value and rule."""
    *section, key = details["loc"]
    dotted = echo(".".join(str(part) for part in details["loc"]))
    match details["type"]:
        case "missing":
            return f"{dotted} is missing; add it: {_fields(section)[str(key)].description}"
        case "extra_forbidden":
            keys = _fields(section)
            near = difflib.get_close_matches(str(key), keys, n=1)
            return f"{dotted} is not a key of a board; " + (
                f"did you mean {near[0]}?" if near else f"its keys are {', '.join(keys)}"
            )
        case "model_type":
            value = echo_value(details["input"])
            return f"{dotted} = {value} must be a section; write [{dotted}] and its keys below"
        case "budget":
            return f"{dotted}.{details['msg']}"
        case "cycles":
            return f"{dotted} is missing; {details['msg']}"
        case _:
            rule = details["msg"]
            for subject in _PYDANTIC_SUBJECTS:
                rule = rule.replace(subject, "must")
            return f"{dotted} = {echo_value(details['input'])} {rule}"


def _fields(section: Sequence[int | str]) -> dict[str, Any]:
    """Return the fields of a section, or of a board if `section` is empty."""
    model: Any = Board
    for part in section:
        annotation = model.model_fields[part].annotation
        model = next((one for one in get_args(annotation) if one is not type(None)), annotation)
    return {key: field for key, field in model.model_fields.items() if key != "name"}
