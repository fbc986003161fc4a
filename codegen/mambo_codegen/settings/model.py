"""The settings of one controller: its sections, the rules between sections, and their digest."""

import hashlib
import json
from collections.abc import Iterator
from typing import Any, Self

from pydantic import ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from mambo_codegen.methods.one_norm.formats import refusals
from mambo_codegen.methods.one_norm.horizon import lag_refusals
from mambo_codegen.methods.quadratic.formats import exact_refusals
from mambo_codegen.methods.quadratic.law import quadratic_refusals
from mambo_codegen.settings.methods import is_used, used_values
from mambo_codegen.settings.refusal import Refusal
from mambo_codegen.settings.sections import Damping, Sections, Target


class Settings(Sections):
    """Settings of a mambo-nmpc controller (controller.toml)."""

    @model_validator(mode="after")
    def _obeys_joint_rules(self) -> Self:
        refused = list(self._unused())
        if not refused:
            refused = quadratic_refusals(self) if self.cost.norm == "quadratic" else lag_refusals(self)
        if not refused and self.code.scalar == "fixed":
            refused = exact_refusals(self) if self.cost.norm == "quadratic" else refusals(self)
        if refused:
            raise ValidationError.from_exception_data(
                "Settings",
                [
                    InitErrorDetails(
                        type=PydanticCustomError("joint", "{rule}", {"rule": refusal.rule}),
                        loc=(refusal.section, refusal.name),
                        input=getattr(getattr(self, refusal.section), refusal.name),
                    )
                    for refusal in refused
                ],
            )
        return self

    def _unused(self) -> Iterator[Refusal]:
        """Refuse every value that would have no effect, unless it is the default."""
        for section, values in self.model_dump().items():
            defaults = type(self).model_fields[section].default
            for name, value in values.items():
                if not is_used(self, section, name) and value != getattr(defaults, name):
                    yield Refusal(
                        section, name, f'has no effect with cost.norm = "{self.cost.norm}"; leave it out'
                    )

    @property
    def in_use(self) -> dict[str, dict[str, Any]]:
        """The values that the C depends on, by section.

        Without [target], and with a 1-norm without cost.norm, model.thrust and [damping], if they are the
        defaults.
        """
        values = used_values(self)
        if self.cost.norm == "1-norm":
            del values["cost"]["norm"]
            if self.damping == Damping():
                del values["damping"]
            if self.model.thrust == "measured":
                del values["model"]["thrust"]
        if self.target == Target():
            del values["target"]
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
        return {"$schema": "https://json-schema.org/draft/2020-12/schema", **cls.model_json_schema()}
