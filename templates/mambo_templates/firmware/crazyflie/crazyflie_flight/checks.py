"""What fly.py and offboard.py check before a flight and in it, and how they end one."""

import math
import sys

from .calls import Crazyflie, Drone, Watch
from .ends import CannotLandError, RefusedError, TroubleError
from .figures import PAUSE_S
from .heading import heading_error
from .radio import APP_CHECKS, CHECKS, DIGEST, FLYING, GROUP, LOGGED, PLACE, Radio

LEAST_BATTERY_V = 3.7  # at rest
ARMED, CAN_FLY, TUMBLED, LOCKED, CRASHED = 2, 8, 32, 64, 128  # bits of supervisor.info
CHARGING, CHARGED, LOW_POWER, SHUT_DOWN = 1, 2, 3, 4  # pm.state
BLIND_S = 2.0
"""Without a position the app sinks by itself, more slowly than a plan.

The plan's end would stop the motors in the air.
"""
STATUS_S = 0.3  # a flight ends when the controller has refused its inputs for so long
MEASURED_M2 = 0.01
"""Of a measured place; a flow deck measures along the drone, and its variance of the position is larger."""
MOST_HEADING_DEG = 20.0  # from there on a hover swings; the hop finds it to about 5
HEADING_CURE = (
    "set the drone down with its nose along x of the positions, or give its heading by --start-heading"
)
NOT_READY = (
    (FLYING, "the drone flies already"),
    (TUMBLED, "the drone lies on its side or its back: put it upright"),
    (LOCKED, "the supervisor has locked the drone: switch it off and on"),
    (CRASHED, "the supervisor saw a crash: switch the drone off and on"),
)
FLASH = "flash this folder (make cload)"


def parameter(cf: Crazyflie, name: str) -> int:
    """Return a parameter; raise RefusedError if it cannot be read."""
    try:
        return int(cf.param.get_value(name))
    except Exception as error:  # cflib raises no class of its own
        raise RefusedError(f"parameter {name} cannot be read ({error}): go nearer to the drone") from error


def require_app(cf: Crazyflie) -> None:
    """Raise RefusedError unless the firmware has the app, with these settings, and its self-test passed."""
    if "settings" not in cf.param.toc.toc.get(GROUP, {}):
        raise RefusedError(f"the firmware has no app with a parameter {GROUP}.settings: {FLASH}")
    digest = f"{parameter(cf, f'{GROUP}.settings'):08x}"
    if digest != DIGEST[:8]:
        raise RefusedError(f"the firmware has settings {digest}, this folder {DIGEST[:8]}: {FLASH}")
    ours = (name.partition(".") for block in (*LOGGED, APP_CHECKS) for name in block)
    has = cf.log.toc.toc.get(GROUP, {})
    if missing := [name for group, _, name in ours if group == GROUP and name not in has]:
        raise RefusedError(f"the firmware has an older app, without {GROUP}.{min(missing)}: {FLASH}")
    step = parameter(cf, f"{GROUP}.selfTest")
    if step > 0:
        raise RefusedError(
            f"the self-test failed in step {step}, so the build has other bits: README.md, Build"
        )
    if step < 0:
        cure = "build with the app-config of this folder, and flash it (make cload)"
        raise RefusedError(f"the self-test did not run: {cure}")


def choose_app(cf: Crazyflie) -> None:
    """Let the app fly."""
    cf.param.set_value("stabilizer.controller", "0")  # the one that app-config chooses
    cf.param.set_value(f"{GROUP}.on", "1")


def require_ready(radio: Radio) -> None:
    """Raise RefusedError, with all reasons, unless estimator, battery and supervisor allow a flight."""
    names = {name for block in (radio.checks, PLACE, *radio.blocks) for name in block}
    if not radio.wait_for(lambda: names <= {*radio.latest}, 5.0):
        raise RefusedError("the drone sends no logs: go nearer to it")
    latest, reasons = radio.latest, []
    if parameter(radio.cf, "stabilizer.estimator") != 2:
        cure = "set stabilizer.estimator to 2 (cfclient, Parameters)"
        reasons.append(f"the estimator is not the Kalman filter: {cure}")
    if latest["pm.state"] in (CHARGING, CHARGED):
        reasons.append("the drone is on its charger: unplug it")
    elif latest["pm.state"] in (LOW_POWER, SHUT_DOWN) or latest["pm.vbat"] < LEAST_BATTERY_V:
        least = f"{LEAST_BATTERY_V} V are the least: charge it"
        reasons.append(f"the battery has {latest['pm.vbat']:.2f} V, and {least}")
    reasons += [reason for bit, reason in NOT_READY if int(latest["supervisor.info"]) & bit]
    if reasons:
        raise RefusedError("; ".join(reasons))


def require_position(radio: Radio, heading_rad: float = 0.0) -> None:
    """Start the Kalman filter anew with a heading, and wait until it has a position.

    Raise RefusedError if it finds none.
    """
    radio.cf.param.set_value("kalman.initialYaw", str(heading_rad))
    for value in ("1", "0"):
        radio.cf.param.set_value("kalman.resetEstimation", value)
        radio.wait(0.1)
    seen: list[list[float]] = []

    def is_settled() -> bool:
        seen.append([radio.latest[name] for name in CHECKS[3:6]])
        spread = max(max(values) - min(values) for values in zip(*seen[-10:], strict=True))
        return len(seen) > 10 and spread < 0.001 and not radio.latest.get(f"{GROUP}.lost", 0)

    if not radio.wait_for(is_settled, 15.0):
        where = "is the drone in view of cameras or base stations, or over a floor?"
        raise RefusedError(f"the Kalman filter finds no position: {where}")


def require_armed(radio: Radio) -> None:
    """Arm the drone; raise RefusedError if the supervisor does not let it fly."""

    def has(bit: int) -> bool:
        return bool(int(radio.latest["supervisor.info"]) & bit)

    if not has(ARMED):
        radio.cf.supervisor.send_arming_request(True)
    if not radio.wait_for(lambda: has(CAN_FLY), 3.0):
        told = f"supervisor.info = {radio.latest['supervisor.info']}"
        raise RefusedError(f"the supervisor does not let the drone fly ({told})")


def watch(drone: Drone) -> None:
    """Raise TroubleError if the drone should not fly on."""
    latest = drone.latest
    if int(latest["supervisor.info"]) & (TUMBLED | LOCKED | CRASHED):
        raise CannotLandError("the drone has tumbled or crashed")
    if latest["pm.state"] in (LOW_POWER, SHUT_DOWN):
        raise TroubleError(f"the battery is low, {latest['pm.vbat']:.2f} V")
    if latest.get(f"{GROUP}.lost", 0):
        raise TroubleError("no position is measured")
    status = latest.get(f"{GROUP}.status", 0)
    if status and drone.now() - drone.accepted_s > STATUS_S:
        raise TroubleError(f"the controller refuses its inputs, {GROUP}.status = {status}")


def watch_near(x: float, y: float, radius: float) -> Watch:
    """Return a watch: motors stop if the drone, low above the floor, leaves a place by more than `radius`."""

    def watch_place(drone: Drone) -> None:
        watch(drone)
        if math.hypot(drone.latest[PLACE[0]] - x, drone.latest[PLACE[1]] - y) > radius:
            raise CannotLandError(f"it strays from its place; {HEADING_CURE}")

    return watch_place


def require_heading(drone: Drone, duration_s: float) -> None:
    """Raise TroubleError if the motion of the last seconds shows that the heading is wrong.

    Over a flow deck that does no harm.
    """
    if drone.latest["kalman.varX"] > MEASURED_M2:
        return
    error_deg = math.degrees(heading_error(drone.rows, duration_s))
    if math.isnan(error_deg):
        raise TroubleError("too few logs arrive to compare its heading; go nearer to the drone")
    if abs(error_deg) > MOST_HEADING_DEG:
        side = "left" if error_deg > 0.0 else "right"
        off = f"about {abs(error_deg):.0f} degrees further to the {side} than it believes"
        raise TroubleError(f"its nose points {off}; {HEADING_CURE}")


def land(drone: Drone, floor: float, duration_s: float, *, is_interrupted: bool = False) -> None:
    """Land where the drone is. Ctrl-C does not end a landing, unless another one began it."""
    drone.watch_by(None)
    try:
        drone.cf.commander.send_notify_setpoint_stop()
        drone.cf.high_level_commander.land(floor, duration_s, yaw=None)
        try:
            drone.wait(duration_s + PAUSE_S)
        except KeyboardInterrupt:
            if is_interrupted:
                raise
            drone.wait(duration_s + PAUSE_S)
    finally:
        drone.cf.high_level_commander.stop()


def end(drone: Drone, error: BaseException, floor: float, duration_s: float) -> None:
    """End a flight because of an error: say why and land, or stop the motors of a drone that cannot land."""
    if isinstance(error, CannotLandError):
        print(f"The motors stop: {error}.", file=sys.stderr)
        drone.cf.commander.send_stop_setpoint()
        drone.cf.commander.send_notify_setpoint_stop()
        drone.cf.high_level_commander.stop()
        return
    if isinstance(error, TroubleError):
        print(f"The drone lands: {error}.", file=sys.stderr)
        if drone.latest.get(f"{GROUP}.lost", 0):
            duration_s += BLIND_S
    land(drone, floor, duration_s, is_interrupted=isinstance(error, KeyboardInterrupt))
