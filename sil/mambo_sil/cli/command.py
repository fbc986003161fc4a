"""The root of `mambo-nmpc`, which turns errors into a message and an exit code.

Results go to stdout, messages to stderr. This module imports nothing slow, because `--help` imports it.
"""

import errno
import io
import os
import signal
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Final, Never

import typer
from typer.core import TyperCommand, TyperGroup

from mambo_codegen import __version__
from mambo_codegen.errors import (
    BAD_INPUT,
    INTERRUPTED,
    NO_READER,
    TERMINATED,
    MamboNmpcError,
    Terminated,
    echo,
)
from mambo_sil.cli.progress import announced

EXIT_CODES = (
    "Exit codes: 0 success; 1 a check failed, or the drone crashed; 2 bad input or a system error; "
    "130 interrupted; 141 the reader of the output closed it; 143 terminated."
)

RENAMED: Final = {"same-bits": "check-bits", "identify-binary": "which-controller"}
"""Commands of version 0.3 that have another name now."""


@dataclass(frozen=True)
class JoinedCommand:
    """A command of an extension: its panel of the help, the command that it stands behind, its examples."""

    run: Callable[..., None]
    panel: str
    after: str
    examples: str


def _without_types(parameters: list[Any]) -> list[Any]:
    """Return parameters whose flags say no type in the help: they take nothing."""
    for one in parameters:
        if one.param_type_name == "option" and one.is_flag:
            one.metavar = ""
    return parameters


class RootGroup(TyperGroup):
    """The root command: an error becomes a message and an exit code, without a traceback."""

    def get_params(self, ctx: typer.Context) -> list[Any]:  # type: ignore[override] # typer hides the base of Context
        """Return the options."""
        return _without_types(super().get_params(ctx))

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Run a command line, help and version included, and flush stdout."""
        try:
            if sys.stdout is None:
                raise OSError(errno.EBADF, "is closed", "stdout")
            if isinstance(sys.stdout, io.TextIOWrapper):  # replace characters that the terminal cannot encode
                sys.stdout.reconfigure(errors="backslashreplace")
            try:
                return super().main(*arguments, **options)
            finally:
                sys.stdout.flush()
        except OSError as error:
            sys.exit(_exit_code(error))
        except SystemExit as leaving:
            if isinstance(leaving.__context__, BrokenPipeError):  # typer and rich catch it and exit 1
                sys.exit(_exit_code(leaving.__context__))
            raise

    def resolve_command(self, ctx: typer.Context, args: list[str]) -> Any:  # type: ignore[override] # as above
        """Find the command that `args` begin with; one of before is told its new name."""
        if args[0] in RENAMED:
            typer.echo(f"mambo-nmpc {args[0]} is now mambo-nmpc {RENAMED[args[0]]}", err=True)
            raise typer.Exit(BAD_INPUT)
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override] # as above
        """Run a command; with `--debug` print the traceback of an error first."""
        signal.signal(signal.SIGTERM, _terminate)
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
        except (MamboNmpcError, OSError, MemoryError, KeyboardInterrupt) as error:
            if ctx.params["_debug"] and not isinstance(error, KeyboardInterrupt | BrokenPipeError):
                traceback.print_exception(error)
            raise typer.Exit(_exit_code(error)) from error
        return result


class Command(TyperCommand):
    """A command, which refuses the empty value of a script's unset variable and an option given twice."""

    def get_params(self, ctx: typer.Context) -> list[Any]:  # type: ignore[override] # as above
        """Return the options and arguments."""
        return _without_types(super().get_params(ctx))

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override] # as above
        """Parse a command line.

        Raises BadParameter for an empty argument or value of an option, and for an option that is there again
        though only its last value would count.
        """
        given, _, parameters = self.make_parser(ctx).parse_args(list(args))
        for parameter in parameters:
            value = given.get(parameter.name or "")
            named: Any = parameter  # typer hides the class of parameters
            if "" in (value if isinstance(value, list | tuple) else (value,)):
                raise typer.BadParameter("must not be empty", ctx, named)
            if parameters.count(parameter) > 1 and not named.multiple:
                raise typer.BadParameter("is there more than once; give it once", ctx, named)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override] # as above
        """Run the command, and say after a while that it works."""
        with announced(str(ctx.info_name)):
            return super().invoke(ctx)


def _terminate(*_: object) -> Never:
    """End the command on SIGTERM, with all that it does on Ctrl-C."""
    raise Terminated


def _exit_code(error: BaseException) -> int:
    """Print why the command ended in `error`, and return its exit code."""
    match error:
        case Terminated():
            return TERMINATED
        case KeyboardInterrupt():
            return INTERRUPTED
        case MemoryError():
            typer.echo("out of memory", err=True)
        case LookupError():  # jinja2.TemplateNotFound is an OSError too, but a bug of ours
            raise error
        case OSError():
            stdout_failed = _silence_broken_stdout()
            if isinstance(error, BrokenPipeError):
                return NO_READER
            file = "stdout" if stdout_failed else error.filename or "cannot read or write"
            typer.echo(f"{echo(str(file))}: {error.strerror or error}", err=True)
        case MamboNmpcError():
            typer.echo(str(error), err=True)
            return error.exit_code
    return BAD_INPUT


def _silence_broken_stdout() -> bool:
    """Redirect stdout to /dev/null if it is broken, lest it fail again at exit; return whether it was."""
    if sys.stdout is None:
        return False
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return True
    return False


def root() -> typer.Typer:
    """Return the root command without sub-commands."""
    return typer.Typer(
        name="mambo-nmpc",
        cls=RootGroup,
        callback=_root_options,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        epilog=examples("mambo-nmpc init", "mambo-nmpc generate controller.toml -o controller")
        + f"\n\n{EXIT_CODES}",
    )


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"mambo-nmpc {__version__}")
        raise typer.Exit


def _root_options(
    _debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    _version: Annotated[
        bool,
        typer.Option("--version", help="Print the version.", is_eager=True, callback=_print_version),
    ] = False,
) -> None:
    """Generate model predictive control of a small drone in static-memory C99, and fly it in simulation."""


def examples(*lines: str) -> str:
    """Return a help epilog of example commands, one paragraph each, because help joins the lines of one."""
    return "\n\n".join(("Examples:", *lines))
