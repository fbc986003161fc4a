"""The C of the subject, read from its bundle and built for this machine."""

import re

from mambo_nmpc.codegen.toolchain import host_toolchain
from mambo_nmpc.sil.controllers.compiled import CompiledController, build_extension
from mambo_nmpc.sil.controllers.extension import load_extension
from mambo_nmpc.sil.verify.check import Subject


def library(subject: Subject) -> dict[str, str]:
    """Return {path: text} of the C files in the subject's bundle, the example left out."""
    files = {
        path.relative_to(subject.bundle).as_posix(): path.read_text("utf-8")
        for path in sorted(subject.bundle.rglob("*.[ch]"))
    }
    return {path: text for path, text in files.items() if re.match(r"(include|src)/", path)}


def controller(subject: Subject, n: int) -> CompiledController:
    """Return n controllers of the C in the subject's bundle; raises BuildError and CacheError.

    The extension knows no prefix but nmpc: a bundle with another is generated anew under that name.
    """
    settings = subject.settings
    if settings.code.prefix != "nmpc":
        return CompiledController(settings, n, build_extension(settings, host_toolchain()))
    extension = load_extension(library(subject), settings.code.scalar, host_toolchain())
    return CompiledController(settings, n, extension)
