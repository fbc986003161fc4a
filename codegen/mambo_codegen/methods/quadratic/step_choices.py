"""What the template of the step needs of the settings: names and lists of the C, so that it reads like C."""

from collections.abc import Mapping
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
    own:        parts of the state that a step copies, for the compiler to keep them in registers.
    places:     where attitude model and observer are.
    locals:     the variables that only a height or limits need.
    goal, follows: the variable for the target, and the condition that a step may follow it.
    most_right, most_forward: the largest moves.
    tilt:       the tilt from which the optimizer starts.
    limiter:    the function that clamps a command.
    functions:  the templates of hold and guard_commands, for angles or for the direction of the thrust.
    fed:        the angles with rate feedback.
    limited:    the angles that a step without limits clamps.
    held:       the statement of a step with limits that holds the last command.
    cleared:    the calls that forget the target after an outage.
    rested:     the members of the target that stands for rest.
    target_motion: the member of a target that the tracker reads.
    closing:    the statements that end a step.
    """

    estimated: str
    none_yet: str
    lift_of: str
    per_step2: str
    own: tuple[str, ...]
    places: Mapping[str, str]
    locals: tuple[str, ...]
    goal: str
    follows: str
    most_right: str
    most_forward: str
    tilt: str
    limiter: str
    angles: tuple[Angle, Angle]
    functions: tuple[str, ...]
    fed: tuple[Angle, ...]
    limited: tuple[Angle, ...]
    held: str
    cleared: tuple[str, ...]
    rested: tuple[str, ...]
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
    learns_gain = constants.height is not None and constants.height.learns_gain
    own = () if is_fixed else ("observer",) if has_height else ("attitude", "observer")
    feedback = constants.feedback_steps or (0.0, 0.0)
    angles = (_angle(0, "roll", "RIGHT", feedback[0]), _angle(1, "pitch", "FORWARD", feedback[1]))
    fed = tuple(angle for angle in angles if angle.added)
    estimated = "<" if has_limits else "!="
    inverse = ", inverse" if has_height else ""
    return StepChoices(
        estimated=estimated,
        none_yet=">=" if has_limits else "==",
        lift_of="height, " if learns_gain else "",
        per_step2=_per_step2(constants),
        own=own,
        places={part: f"own_{part}" if part in own else f"self->{part}" for part in ("attitude", "observer")},
        locals=_locals(constants),
        goal="good" if has_height else "target",
        follows="good != NULL"
        if has_height
        else f"(target != NULL) && (missed {estimated} NMPC_NO_ESTIMATE)",
        most_right="bounds->command_m_step2[NMPC_RIGHT]" if has_limits else "NMPC_RIGHT_LIMIT_M_STEP2",
        most_forward="bounds->command_m_step2[NMPC_FORWARD]" if has_limits else "NMPC_FORWARD_LIMIT_M_STEP2",
        tilt="attitude->tilt_m_step2" if constants.settings.model.attitude == "predicted" else "tilt_m_step2",
        limiter="shared_clamp" if has_height else "clamp",
        angles=angles,
        functions=_functions(constants),
        fed=fed,
        limited=angles if has_height or constants.learns_tilt_gain else fed,
        held=f"hold(self, attitude{inverse});" if constants.feedback_steps else "/* The command holds. */",
        cleared=_cleared(has_height=has_height) if tracker else (),
        rested=constants.target_members,
        target_motion="acceleration_m_s2" if is_given else "velocity_m_s",
        closing=(
            *(("height_predict(height, on_ground)",) if has_height else ()),
            *(f"self->{part} = own_{part}" for part in own),
        ),
    )


def _angle(index: int, name: str, axis: str, feedback: float) -> Angle:
    added = f" + feedback_rad[{index}]" if feedback else ""
    return Angle(index, name, f"attitude->command_m_step2[NMPC_{axis}]", added)


def _functions(constants: QuadraticConstants) -> tuple[str, ...]:
    shape = "vector" if constants.has_thrust_vector else "angles"
    wanted = {"hold": constants.feedback_steps, "guard": constants.guard}
    return tuple(f"quadratic/_{name}_{shape}.c.j2" for name, found in wanted.items() if found is not None)


def _locals(constants: QuadraticConstants) -> tuple[str, ...]:
    has_height, has_limits = constants.has_height, constants.has_limits
    names = ["nmpc_real_t weight", "nmpc_real_t inverse", "const nmpc_target_t *good", "int on_ground = 0"]
    found = names if has_height else []
    found += ["int limit_active"] if has_height and has_limits else []
    if constants.has_thrust_vector:
        found += ["nmpc_real_t slope[2]"]
        found += (
            ["unsigned int by_thrust = (unsigned int)self->limited & NMPC_LIMIT_THRUST"] if has_limits else []
        )
    return (*found, *(("nmpc_target_t limited", "const nmpc_target_t *aim = NULL") if has_limits else ()))


def _cleared(*, has_height: bool) -> tuple[str, ...]:
    return ("tracker_clear(self)", *(("height_clear_target(height)",) if has_height else ()))
