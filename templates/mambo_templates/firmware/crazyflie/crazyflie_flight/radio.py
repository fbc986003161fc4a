"""The radio link of fly.py and offboard.py to a Crazyflie, and its logs."""

import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence

from .calls import Crazyflie, Link, Rows, Watch
from .ends import LinkLostError, RefusedError
from .values import VALUES

GROUP, DIGEST = VALUES.group, VALUES.digest
CFLIB = "0.1.34"
FLYING = 16  # a bit of supervisor.info
CHECKS: tuple[str, ...] = (
    *("supervisor.info", "pm.vbat", "pm.state"),
    *("kalman.varPX", "kalman.varPY", "kalman.varPZ", "kalman.varX"),
)
APP_CHECKS: tuple[str, ...] = (f"{GROUP}.tooQuick",) if VALUES.says_too_quick else ()
PLACE = ("stateEstimate.x", "stateEstimate.y", "stateEstimate.z", "stateEstimate.yaw")
COUNTER = 2**24  # ms, after which the time of the logs begins again at 0
LOG_S, CHECKS_S = 0.01, 0.1  # period of LOGGED, if the radio carries it; period of checks and PLACE


def _logged() -> tuple[tuple[str, ...], ...]:
    """Return what a step reads and commands, in blocks with its number, each of 26 bytes at most."""
    known = ("targetAx", "targetAy", "targetKnown") if VALUES.has_target_observer else ()
    vertical = ("z", "vz", "targetZ", "targetVz", *(("targetAz",) if known else ()), "outThrust")
    blocks: tuple[tuple[str, ...], ...] = (
        ("x", "y", "inRoll", "inPitch", "inYaw", "vx"),
        ("vy", "targetX", "targetY", "targetVx", "targetVy", "outRoll"),
        (
            *("outPitch", *known, "status", "lost", "takeOvers", "age"),
            *(("grounded", "level", "startThrust") if VALUES.has_height else ()),
        ),
        *((vertical,) if VALUES.has_height else ()),
    )
    ours = tuple(tuple(f"{GROUP}.{name}" for name in ("step", *names)) for names in blocks)
    return ours if VALUES.has_height else (*ours, ("stateEstimate.z",))


LOGGED = _logged()


def connect(uri: str) -> Link:
    """Return a link to the drone; raise RefusedError if there is none."""
    try:
        import cflib.crtp
        from cflib.crazyflie import Crazyflie as RealCrazyflie
        from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
    except ImportError as error:
        raise RefusedError(f"cflib is missing ({error}): pip install cflib") from error
    # else cflib prints the traceback of what RefusedError says
    logging.getLogger("cflib").addHandler(logging.NullHandler())
    cflib.crtp.init_drivers()
    link: Link = SyncCrazyflie(uri, cf=RealCrazyflie(rw_cache="./cache"))
    if not hasattr(link.cf, "supervisor"):
        raise RefusedError(f"cflib is older than {CFLIB}: pip install --upgrade cflib")
    try:
        link.open_link()
    except Exception as error:  # cflib raises no class of its own
        raise RefusedError(f"no Crazyflie answers at {uri} ({str(error).splitlines()[0]})") from error
    return link


def packets_s(uri: str) -> float:
    """Return how many packets a second a radio carries each way.

    Bitcraze counts on 500 at 2 Mbit/s; at a lower rate a packet and its answer, of 41 bytes each, are longer
    in the air.
    """
    rate_bit_s = 0.25e6 if "/250K" in uri else 1e6 if "/1M" in uri else 2e6
    return 1.0 / (1.0 / 500.0 + 2 * 8 * 41 * (1.0 / rate_bit_s - 1.0 / 2e6))


def log_period_s(blocks: int, uri: str) -> float:
    """Return the shortest period, a multiple of LOG_S, in which a radio carries so many blocks.

    Checks and PLACE are carried beside them.
    """
    return LOG_S * math.ceil(blocks / LOG_S / (packets_s(uri) - 2.0 / CHECKS_S))


class Radio:
    """The link to a connected drone: the latest values of its logs, their rows, and whether it is lost."""

    def __init__(self, cf: Crazyflie, blocks: Sequence[Sequence[str]] = ()) -> None:
        self.cf, self.blocks = cf, blocks
        self.checks = (*CHECKS, *(APP_CHECKS if blocks else ()))
        self.latest: dict[str, float] = {}
        self.rows: Rows = {}
        self.is_lost, self.is_real = False, True
        self.accepted_s = self.now()
        """When the controller accepted its inputs last."""
        self.slowed, self.slow_until_s = 0, 0.0
        self._watch: Watch | None = None
        self._newest = 0
        cf.connection_lost.add_callback(self._lose)

    def _lose(self, *_: object) -> None:
        self.is_lost = True

    def _check(self, _: int, values: Mapping[str, float], __: object) -> None:
        self.latest.update(values)

    def _keep(self, timestamp: int, values: Mapping[str, float], _: object) -> None:
        self.latest.update(values)
        since = (timestamp - self._newest + COUNTER // 2) % COUNTER - COUNTER // 2
        self._newest = self._newest + since if self.rows else timestamp
        self.rows.setdefault(self._newest, {}).update(values)
        if values.get(f"{GROUP}.status") == 0:
            self.accepted_s = self.now()

    def start(self, uri: str) -> None:
        """Start the logs, as often as the radio carries them."""
        from cflib.crazyflie.log import LogConfig

        period_s = log_period_s(len(self.blocks), uri)
        if period_s > LOG_S:
            carried = f"this radio carries {packets_s(uri):.0f} packets a second"
            print(f"The log has a row each {1000 * period_s:.0f} ms: {carried}.")
        for number, names in enumerate((*self.blocks, self.checks, PLACE)):
            is_check = number >= len(self.blocks)
            period_ms = round(1000 * (CHECKS_S if is_check else period_s))
            block = LogConfig(name=f"fly{number}", period_in_ms=period_ms)
            for name in names:
                block.add_variable(name)
            self.cf.log.add_config(block)
            block.data_received_cb.add_callback(self._check if is_check else self._keep)
            block.start()

    def watch_by(self, watch: Watch | None) -> None:
        """Call a function with this link while it waits in flight; None: none."""
        self._watch = watch

    def now(self) -> float:
        """Return the time in s."""
        return time.monotonic()

    def wait(self, duration_s: float) -> None:
        """Wait; raise LinkLostError as soon as the link is lost, and what a watch raises."""
        end = self.now() + duration_s
        while True:
            if self.is_lost:
                raise LinkLostError
            if self._watch is not None:
                self._watch(self)
            left_s = end - self.now()
            if left_s <= 0.0:
                return
            time.sleep(min(left_s, 0.05))

    def wait_for(self, condition: Callable[[], bool], duration_s: float) -> bool:
        """Wait until a condition holds, for some time at most; return whether it holds."""
        for _ in range(round(duration_s / 0.1)):
            if condition():
                return True
            self.wait(0.1)
        return condition()

    def is_flying(self) -> bool:
        """Return whether the drone flew when it was heard last."""
        return bool(int(self.latest.get("supervisor.info", 0)) & FLYING)
