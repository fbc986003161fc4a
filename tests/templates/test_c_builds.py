"""The generated C as firmware people build it: dialects, warnings, symbols, two controllers in one image."""

import contextlib
import itertools
import re
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.digest import self_test_digest
from mambo_codegen.bundle.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.dialects import DIALECTS
from tests.support.bundles import place
from tests.support.cases import SCALARS, settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import CORNER_SETTINGS, quadratic_case, quadratic_settings
from tests.support.tools import require

STRICT = [*WARNING_FLAGS, "-Werror"]
GCC_STRICT = [*STRICT, "-Wunsuffixed-float-constants"]
SETTINGS = {name: presets.load(name) for name in presets.names()} | {
    f"case {index}": settings_case(index, "float32") for index in (0, 3, 9)
}
SETTINGS |= {f"fixed case {index}": settings_case(index, "fixed") for index in (0, 3, 9)} | {
    f"{scalar} {name}": with_option(presets.load(name), "code.scalar", scalar, "test")
    for name in presets.names()
    for scalar in ("fixed", "float64")
}
SETTINGS |= {
    f"quadratic case {index}": quadratic_case(index, ("float32", "float64")[index % 2])
    for index in range(len(CORNER_SETTINGS))
}
SYSTEM_HEADERS = """
    assert complex ctype dirent dlfcn errno fcntl fenv float fmtmsg glob iconv inttypes limits locale
    math mqueue netinet/in poll pthread regex sched semaphore setjmp signal spawn stdarg stdatomic
    stdbool stddef stdint stdio stdlib string strings sys/mman sys/resource sys/select sys/shm
    sys/socket sys/stat sys/time sys/types sys/wait termios threads time uchar unistd wchar wctype
    wordexp
"""


def by_default(*names: str, of: Iterable[str] = SETTINGS) -> list[Any]:
    """Return the names in `of` as parameters, marked as long except `names`."""
    return [pytest.param(name, marks=[] if name in names else [pytest.mark.long]) for name in of]


COMPILER_HELPERS = {"memcpy", "memset"}


def placed(settings: Settings, folder: Path) -> Path:
    """Write the bundle of `settings` into `folder`, and return it."""
    return place(render(settings), folder)


def named(prefix: str, preset: str = "mambo") -> Settings:
    """Return a preset with a prefix."""
    return with_option(presets.load(preset), "code.prefix", prefix)


@pytest.fixture
def mambo(tmp_path: Path) -> Path:
    """Return a folder with the bundle of preset mambo."""
    return placed(ONE_NORM, tmp_path)


def refused(*command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command that must fail; returns what it said."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    return done


def shell(*command: str | Path, folder: Path) -> str:
    """Run a command that must succeed without a word on stderr; returns what it printed."""
    done = subprocess.run(
        [str(word) for word in command], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def dialects_by_turns() -> list[tuple[str, str]]:
    """Return names of settings and dialects: all for presets, and for one in every scalar type; else two."""
    turns, pairs = itertools.cycle(DIALECTS), []
    for name in SETTINGS:
        whole = name in presets.names() or name.endswith(" mambo")
        chosen = DIALECTS if whole else (next(turns), next(turns))
        pairs += [(name, dialect) for dialect in sorted(chosen)]
    return sorted(pairs, key=lambda pair: pair[0] != "mambo")


@pytest.mark.sampled(6)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(("name", "dialect"), dialects_by_turns())
def test_every_dialect_builds_without_a_word(name: str, dialect: str, tmp_path: Path) -> None:
    """All warnings on and fatal, library, self-test, example and proof; with clang what it fuzzes, too."""
    chosen = DIALECTS[dialect]
    require(chosen.compiler, chosen.package)
    sources = sorted(placed(SETTINGS[name], tmp_path).rglob("*.c"))
    if not chosen.compiler.startswith("clang"):
        sources = [path for path in sources if path.parent.name != "fuzz"]
    shell(*chosen.command(SETTINGS[name]), "-I.", "-c", *sources, folder=tmp_path)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", by_default("mambo", "fixed mambo"))
def test_the_objects_need_nothing_from_outside(name: str, tmp_path: Path) -> None:
    """Every undefined symbol is defined by another object of the bundle, or is a helper of the compiler."""
    require("nm", "binutils")
    placed(SETTINGS[name], tmp_path)
    shell("gcc", "-std=c99", "-O2", "-c", *sorted(tmp_path.glob("*.c")), folder=tmp_path)
    objects = sorted(tmp_path.glob("*.o"))
    undefined = set(re.findall(r" U (\w+)", shell("nm", *objects, folder=tmp_path)))
    defined = set(re.findall(r" [TRD] (\w+)", shell("nm", *objects, folder=tmp_path)))
    assert undefined - defined <= COMPILER_HELPERS
    assert all(symbol.startswith("nmpc_") for symbol in defined)
    assert not re.findall(r" [bBdDC] \w+", shell("nm", *objects, folder=tmp_path)), "writable static memory"


@pytest.mark.long
def test_two_prefixes_live_in_one_image(tmp_path: Path) -> None:
    """Two controllers of different settings link into one program, and both pass their self-test."""
    require("gcc", "gcc")
    for prefix, preset in (("left", "mambo"), ("right_wing", "table1")):
        placed(named(prefix, preset), tmp_path / prefix)
    (tmp_path / "main.c").write_text(
        '#include "left_self_test.h"\n#include "right_wing_self_test.h"\n'
        "static left_t one;\nstatic right_wing_t two;\n"
        "int main(void)\n{\n    return left_self_test(&one) + right_wing_self_test(&two);\n}\n"
    )
    includes = ["-Ileft", "-Iright_wing"]
    sources = sorted(tmp_path.glob("*/*.c"))
    flags = [*COMPILE_FLAGS, *GCC_STRICT, *includes]
    shell("gcc", *flags, *sources, "main.c", "-o", "image", folder=tmp_path)
    shell("./image", folder=tmp_path)


def test_no_prefix_that_is_admitted_takes_a_name_of_the_system(tmp_path: Path) -> None:
    """pid_t, sem_init or R_OK would be declared twice wherever the system's headers are included too."""
    require("gcc", "gcc")
    headers = "".join(
        f"#if __has_include(<{name}.h>)\n#include <{name}.h>\n#endif\n" for name in SYSTEM_HEADERS.split()
    )
    (tmp_path / "all.c").write_text(headers)
    taken = set()
    for mode in ("-P", "-dM"):
        taken |= set(re.findall(r"\b[A-Za-z]\w*", shell("gcc", "-E", mode, "all.c", folder=tmp_path)))
    library = "\n".join(text for path, text in render(Settings()).items() if path.endswith((".c", ".h")))
    ours = set(re.findall(r"\b(?:nmpc|NMPC)(?:_(?!sign)\w+)", library))  # lconv has a member negative_sign
    assert {"nmpc_t", "nmpc_init", "NMPC_OK"} <= ours
    endings = {name[len("nmpc") :] for name in ours}
    prefixes = {
        name.removesuffix(ending).lower() for name in taken for ending in endings if name.endswith(ending)
    }
    admitted = []
    for prefix in sorted(prefixes):
        with contextlib.suppress(InvalidSettingsError):
            with_option(Settings(), "code.prefix", prefix, "")
            admitted.append(prefix)
    assert admitted == []


@pytest.mark.long
def test_the_bundle_builds_and_runs_its_example(tmp_path: Path) -> None:
    """`make run`: the self-test passes and the point mass closes in on its target."""
    require("make", "make")
    placed(named("drone"), tmp_path)
    printed = shell("make", "-s", "run", folder=tmp_path)
    assert "self-test: all steps equal the reference" in printed
    digest = self_test_digest(method_of(presets.load("mambo")), 1000)
    assert f"digest: 0x{digest:08X} after 100000 steps\n" in printed
    last = [float(word) for word in printed.splitlines()[-1].split()]
    assert abs(last[1] - last[3]) < 0.05
    assert abs(last[2] - 1.0) < 0.05
    shell("make", "-s", "clean", folder=tmp_path)
    assert not (tmp_path / "build").exists()


@pytest.mark.sampled(2)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "settings",
    [
        *(with_option(ONE_NORM, "code.scalar", scalar, "test") for scalar in SCALARS),
        quadratic_settings("float32"),
        quadratic_settings("float64"),
    ],
    ids=[*SCALARS, "quadratic", "quadratic float64"],
)
def test_what_compilers_other_than_gcc_and_clang_get_has_the_same_bits(
    settings: Settings, tmp_path: Path
) -> None:
    """They lack operations that gcc and clang have, and loops written out."""
    require("gcc", "gcc")
    sources = sorted(placed(settings, tmp_path).glob("*.c"))
    gcc = ("gcc", *COMPILE_FLAGS, "-I.")
    shell(*gcc, "-U__GNUC__", "-c", *sources, folder=tmp_path)
    objects = sorted(tmp_path.glob("*.o"))
    assert len(objects) == len(sources)
    shell(*gcc, "example/main.c", *objects, "-o", "main", folder=tmp_path)
    printed = shell(tmp_path / "main", folder=tmp_path)
    assert f"digest: 0x{self_test_digest(method_of(settings), 1000):08X} after 100000 steps\n" in printed


VARIANTS = Path(__file__).parent / "variants.c"


def variants_differ(folder: Path, right: str = "", wrong: str = "") -> str:
    """Return where the functions for gcc, with a fault, differ from those for other compilers."""
    require("clang", "clang")
    source = (placed(ONE_NORM, folder) / "nmpc.c").read_text("utf-8")
    text = source[source.index("/* ---- Numbers") : source.index("/* ---- Inputs")]
    functions = re.findall(r"^NMPC_INLINE \w+(?: \w+)* (\w+)\(", text, re.MULTILINE)
    assert {"within", "reaches", "absolute", "lowest_set_bit"} <= {*functions}
    plain = re.sub(rf"\b({'|'.join(functions)})\(", r"plain_\1(", text)
    plain = plain.replace("__GNUC__", "OTHER_COMPILER").replace("NMPC_TRAILING", "PLAIN_TRAILING")
    (folder / "plain.h").write_text(plain, "utf-8")
    assert right in text
    (folder / "functions.h").write_text(text.replace(right, wrong), "utf-8")
    flags = ["-std=c11", "-O3", "-Wall", "-Werror", "-I."]
    shell("clang", *flags, VARIANTS, "-o", "variants", folder=folder)  # vectorises what gcc 12 does not
    return subprocess.run([folder / "variants"], capture_output=True, text=True, check=False).stdout


@pytest.mark.long
def test_the_functions_that_the_proof_reads_equal_those_that_gcc_compiles(tmp_path: Path) -> None:
    """For all 2^32 floats, and all words of signs: the proof holds for what gcc and clang compile."""
    assert variants_differ(tmp_path) == ""


@pytest.mark.long
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("BITS(value) <= NMPC", "BITS(value) < NMPC"),
        ("BITS(value) >= NMPC", "BITS(value) > NMPC"),
        ("0x7FFFFFFFUL", "0x7FFFFFFEUL"),
        ("bits_of(value) <= bits_of(maximum)", "bits_of(value) < bits_of(maximum)"),
        ("return __builtin_fabsf(value)", "return value"),
        ("__builtin_ctzl(word)", "__builtin_ctzl(word << 1)"),
    ],
)
def test_a_fault_in_the_functions_for_gcc_is_found(right: str, wrong: str, tmp_path: Path) -> None:
    """In each of the four functions that the proof does not read."""
    assert "they differ for the" in variants_differ(tmp_path, right, wrong)


def test_another_digest_than_the_reference_s_fails_the_example(mambo: Path) -> None:
    """The example prints both digests, and stops."""
    require("make", "make")
    header = mambo / "nmpc_self_test.h"
    text = header.read_text()
    stated = re.findall(r"#define NMPC_SELF_TEST_DIGEST 0x(\w{8})UL\n", text)
    assert len(stated) == 1
    header.write_text(text.replace(stated[0], "0BADC0DE"))
    assert refused("make", "-s", "run", folder=mambo).stdout.splitlines()[2:] == [
        f"digest: 0x{stated[0]} after 100000 steps",
        "digest: the reference has 0x0BADC0DE",
    ]


@pytest.mark.long
def test_a_changed_header_is_built_anew(mambo: Path) -> None:
    """New settings over a built bundle: the objects follow the header, and the self-test passes."""
    require("make", "make")
    shell("make", folder=mambo)
    files = render(with_option(ONE_NORM, "horizon.prediction", 20))
    place({path: text for path, text in files.items() if (mambo / path).read_text() != text}, mambo)
    assert "all steps equal the reference" in shell("make", "-s", "run", folder=mambo)


def test_the_example_runs_whatever_the_ranges(tmp_path: Path) -> None:
    """Narrow ranges refuse inputs; the self-test expects that."""
    require("make", "make")
    narrow = {"thrust_acceleration_min_m_s2": 49.0, "position_m": 1.0, "velocity_m_s": 0.1}
    placed(Settings.model_validate({"ranges": narrow}), tmp_path)
    assert "all steps equal the reference" in shell("make", "-s", "run", folder=tmp_path)


@pytest.mark.long
def test_a_project_finds_the_bundle_that_cmake_built(tmp_path: Path) -> None:
    """The example passes its self-test; `find_package` brings library and headers, under the prefix."""
    require("cmake", "cmake")
    placed(named("drone"), tmp_path / "drone")
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.10)\nproject(firmware C)\n"
        "find_package(drone_controller REQUIRED)\nadd_executable(firmware main.c)\n"
        "target_link_libraries(firmware PRIVATE drone_controller)\n"
    )
    header = "drone_self_test.h"
    (tmp_path / "main.c").write_text(
        f'#include "{header}"\nint main(void) {{ drone_t one; return drone_self_test(&one); }}\n'
    )
    shell("cmake", "-S", "drone", "-B", "one", folder=tmp_path)
    shell("cmake", "--build", "one", folder=tmp_path)
    assert "all steps equal" in shell("one/drone_example", folder=tmp_path)
    shell("cmake", "--install", "one", "--prefix", "installed", folder=tmp_path)
    shell("cmake", "-S", ".", "-B", "two", f"-DCMAKE_PREFIX_PATH={tmp_path / 'installed'}", folder=tmp_path)
    shell("cmake", "--build", "two", folder=tmp_path)
    shell("two/firmware", folder=tmp_path)


@pytest.mark.long
@pytest.mark.first_is_quick
def test_make_builds_each_board_and_each_set_of_flags_by_itself(tmp_path: Path) -> None:
    """Objects of another processor, of other flags, or without -fPIC are never linked."""
    require("make", "make")
    require("readelf", "binutils")
    require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    placed(ONE_NORM, tmp_path)

    def machine(board: str) -> str:
        printed = shell("readelf", "-h", f"build/{board}/libnmpc_controller.a", folder=tmp_path)
        return " ".join(set(re.findall(r"Machine: +(.+)", printed)))

    assert "-c" in shell("make", folder=tmp_path)
    host = machine("host")
    shell("make", "BOARD=crazyflie", folder=tmp_path)
    assert (machine("host"), machine("crazyflie")) == (host, "ARM")
    shell("make", "shared", folder=tmp_path)
    assert (tmp_path / "build/host/libnmpc_controller.so").is_file()
    assert shell("make", folder=tmp_path) == ""
    for other in ("CFLAGS=-std=c99 -O1 -ffp-contract=off", "CC=gcc -pipe", "TARGET=-fno-inline"):
        flag = other.split("=", 1)[1]
        assert flag in shell("make", other, folder=tmp_path)
        assert shell("make", other, folder=tmp_path) == ""
    assert "-c" in shell("make", folder=tmp_path)


def test_make_lists_the_boards_when_it_knows_none_of_that_name(mambo: Path) -> None:
    """It does not silently build for the host."""
    said = refused(require("make", "make"), "BOARD=crazyfly", folder=mambo).stderr
    assert f"BOARD=crazyfly is unknown; the boards are: {' '.join(boards.names())}." in said
    assert not (mambo / "build").exists()


@pytest.mark.parametrize(("method", "advice"), [(2, "on x86 build with"), (1, "use code.scalar fixed")])
def test_another_precision_than_the_type_s_is_refused(method: int, advice: str, mambo: Path) -> None:
    """The x87 has a precision of its own (2), some s390x compilers use double (1); one is an x86."""
    flags = ["-U__FLT_EVAL_METHOD__", f"-D__FLT_EVAL_METHOD__={method}", "-fsyntax-only"]
    said = refused(require("gcc", "gcc"), *flags, "nmpc.c", folder=mambo).stderr
    assert advice in said
    assert ("x86" in said) == (method == 2)


@pytest.mark.parametrize(
    ("flag", "named"),
    [
        ("-ffast-math", "-ffast-math"),
        ("-Ofast", "-ffast-math"),
        ("-ffinite-math-only", "-ffast-math"),
        ("-funsafe-math-optimizations", "-fassociative-math"),
        ("-fno-signed-zeros", "-fno-signed-zeros"),
    ],
)
def test_flags_that_change_the_arithmetic_are_refused(flag: str, named: str, mambo: Path) -> None:
    """They would remove the NaN checks, reorder sums or lose signs: the build stops and says which flag."""
    gcc = require("gcc", "gcc")
    said = refused(gcc, flag, "-fsyntax-only", "nmpc.c", folder=mambo).stderr
    assert f"build without {named}: " in said


@pytest.mark.parametrize("name", by_default("mambo", of=presets.names()))
def test_the_self_test_notices_a_build_that_contracts(name: str, tmp_path: Path) -> None:
    """Fused multiply-adds, where the processor has them, change bits that the vectors see."""
    require("gcc", "gcc")
    if " fma " not in Path("/proc/cpuinfo").read_text():
        pytest.skip("this processor has no fused multiply-add")
    placed(SETTINGS[name], tmp_path)
    sources = sorted(tmp_path.glob("*.c"))
    for contract, message in (("off", "equal the reference"), ("fast", "differs from the reference")):
        flags = ["-O2", "-mfma", f"-ffp-contract={contract}", "-I."]
        shell("gcc", *flags, *sources, "example/main.c", "-o", "example/run", folder=tmp_path)
        done = subprocess.run(["example/run"], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert message in done.stdout
