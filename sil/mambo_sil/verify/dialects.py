"""Check: no compiler warns about the C, in any dialect in which firmware is built."""

from dataclasses import dataclass
from typing import Final

from mambo_codegen.bundle.flags import WARNING_FLAGS
from mambo_codegen.settings.model import Settings
from mambo_sil.results.build_folders import scratch_folder
from mambo_sil.verify.check import Result, Subject, combine
from mambo_sil.verify.tools import missing, run

_UNSUFFIXED: Final = "-Wunsuffixed-float-constants"
_CXX: Final = ("-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wundef")


@dataclass(frozen=True)
class Dialect:
    """A compiler, the Debian package that has it, and flags; warnings are errors."""

    compiler: str
    package: str
    flags: tuple[str, ...]

    def command(self, settings: Settings) -> list[str]:
        """Return compiler and flags, without the check of suffixes except in float32: double has none."""
        suffixes = settings.code.scalar == "float32"
        flags = [flag for flag in self.flags if suffixes or flag != _UNSUFFIXED]
        return [self.compiler, *flags, "-Werror", "-O2", "-ffp-contract=off"]


DIALECTS: Final = {
    "gnu89 of the Mambo's compiler": Dialect("gcc", "gcc", ("-std=gnu89", "-Wall", "-fPIC")),
    "c99": Dialect("gcc", "gcc", ("-std=c99", *WARNING_FLAGS, _UNSUFFIXED)),
    "c11": Dialect("gcc", "gcc", ("-std=c11", *WARNING_FLAGS, _UNSUFFIXED)),
    "c99 clang": Dialect("clang", "clang", ("-std=c99", *WARNING_FLAGS)),
    "c++11": Dialect("g++", "g++", ("-xc++", "-std=c++11", *_CXX)),
    "c++20 clang": Dialect("clang++", "clang", ("-xc++", "-std=c++20", *_CXX)),
}


def check(subject: Subject) -> Result:
    """Compile library, self-test, example and proof in every dialect; any warning is a fault."""
    bundle = subject.bundle.resolve()
    sources = sorted(path for part in (".", "example", "proof") for path in (bundle / part).glob("*.c"))
    gaps, silent, faults = [], [], []
    log = []
    for name, dialect in DIALECTS.items():
        gap = missing(dialect.compiler, dialect.package)
        if gap:
            gaps.append(gap)
            continue
        command = dialect.command(subject.settings)
        with scratch_folder() as objects:
            done = run(
                [*command, f"-I{bundle}", "-c", *map(str, sources)],
                objects,
            )
        said = (done.stdout + done.stderr).replace(f"{bundle}/", "")
        log.append(f"{name}: {' '.join(command)}\n{said}exit code {done.returncode}\n")
        if done.returncode == 0 and not said:
            silent.append(name)
        else:
            first = next((line for line in said.splitlines() if "error" in line or "warning" in line), said)
            faults.append(f"{name}: {first or f'exit code {done.returncode}'}")
    (subject.folder / "compilers.txt").write_text("\n".join(log), "utf-8")
    counted = f"{len(sources)} files, {len(silent)} of {len(DIALECTS)} dialects without a warning"
    return combine(faults, gaps, counted, {"files": len(sources), "silent": silent, "faults": faults})
