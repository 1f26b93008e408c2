"""Whether the numbers of an analysis keep the limits of its gates."""

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass

from masrel.agreement import COEFFICIENTS, p_value
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate
from masrel.lab.analysis._results import Analysis, PlannedEstimate
from masrel.lab.protocol import Gate


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


def check_gates(analysis: Analysis, gates: Iterable[Gate]) -> tuple[GateResult, ...]:
    """Hold the numbers of an analysis against the limits of gates.

    Parameters
    ----------
    analysis : Analysis
        What `analyze` returned.
    gates : iterable of Gate
        The gates, each on a line of the plan.

    Returns
    -------
    tuple of GateResult
        One per gate. A number that is undefined or not in the data fails.
    """
    planned = {each.line.id: each for each in analysis.estimates}
    return tuple(_result(gate, planned[gate.estimate]) for gate in gates)


def _result(gate: Gate, planned: PlannedEstimate) -> GateResult:
    number, reason = _number(gate.number, planned)
    if reason is None and not math.isfinite(number):
        reason = "it is undefined"
    if reason is not None:
        return GateResult(gate=gate, number=math.nan, holds=False, reason=reason)
    return GateResult(gate=gate, number=number, holds=gate.holds(number))


def _number(name: str, planned: PlannedEstimate) -> tuple[float, str | None]:
    # a number of an estimate, or why there is none
    estimate = planned.estimate
    if name == "n_missing" and planned.reason is None:
        return float(planned.n_missing), None
    if estimate is None:
        return math.nan, f"not in these data: {planned.reason}"
    if name == "n":
        return float(estimate.n_items), None
    if name == "value":
        return estimate.value, estimate.reason
    if name == "p":
        return _p_value(estimate)
    interval = estimate.interval
    if interval is None:
        return math.nan, "the plan asks for no interval"
    ends = {"low": interval.low, "high": interval.high}
    ends["width"] = interval.high - interval.low
    return ends[name], interval.reason


def _p_value(estimate: Estimate) -> tuple[float, str | None]:
    if not COEFFICIENTS[estimate.coefficient].chance_corrected:
        return math.nan, f"{estimate.coefficient} has no value that chance gives"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # it is said
        return p_value(estimate), estimate.reason
