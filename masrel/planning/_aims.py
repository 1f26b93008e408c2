"""What a study is to show, and whether a plan shows it."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal

import numpy as np

from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.planning._precision import Plan

_REACHED = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Aim:
    """What a study is to show."""

    half_width: float | None = None
    lower: float | None = None
    upper: float | None = None
    null: float | None = None
    power: float | None = None
    assurance: float | None = None

    @property
    def kind(self) -> Literal["power", "width", "limits"] | None:
        """What kind of aim it is; None for none."""
        if self.power is not None:
            return "power"
        if self.half_width is not None:
            return "width"
        return None if self.lower is None and self.upper is None else "limits"

    @property
    def is_chance(self) -> bool:
        """Whether a chance is aimed at, and not what is expected."""
        return self.power is not None or self.assurance is not None

    @property
    def name(self) -> str:
        """The parameter that says the aim."""
        if self.kind == "power":
            return "power"
        if self.kind == "limits":
            return "upper" if self.lower is None else "lower"
        return "half_width"

    @property
    def number(self) -> str:
        """The number of a plan that is aimed at."""
        if self.power is not None:
            return "power"
        return "assurance" if self.assurance is not None else "expected_half_width"

    @property
    def words(self) -> str:
        """The aim for a reader."""
        if self.kind == "power":
            return f"power of {self.power:g}"
        what = (
            f"a half-width of {self.half_width:g}"
            if self.kind == "width"
            else f"an interval inside [{_end(self.lower)}, {_end(self.upper)}]"
        )
        with_ = "" if self.assurance is None else f" with assurance {self.assurance:g}"
        return what + with_

    def reached(self, plan: "Plan") -> str:
        """Say what a plan reaches of it."""
        if self.power is not None:
            return f"power {plan.power:.3f}"
        if self.assurance is not None:
            return f"assurance {plan.assurance:.3f}"
        if self.kind == "limits":
            low, high = plan.expected_low, plan.expected_high
            return f"an expected interval of {low:.3f} to {high:.3f}"
        return f"an expected half-width of {plan.expected_half_width:.3f}"

    def is_met(self, plan: "Plan") -> bool:
        """Whether a plan reaches it."""
        if self.power is not None:
            return plan.power >= self.power - _REACHED
        if self.assurance is not None:
            return plan.assurance >= self.assurance - _REACHED
        if self.half_width is not None:
            return plan.expected_half_width <= self.half_width * (1.0 + _REACHED)
        return (self.lower is None or plan.expected_low >= self.lower) and (
            self.upper is None or plan.expected_high <= self.upper
        )

    def distance(self, value: float) -> float:
        """Return about which half-width is needed."""
        if self.half_width is not None:
            return self.half_width
        limits = [x for x in (self.null, self.lower, self.upper) if x is not None]
        return max(min(abs(value - x) for x in limits), 1e-6)

    def checked(self, *, needs_chance: bool = True) -> "Aim":
        """Return the aim, or say what does not fit together."""
        self._check_ranges()
        if needs_chance:
            self._check_one_aim()
        return self

    def _check_ranges(self) -> None:
        for field in fields(self):
            if (number := getattr(self, field.name)) is not None:
                checked_number(field.name, number)
        for name in ("power", "assurance"):
            chance_of = getattr(self, name)
            if chance_of is not None and not 0.0 < chance_of < 1.0:
                raise ParameterError(f"{name}: needs (0, 1), got {chance_of:g}")
        if self.half_width is not None and not 0.0 < self.half_width <= 1.0:
            raise ParameterError(
                "half_width: needs (0, 1], since the scale from -1 to 1 is no wider; "
                f"got {self.half_width:g}"
            )
        for name in ("lower", "upper", "null"):
            limit = getattr(self, name)
            if limit is not None and not -1.0 <= limit <= 1.0:
                raise ParameterError(f"{name}: needs [-1, 1], got {limit:g}")

    def _check_one_aim(self) -> None:
        has_limits = self.lower is not None or self.upper is not None
        n_aims = has_limits + (self.half_width is not None) + (self.null is not None)
        if n_aims > 1:
            raise ParameterError(
                "half_width: needs to be alone, as null does, and lower and upper do: "
                "one aim a plan"
            )
        if self.power is not None and self.assurance is not None:
            raise ParameterError("assurance: needs no power beside it")
        if self.power is not None and self.null is None and not has_limits:
            raise ParameterError("power: needs null, lower or upper, got none")
        if self.power is None and self.null is not None:
            raise ParameterError(f"null: needs power, got null {self.null:g} without")
        if self.assurance is not None and self.half_width is None and not has_limits:
            raise ParameterError("assurance: needs half_width, lower or upper")


def checked_number(name: str, value: object) -> float:
    """Return a number, or say that it is none."""
    if not isinstance(value, int | float | np.integer | np.floating):
        raise ParameterError(f"{name}: needs a number, got {value!r}")
    return float(value)


def _end(value: float | None) -> str:
    return "…" if value is None else f"{value:g}"
