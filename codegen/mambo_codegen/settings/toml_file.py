"""Find and read TOML files, shipped ones and the user's, with messages that name file and line."""

import difflib
import re
import tomllib
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Final

from mambo_codegen.errors import SourceNotFoundError, UnreadableFileError, echo
from mambo_codegen.plain_file import guess_name, read_plain_file

LARGEST_FILE_BYTES = 64_000

_PLACE = re.compile(r"(?P<reason>.*) \(at (?P<place>line (?P<line>\d+), column \d+)\)", re.DOTALL)


@dataclass(frozen=True)
class ShippedFiles:
    """The TOML files of a kind that a package holds in data/`kind`, beside which a user has files of his own.

    one, several: what messages call them, such as "a preset" and "presets".
    advice:       how to come by another one.
    """

    kind: str
    one: str
    several: str
    advice: str
    package: str = "mambo_codegen"

    def names(self) -> tuple[str, ...]:
        """Return the names of the files, sorted."""
        return tuple(self._files())

    def text(self, name: str) -> str:
        """Return the text of the file `name`; raises SourceNotFoundError."""
        return self.file(name).read_text("utf-8")

    def file(self, name: str) -> Traversable:
        """Return the file `name`; raises SourceNotFoundError."""
        files = self._files()
        if name not in files:
            raise self._not_found(name, f"not {self.one}")
        return files[name]

    def description(self, name: str) -> str:
        """Return the first line of the file `name`, which is a comment; raises SourceNotFoundError."""
        return self.text(name).splitlines()[0].removeprefix("# ")

    def own_file(self, name_or_path: str) -> Path | None:
        """Return the path of the user's file; None for the name of a shipped one.

        `mambo` is the shipped one, `./mambo` a file. Raises SourceNotFoundError if there is neither.
        """
        if name_or_path in self.names():
            return None
        path = existing_path(name_or_path)
        if path is None:
            raise self._not_found(name_or_path, f"neither {self.one} nor a file")
        return path

    def _files(self) -> dict[str, Traversable]:
        """Return the files by name, sorted."""
        folder = resources.files(self.package) / "data" / self.kind
        files = {file.name.removesuffix(".toml"): file for file in folder.iterdir()}
        return dict(sorted(files.items()))

    def _not_found(self, name: str, what: str) -> SourceNotFoundError:
        names = self.names()
        near = [f" (did you mean {one}?)" for one in difflib.get_close_matches(name, names, n=1)]
        beside = [guess_name(Path(name))]
        guess = next(filter(None, [*beside, *near] if Path(name).suffix else [*near, *beside]), "")
        return SourceNotFoundError(
            f"{echo(name)} is {what}{guess}; {self.several} are {', '.join(names)}, and {self.advice}"
        )


PRESETS: Final = ShippedFiles(
    "presets", "a preset", "presets", "`mambo-nmpc init` writes a controller.toml to start from"
)
BOARDS: Final = ShippedFiles("boards", "a board", "boards", "a TOML file of the same shape describes another")


def existing_path(text: str) -> Path | None:
    """Return the path in `text` if something is there, else None."""
    try:
        return path if (path := Path(text)).exists() else None
    except OSError:  # too long a name, for example
        return None


def read_text(path: Path) -> str:
    """Return the text of the file at `path`; raises UnreadableFileError."""
    name = echo(str(path))
    try:
        content = read_plain_file(path, LARGEST_FILE_BYTES + 1)
    except FileNotFoundError:
        raise UnreadableFileError(f"{name}: there is no such file{guess_name(path)}") from None
    except IsADirectoryError:
        raise UnreadableFileError(f"{name}: is a folder; name a TOML file in it") from None
    except OSError as error:
        raise UnreadableFileError(f"{name}: cannot be read: {error.strerror}") from error
    if len(content) > LARGEST_FILE_BYTES:
        raise UnreadableFileError(f"{name}: is larger than 64 kB; a settings file needs a few kB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UnreadableFileError(f"{name}: line {line}: is not UTF-8; save the file as UTF-8") from None


def parse_document(text: str, source: str) -> dict[str, Any]:
    """Parse TOML; `source` begins every message. Raises UnreadableFileError."""
    try:
        return tomllib.loads(text + "\n")  # without "\n" a fault at the end has no line number
    except RecursionError:
        raise UnreadableFileError(
            f"{source}: is nested too deeply; write [section] and key = value"
        ) from None
    except ValueError as error:
        raise UnreadableFileError(f"{source}: {_syntax_fault(str(error), text)}") from None


def _syntax_fault(message: str, text: str) -> str:
    """Put the line number that tomllib reports at the front, as compilers do, and quote the line."""
    found = _PLACE.fullmatch(message)
    if found is None:
        return f"is not TOML: {echo(message)}"
    advice = "; write each section and key once" if found["reason"].startswith("Cannot") else ""
    line = text.split("\n")[int(found["line"]) - 1].strip()
    return f"{found['place']}: {echo(found['reason'])}{advice}: {echo(line)}"
