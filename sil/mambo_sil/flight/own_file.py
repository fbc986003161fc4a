"""An object of a class in a file of the user's, FILE.py:CLASS, such as a law or a curve."""

import hashlib
import importlib.util
import sys
from pathlib import Path
from typing import Any

from mambo_codegen.errors import echo
from mambo_sil.errors import FlightError


def whole_name(named: str, folder: Path = Path()) -> str:
    """Return FILE.py:CLASS, or a file, beside `folder` with its whole path."""
    file, colon, name = named.rpartition(":") if ".py:" in named else (named, "", "")
    return f"{(folder / file).resolve()}{colon}{name}"


def load_object(named: str) -> tuple[Any, str]:
    """Return a new object, and the SHA-256 of its file and of the modules beside it that it imports.

    These are not kept: another file may have others of the same names. Raises FlightError, in one sentence,
    for whatever is wrong with the file or the class.
    """
    file, _, name = named.rpartition(":")
    path, before = Path(file), set(sys.modules)
    module_name = f"own_{path.stem}"  # a file numpy.py takes nobody's place
    spec = importlib.util.spec_from_file_location(module_name, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise FlightError(f"{echo(named)}: there is no file {echo(file)}")
    module = importlib.util.module_from_spec(spec)
    folder = path.resolve().parent
    sys.modules[module_name] = module
    sys.path.insert(0, str(folder))
    try:
        spec.loader.exec_module(module)
        if not hasattr(module, name):
            raise FlightError(f"{echo(named)}: the file has no {echo(name)}")
        made = getattr(module, name)()
    except FlightError:
        raise
    except (Exception, SystemExit) as error:
        raise FlightError(f"{echo(named)}: {type(error).__name__}: {echo(str(error))}") from error
    finally:
        sys.path.remove(str(folder))
        beside = {
            one: Path(source)
            for one in set(sys.modules) - before
            if (source := getattr(sys.modules[one], "__file__", None)) and folder in Path(source).parents
        }
        for one in beside:
            del sys.modules[one]
    digest = hashlib.sha256(path.read_bytes())
    for one in sorted(beside.keys() - {module_name}):
        digest.update(beside[one].read_bytes())
    return made, digest.hexdigest()
