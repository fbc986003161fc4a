"""The settings of one controller: its sections, the rules between sections, and their digest."""

import hashlib
import json
from collections.abc import Iterator
from typing import Any, Self

from pydantic import ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from mambo_codegen.methods import method_of
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import DEFAULTS, Sections


class Settings(Sections):
    """Settings of a mambo-nmpc controller (controller.toml)."""

    @model_validator(mode="after")
    def _obeys_joint_rules(self) -> Self:
        refused = self._misplaced() or list(self._unused()) or method_of(self).refusals()
        if refused:
            raise ValidationError.from_exception_data(
                "Settings",
                [
                    InitErrorDetails(
                        type=PydanticCustomError("joint", "{rule}", {"rule": refusal.rule}),
                        loc=(*refusal.section.split("."), refusal.name),
                        input=self.value(f"{refusal.section}.{refusal.name}"),
                    )
                    for refusal in refused
                ],
            )
        return self

    def _misplaced(self) -> list[Refusal]:
        """Refuse a section that needs another method."""
        if self.controller.method == "quadratic":
            return []
        placed = [name for name in ("height", "guard") if getattr(self, name) is not None]
        return [Refusal("controller", "method", f'must be "quadratic" with [{name}]') for name in placed[:1]]

    def _unused(self) -> Iterator[Refusal]:
        """Refuse every value that would have no effect, unless it is the default."""
        for section, values in self.values.items():
            for name, value in values.items():
                path = f"{section}.{name}"
                unmet = self.unmet(path)
                if unmet and value != DEFAULTS.value(path):
                    yield Refusal(section, name, f"has no effect {unmet}; leave it out")

    @property
    def in_use(self) -> dict[str, dict[str, Any]]:
        """The values that the C depends on, by section.

        Without those that a method leaves out if they are the defaults: [target], the limits of speed,
        braking and place, height.thrust_gain, model.tilt, and with a 1-norm controller.method,
        model.thrust and [damping].
        """
        values = self.used_values
        for path in method_of(self).unnamed:
            section, _, name = path.rpartition(".")
            if self.value(path) != DEFAULTS.value(path):
                continue
            if path in values:
                del values[path]
            elif section in values:
                values[section].pop(name, None)
        return values

    @property
    def digest(self) -> str:
        """The SHA-256 of the values in use, in hexadecimal; equal settings have equal digests."""
        canonical = json.dumps(self.in_use, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()

    @property
    def short_digest(self) -> str:
        """The first 16 digits of the digest: what the generated C and the reports hold."""
        return self.digest[:16]

    @classmethod
    def json_schema(cls) -> dict[str, Any]:
        """Return the JSON schema (draft 2020-12) of controller.toml, for editors."""
        schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **cls.model_json_schema()}
        described = "The drone that the settings are for, which commands fly; the C does not depend on it."
        schema["properties"]["vehicle"] = {"type": "string", "minLength": 1, "description": described}
        return schema
