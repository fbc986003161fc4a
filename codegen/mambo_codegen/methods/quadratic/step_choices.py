"""What the template of the step needs of the settings: names and lists of the C, so that it reads like C."""

from dataclasses import dataclass

from mambo_codegen.methods.quadratic.constants import QuadraticConstants


@dataclass(frozen=True)
class Angle:
    """Roll or pitch.

    index: in the commands.         command: of the attitude model, which stands for it.
    added: by rate feedback to its command.
    """

    index: int
    name: str
    command: str
    added: str


@dataclass(frozen=True)
class StepChoices:
    """Names and lists of the C.

    estimated, none_yet: comparisons of `missed` with NMPC_NO_ESTIMATE: there is an estimate, there is none.
    lift_of:    what the lift of the height depends on beside the thrust.
    per_step2:  the constant that makes a command of a thrust over mass per squared step.
    parts:      declarations of pointers to the parts of the controller, and of the copies to which they
                point where the compiler shall keep a part in registers.
    locals:     declarations of the other variables of a step, but for the accelerations of the tilt.
    opening:    the lines with which a step begins: it copies the parts, and clears the target for rest.
    measuring:  the statements that measure the height and the tilt.
    goal, follows: the variable for the target, and the condition that a step may follow it.
    most_right, most_forward: the largest moves.
    tilt:       the tilt from which the optimizer starts.
    limiter:    the function that clamps a command.
    guarding:   the template of hold and guard_commands, for angles or for the direction of the thrust.
    fed:        the angles with rate feedback.
    limited:    the angles that a step without limits clamps.
    held:       the statement of a step with limits that holds the last command.
    cleared:    the calls that forget the target after an outage.
    target_motion: the member of a target that the tracker reads.
    closing:    the statements that end a step: they store what it has copied.
    """

    estimated: str
    none_yet: str
    lift_of: str
    per_step2: str
    parts: tuple[str, ...]
    locals: tuple[str, ...]
    opening: tuple[str, ...]
    measuring: tuple[str, ...]
    goal: str
    follows: str
    most_right: str
    most_forward: str
    tilt: str
    limiter: str
    angles: tuple[Angle, Angle]
    guarding: str
    fed: tuple[Angle, ...]
    limited: tuple[Angle, ...]
    held: str
    cleared: tuple[str, ...]
    target_motion: str
    closing: tuple[str, ...]


def _per_step2(constants: QuadraticConstants) -> str:
    """Return the constant that makes a command of a thrust over mass per squared step."""
    of_its_own = constants.height is not None and constants.height.thrust_gain != 1.0
    return "NMPC_THRUST_PER_STEP2_S2" if of_its_own else "NMPC_STEPS2_PER_S2"


def step_choices(constants: QuadraticConstants) -> StepChoices:
    """Return what the template of the step chooses by the settings."""
    has_height, has_limits, tracker = constants.has_height, constants.has_limits, constants.tracker
    is_fixed, is_given = constants.numbers.formats is not None, constants.settings.target.gives_acceleration
    lift_of = "height, " if constants.height is not None and constants.height.learns_gain else ""
    own = () if is_fixed else ("observer",) if has_height else ("attitude", "observer")
    feedback = constants.feedback_steps or (0.0, 0.0)
    angles = (_angle(0, "roll", "RIGHT", feedback[0]), _angle(1, "pitch", "FORWARD", feedback[1]))
    fed = tuple(angle for angle in angles if angle.added)
    shape = "vector" if constants.has_thrust_vector else "angles"
    estimated, none_yet = ("<", ">=") if has_limits else ("!=", "==")
    inverse = ", inverse" if has_height else ""
    return StepChoices(
        estimated=estimated,
        none_yet=none_yet,
        lift_of=lift_of,
        per_step2=_per_step2(constants),
        parts=_parts(own, has_height=has_height),
        locals=_locals(constants),
        opening=_opening(constants, own),
        measuring=_measuring(constants, none_yet, lift_of),
        goal="good" if has_height else "target",
        follows="good != NULL"
        if has_height
        else f"(target != NULL) && (missed {estimated} NMPC_NO_ESTIMATE)",
        most_right="bounds->command_m_step2[NMPC_RIGHT]" if has_limits else "NMPC_RIGHT_LIMIT_M_STEP2",
        most_forward="bounds->command_m_step2[NMPC_FORWARD]" if has_limits else "NMPC_FORWARD_LIMIT_M_STEP2",
        tilt="attitude->tilt_m_step2" if constants.settings.model.attitude == "predicted" else "tilt_m_step2",
        limiter="shared_clamp" if has_height else "clamp",
        angles=angles,
        guarding=f"quadratic/_hold_and_guard_{shape}.c.j2",
        fed=fed,
        limited=angles if has_height or constants.learns_tilt_gain else fed,
        held=f"hold(self, attitude{inverse});" if constants.feedback_steps else "/* The command holds. */",
        cleared=_cleared(has_height=has_height) if tracker else (),
        target_motion="acceleration_m_s2" if is_given else "velocity_m_s",
        closing=(
            *(("height_predict(height, on_ground)",) if has_height else ()),
            *(f"self->{part} = own_{part}" for part in own),
        ),
    )


def _angle(index: int, name: str, axis: str, feedback: float) -> Angle:
    added = f" + feedback_rad[{index}]" if feedback else ""
    return Angle(index, name, f"attitude->command_m_step2[NMPC_{axis}]", added)


def _parts(own: tuple[str, ...], *, has_height: bool) -> tuple[str, ...]:
    places = {part: f"own_{part}" if part in own else f"self->{part}" for part in ("attitude", "observer")}
    places |= {"height": "self->height"} if has_height else {}
    return (
        *(f"nmpc_{part}_t own_{part}" for part in own),
        *(f"nmpc_{part}_t *const {part} = &{place}" for part, place in places.items()),
    )


def _locals(constants: QuadraticConstants) -> tuple[str, ...]:
    has_height, has_limits = constants.has_height, constants.has_limits
    has_vector, has_guard = constants.has_thrust_vector, constants.guard is not None
    has_feedback = constants.feedback_steps is not None
    found = {
        "nmpc_real_t feedback_rad[2] = { (nmpc_real_t)0, (nmpc_real_t)0 }": has_feedback,
        "const nmpc_real_t before_rad[2] = { self->command_rad[0], self->command_rad[1] }": has_guard,
        "unsigned int missed = self->missed": True,
        "nmpc_real_t weight": has_height,
        "nmpc_real_t inverse": has_height,
        "const nmpc_target_t *good": has_height,
        "int on_ground = 0": has_height,
        "int limit_active": has_height and has_limits,
        "nmpc_real_t slope[2]": has_vector,
        "unsigned int by_thrust = (unsigned int)self->limited & NMPC_LIMIT_THRUST": has_vector and has_limits,
        "nmpc_target_t limited": has_limits,
        "const nmpc_target_t *aim = NULL": has_limits,
    }
    return tuple(local for local, is_wanted in found.items() if is_wanted)


def _opening(constants: QuadraticConstants, own: tuple[str, ...]) -> tuple[str, ...]:
    copies = tuple(f"own_{part} = self->{part};" for part in own)
    if not constants.has_limits:
        return copies
    return (
        *copies,
        "/* One by one: for an initialiser some compilers call memset. */",
        *(f"limited.{member} = (nmpc_real_t)0;" for member in constants.target_members),
    )


def _measuring(constants: QuadraticConstants, none_yet: str, lift_of: str) -> tuple[str, ...]:
    if not constants.has_height:
        return ("attitude_measure(state, tilt_m_step2)",)
    weight = f"height_weight(height_lift({lift_of}height->thrust_m_step2))"
    return (
        f"on_ground = height_measure(height, state, missed {none_yet} NMPC_NO_ESTIMATE)",
        f"attitude_accelerate(slope, {weight}, tilt_m_step2)"
        if constants.has_thrust_vector
        else f"attitude_measure(state, {weight}, tilt_m_step2)",
    )


def _cleared(*, has_height: bool) -> tuple[str, ...]:
    return ("tracker_clear(self)", *(("height_clear_target(height)",) if has_height else ()))
