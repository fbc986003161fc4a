"""The exceptions of `sil`, one class for each thing that a caller would do differently."""

from typing import ClassVar

from mambo_codegen.errors import MamboNmpcError


class ArgumentError(MamboNmpcError, ValueError):
    """An argument of a Python call is wrong; the message names argument, value and what is allowed."""


class PackageError(MamboNmpcError, ImportError):
    """A package that only an adapter needs is missing; the message names the command that installs it."""


class TrajectoryError(MamboNmpcError):
    """A trajectory is invalid; the message names file, line and rule."""


class ScenarioError(MamboNmpcError):
    """A file is not the record of a flight; the message names file, key and rule."""


class FlightError(MamboNmpcError):
    """A flight cannot be simulated with these options."""


class TraceError(MamboNmpcError):
    """A file is not a trace; the message names it."""


class ResultsError(MamboNmpcError):
    """A folder has no results, or damaged ones; the message names it and what was expected."""


class BusyError(MamboNmpcError):
    """Another run is using the result folder."""


class ScratchError(MamboNmpcError):
    """The folder for temporary files cannot be written."""


class EmulatorError(MamboNmpcError):
    """A program cannot be emulated: the emulator is missing, or the core's memory is too small."""


class EmulationError(MamboNmpcError):
    """The program on the emulated core crashed, or exceeded its time limit."""


class BoardError(MamboNmpcError):
    """The board behind a port does not answer, or runs other firmware; the message names the port."""


class LinkError(MamboNmpcError):
    """The link to an autopilot cannot be opened, or the controller cannot fly over it."""


class PilotError(MamboNmpcError):
    """A flight over a link did not begin, or ended otherwise than planned; the message says how."""

    exit_code: ClassVar[int] = 1


class WorkerError(MamboNmpcError):
    """A worker process or machine stopped before it returned its result."""


class StudyError(MamboNmpcError):
    """A study cannot be opened: Optuna is missing, or its storage fails."""


class LogError(MamboNmpcError):
    """Flight logs cannot be read, or contradict themselves; `faults` holds one line per fault."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        super().__init__(faults)
        self.faults = faults

    def __str__(self) -> str:
        return "\n".join(self.faults)


class PlanError(MamboNmpcError):
    """No plan is possible; the message says at which point, by which limit, by how much, what would do."""

    exit_code: ClassVar[int] = 1


class UserNotice(UserWarning):
    """What a user should know of a flight that goes on, such as a law that failed in one of many."""
