"""Feedback of the attitude's rates to the commands, which shortens the lags of the attitude loops."""

from mambo_codegen.numbers.fixed_point import SINE_BITS, fractional_bits
from mambo_codegen.settings.fields import SHORTEST_LAG_S
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import Sections


def feedback_steps(settings: Sections) -> tuple[float, float] | None:
    """Return commands of roll and pitch per change of the angle in a period; None without feedback."""
    damping, period_s = settings.damping, settings.horizon.update_period_s
    if damping.roll_rate_feedback_s == damping.pitch_rate_feedback_s == 0:
        return None
    return damping.roll_rate_feedback_s / period_s, damping.pitch_rate_feedback_s / period_s


def feedback_bits(feedback: tuple[float, float] | None) -> int:
    """Return the fractional bits of rate feedback in steps: at most a sine's, a resolution of 1e-9."""
    return min(fractional_bits(*feedback), SINE_BITS) if feedback else 0


def lag_refusals(settings: Sections, *, needs_lag: bool) -> list[Refusal]:
    """Return which attitude lags are too short: for a method that needs them, and for the feedback."""
    refused = []
    for angle in ("roll", "pitch"):
        lag_s = getattr(settings.model, f"{angle}_lag_s")
        feedback_s = getattr(settings.damping, f"{angle}_rate_feedback_s")
        shortest_s = round(feedback_s + SHORTEST_LAG_S, 9)
        if lag_s < shortest_s and (needs_lag or (lag_s and feedback_s)):
            reasons = [f'controller.method = "{settings.controller.method}"'] if needs_lag else []
            reasons += [f"damping.{angle}_rate_feedback_s = {feedback_s:g}"] if feedback_s else []
            least = f"at least {shortest_s:g}" if needs_lag else f"0 or at least {shortest_s:g}"
            rule = f"must be {least} with {' and '.join(reasons)}"
            refused.append(Refusal("model", f"{angle}_lag_s", rule))
    return refused
