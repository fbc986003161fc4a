"""A drone that climbs, hovers, lands and falls, behind a wire that loses and delays each record and order.

No message is encoded and nothing tilts, so that many flights of a pilot's life cycle are quick.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Final, Generic, TypeVar

import numpy as np

from mambo_sil.life.life_cycle import LifeCycle
from mambo_sil.life.records import (
    SET_MODE,
    Answer,
    Arm,
    AskParameter,
    Echo,
    EstimatedState,
    Heartbeat,
    OnGround,
    Order,
    Parameter,
    Ping,
    Record,
    SetAttitude,
    SetMode,
    SetPosition,
    Stack,
    TakeOff,
)

Carried = TypeVar("Carried")
TICK_S: Final = 0.02
SILENT_S: Final = 1.0
"""Time without set-points after which PX4 leaves OFFBOARD (COM_OF_LOSS_T)."""
CLIMB_M_S, DESCENT_M_S, FALL_M_S = 1.0, 0.7, 4.0
DISARMS_S: Final = 1.0


@dataclass
class LossyWire(Generic[Carried]):
    """What is lost, and when the rest arrives: the delay, and up to the jitter later."""

    lost: float
    delay_s: float
    jitter_s: float = 0.03
    seed: int = 0
    passes: Callable[[object], bool] = lambda what: True  # noqa: ARG005 - all does
    """Whether a record or an order gets through at all."""

    def __post_init__(self) -> None:
        self._random, self._number = random.Random(self.seed), count()
        self._on_the_way: list[tuple[float, int, Carried]] = []

    def send(self, what: Carried, now_s: float) -> None:
        """Take a record or an order."""
        late_s = self.delay_s + self.jitter_s * self._random.random()
        if self._random.random() >= self.lost and self.passes(what):
            self._on_the_way.append((now_s + late_s, next(self._number), what))

    def arrived(self, now_s: float) -> list[Carried]:
        """Return what has arrived, in the order of its arrival."""
        due = sorted(one for one in self._on_the_way if one[0] <= now_s)
        self._on_the_way = [one for one in self._on_the_way if one[0] > now_s]
        return [what for _, _, what in due]


@dataclass
class TinyAutopilot:
    """Modes, arming and time-outs of PX4 or ArduCopter, and a drone that moves up, down and with the wind."""

    stack: Stack
    arms: bool = True
    climbs: bool = True
    armed: bool = False
    height_m: float = 0.0
    shift_m: float = 0.0
    """What the estimator adds to the position, and how far the wind has moved the drone."""
    push_m_s2: float = 0.0
    """Acceleration by the wind, against which it does not tilt."""
    resets: int = 0
    mode: int = -1
    sent: list[Record] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.mode = self.stack.hold if self.stack.climbs_by_set_points else 0
        self._aim_m, self._set_point_s, self._grounded_s, self._due_s = 0.0, -9.0, 0.0, 0.0
        self._speed_m_s = 0.0

    def obey(self, order: Order, now_s: float) -> None:
        """Obey an order."""
        match order:
            case SetPosition() | SetAttitude():
                self._set_point_s = now_s
                if isinstance(order, SetPosition):
                    self._aim_m = -float(order.position_m[2])
            case SetMode():
                hears = now_s - self._set_point_s < SILENT_S or order.mode != self.stack.guided
                if accepted := hears or not self.stack.climbs_by_set_points:
                    self.mode = order.mode
                self.sent.append(Answer(SET_MODE, accepted))
            case Arm():
                if (order.arm and self.arms) or (not order.arm and (order.force or self.height_m <= 0.0)):
                    self.armed = order.arm
            case TakeOff() if self.armed and self.mode == self.stack.guided:
                self._aim_m = order.height_m
            case Ping():
                self.sent.append(Echo(order.number))
            case AskParameter():
                self.sent.append(
                    Parameter(order.name, 0.5 if "THR" in order.name or "THST" in order.name else 8)
                )

    def move(self, now_s: float) -> None:
        """Let a tick pass, and send what is due."""
        guided, px4 = self.mode == self.stack.guided, self.stack.climbs_by_set_points
        if guided and px4 and now_s - self._set_point_s > SILENT_S:
            self.mode = self.stack.hold
        aim_m = self._aim_m if guided and self.climbs else self.height_m
        if not self.armed:
            aim_m, up_m_s, down_m_s = 0.0, 0.0, FALL_M_S
        else:
            aim_m = 0.0 if self.mode == self.stack.land else aim_m
            up_m_s, down_m_s = CLIMB_M_S, DESCENT_M_S
        step_m = min(max(aim_m - self.height_m, -down_m_s * TICK_S), up_m_s * TICK_S)
        self.height_m = max(self.height_m + step_m, 0.0)
        self._speed_m_s += self.push_m_s2 * TICK_S
        self.shift_m += self._speed_m_s * TICK_S
        if self.height_m > 0.0 or self.mode != self.stack.land:
            self._grounded_s = now_s
        elif now_s - self._grounded_s > DISARMS_S:
            self.armed = False
        self._send(step_m / TICK_S, now_s)

    def _send(self, climb_m_s: float, now_s: float) -> None:
        resets = self.resets if self.stack.climbs_by_set_points else None
        position_m, velocity_m_s = (
            np.array([self.shift_m, 0.0, -self.height_m]),
            np.array([self._speed_m_s, 0.0, -climb_m_s]),
        )
        self.sent.append(EstimatedState(now_s, position_m, velocity_m_s, np.zeros(3), resets))
        if now_s >= self._due_s:
            self._due_s += 0.2
            self.sent.append(OnGround(landed=self.height_m <= 0.0))
            if round(5.0 * now_s) % 5 == 0:
                self.sent.append(Heartbeat(1, 1, self.stack.ident, 2, armed=self.armed, mode=self.mode))


class LossyFlight:
    """A life cycle, an autopilot, and the two wires between them, over time."""

    def __init__(self, life: LifeCycle, stack: Stack, wire: Callable[[int], LossyWire[Any]]) -> None:
        self.life, self.autopilot, self.now_s = life, TinyAutopilot(stack), 0.0
        self.to_pilot: LossyWire[Record] = wire(0)
        self.to_autopilot: LossyWire[Order] = wire(1)
        self.heard: list[Order] = []
        """What the autopilot has heard."""

    def tick(self) -> None:
        """Let a tick pass."""
        self.now_s += TICK_S
        for order in self.to_autopilot.arrived(self.now_s):
            self.heard.append(order)
            self.autopilot.obey(order, self.now_s)
        self.autopilot.move(self.now_s)
        for record in self.autopilot.sent:
            self.to_pilot.send(record, self.now_s)
        self.autopilot.sent.clear()
        for record in self.to_pilot.arrived(self.now_s):
            self.life.receive(record, self.now_s)
        for order in self.life.orders(self.now_s):
            self.to_autopilot.send(order, self.now_s)

    def pass_until(self, holds: Callable[[], bool], most_s: float = 200.0) -> None:
        """Let time pass until a condition holds; fail if it does not in time."""
        end_s = self.now_s + most_s
        while not holds():
            assert self.now_s < end_s, f"{self.life.phase.value} for {most_s:g} s"
            self.tick()

    def wait(self, duration_s: float) -> None:
        """Let a time pass."""
        end_s = self.now_s + duration_s
        self.pass_until(lambda: self.now_s >= end_s)
