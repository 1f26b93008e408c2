"""Gates: numbers that must keep a limit, such as ``kappa.low >= 0.4``.

In: the text of a gate, and what it may be about. Out: whether the number that was
computed keeps the limit, and the sentence that says so.
"""

import math
import operator
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from masrel._input import listed, refuse
from masrel.errors import ParameterError

_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_PARTS = re.compile(r"\s*([^<>=]*[^<>=\s])\s*(>=|<=|>|<)\s*([^<>=\s]+)\s*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """A number of an analysis, and the limit that it must keep.

    Attributes
    ----------
    estimate : str
        What it is about: the id of a line of a plan, or the name of a judge.
    number : str
        Which number of it, such as the value or an end of its interval.
    comparison : {">=", "<=", ">", "<"}
        How it must compare with the limit.
    limit : float
        The limit.
    why : str
        For what reason.
    where : str
        Where the gate was set.
    """

    estimate: str
    number: str
    comparison: str
    limit: float
    why: str = ""
    where: str = ""

    def __str__(self) -> str:
        limit = repr(self.limit).removesuffix(".0")
        return f"{self.estimate}.{self.number} {self.comparison} {limit}"

    def hold(self, number: float, reason: str | None) -> "GateResult":
        """Return what comes of it: a number that is undefined keeps no limit."""
        if reason is None and not math.isfinite(number):
            reason = "it is undefined"
        if reason is not None:
            number = math.nan
        holds = _COMPARISONS[self.comparison](number, self.limit)
        return GateResult(gate=self, number=number, holds=holds, reason=reason)


@dataclass(frozen=True, slots=True, kw_only=True)
class GateResult:
    """What came of one gate.

    Attributes
    ----------
    gate : Gate
        The gate.
    number : float
        The number it is about; ``nan`` where it is undefined or not there.
    holds : bool
        Whether the number keeps the limit. One that is undefined never does.
    reason : str or None
        Why there is no number, or None.
    """

    gate: Gate
    number: float
    holds: bool
    reason: str | None = None

    def __str__(self) -> str:
        gate = self.gate
        verdict = "holds" if self.holds else "fails"
        number = repr(self.number).removesuffix(".0")
        why = f" ({gate.why})" if gate.why else ""
        return f"{gate.where}: {gate}{why} {verdict}: {self.reason or number}"

    def record(self) -> dict[str, object]:
        """Return it as plain values for JSON."""
        return {
            "gate": str(self.gate),
            "why": self.gate.why,
            "where": self.gate.where,
            "number": self.number if math.isfinite(self.number) else None,
            "holds": self.holds,
            "reason": self.reason,
        }


def read_gate(
    text: str,
    numbers: Mapping[str, Collection[str]],
    *,
    where: str,
    why: str = "",
    what: str = "an estimate of the plan",
    example: str = "kappa.low >= 0.4",
) -> Gate:
    """Read a gate: a name, a dot and a number of it, a comparison and a limit."""
    # numbers: names to the numbers that each has; where: where it stands, with which a
    # message begins; what, example: what the names are of, and a gate, for messages
    parts = _PARTS.fullmatch(text)
    if parts is None:
        raise ParameterError(
            f"{where}: needed a name, a dot, one of its numbers, one of >=, <=, >, "
            f"<, and a limit, such as {example}, got {text!r}"
        )
    name, comparison, limit = parts.groups()
    estimate, _, number = name.strip().rpartition(".")
    every = dict.fromkeys(of for several in numbers.values() for of in several)
    fitting = numbers.get(estimate, every or (number,))
    is_number = _NUMBER.fullmatch(limit) and math.isfinite(float(limit))
    refuse(
        (
            number not in fitting,
            f"{where}: needed one of {listed(fitting)} after the name of "
            f"{what} and a dot, got {name!r}",
        ),
        (
            estimate not in numbers,
            f"{where}: needed {what} ({listed(numbers) or 'there is none'}), got "
            f"{estimate!r}",
        ),
        (not is_number, f"{where}: needed a number as limit, got {limit!r}"),
    )
    return Gate(
        estimate=estimate,
        number=number,
        comparison=comparison,
        limit=float(limit),
        why=why,
        where=where,
    )
