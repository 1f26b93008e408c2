"""Gates: numbers of an analysis that must not fall short, or go beyond."""

import math
import operator
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass

from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab.protocol.definition import Protocol

GATE_NUMBERS = ("value", "low", "high", "width", "n", "n_missing", "p")
"""Numbers of an estimate that a gate can be about."""

_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_PARTS = re.compile(r"\s*([^<>=\s]+)\s*(>=|<=|>|<)\s*([^<>=\s]+)\s*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """A number of an analysis, and the limit that it must keep.

    Attributes
    ----------
    estimate : str
        Id of a line of the plan.
    number : {"value", "low", "high", "width", "n", "n_missing", "p"}
        Which number of it: the value, an end of its interval or the distance of both,
        how many models it rests on, ratings that are missing, or the p-value of the
        hypothesis that it is 0.
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

    def holds(self, number: float) -> bool:
        """Return whether a number keeps the limit; ``nan`` never does.

        Parameters
        ----------
        number : float
            The number that the gate is about.

        Returns
        -------
        bool
            Whether it does.
        """
        return _COMPARISONS[self.comparison](number, self.limit)


def parse_gate(
    text: str, estimates: Collection[str], *, where: str, why: str = ""
) -> Gate:
    """Read a requirement such as ``kappa.low >= 0.4``.

    Parameters
    ----------
    text : str
        Estimate and number with a dot between, one of ``>=``, ``<=``, ``>``, ``<``, and
        the limit.
    estimates : collection of str
        Ids of the plan's lines.
    where : str
        Where it stands; a message begins with it.
    why : str, optional
        For what reason the gate is set.

    Returns
    -------
    Gate
        The requirement.

    Raises
    ------
    ParameterError
        If it is not such a text, or the estimate, the number or the limit is none.

    Examples
    --------
    >>> str(parse_gate("kappa.low>=0.4", ["kappa"], where="--require"))
    'kappa.low >= 0.4'
    """
    parts = _PARTS.fullmatch(text)
    if parts is None:
        raise ParameterError(
            f"{where}: needed ESTIMATE.NUMBER, one of >=, <=, >, <, and a limit, such "
            f"as kappa.low >= 0.4, got {text!r}"
        )
    name, comparison, limit = parts.groups()
    estimate, _, number = name.rpartition(".")
    if number not in GATE_NUMBERS:
        raise ParameterError(
            f"{where}: needed one of {listed(GATE_NUMBERS)} after the id of an "
            f"estimate and a dot, got {name!r}"
        )
    if estimate not in estimates:
        known = listed(estimates) if estimates else "there is none"
        raise ParameterError(
            f"{where}: needed an estimate of the plan ({known}), got {estimate!r}"
        )
    return Gate(
        estimate=estimate,
        number=number,
        comparison=comparison,
        limit=_limit(limit, where),
        why=why,
        where=where,
    )


def gates_of(protocol: Protocol) -> tuple[Gate, ...]:
    """Return the gates of a protocol's report.

    Parameters
    ----------
    protocol : Protocol
        A protocol.

    Returns
    -------
    tuple of Gate
        In its order.
    """
    ids = [line.id for line in protocol.analysis.estimates]
    return tuple(
        parse_gate(gate.require, ids, where=f"report.gates[{index}]", why=gate.why)
        for index, gate in enumerate(protocol.report.gates)
    )


def _limit(text: str, where: str) -> float:
    limit = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(limit):
        raise ParameterError(f"{where}: needed a number as limit, got {text!r}")
    return limit
