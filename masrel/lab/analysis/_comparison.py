"""An analysis compared with the limits of gates, or with an earlier analysis.

Of two documents as `as_analysis_document` makes them every value that differs is named
by what it is of, and every input whose hash differs.
"""

import math
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from masrel._input import refuse
from masrel.agreement import COEFFICIENTS, p_value
from masrel.analysis._gates import Gate, GateResult
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Estimate
from masrel.lab._study_files import (
    CUT_OFF,
    MAX_TABLE,
    is_cut_off,
    parse_json,
    read_regular,
)
from masrel.lab.analysis._results import (
    ANALYSIS_FORMAT,
    Analysis,
    PlannedEstimate,
    PlannedJudge,
)

# inputs are compared by themselves; notes say in words what numbers beside them say
_LEFT_OUT = ("format", "inputs", "masrel_version", "notes")
# Fields that tell the elements of a list apart
_NAMES = ("id", "questionnaire", "question", "session", "model", "rater", "name",
          "label", "stretch")  # fmt: skip

_ROUNDING = 1e-9  # of a number

# Parts of a place that say nothing beside the name of a line of the plan
_WITHIN = ("estimates", "estimate", "interval")


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
    every: list[PlannedEstimate | PlannedJudge] = [
        *analysis.estimates,
        *analysis.judges,
    ]
    planned = {each.line.id: each for each in every}
    return tuple(
        gate.hold(*_number(gate.number, planned[gate.estimate])) for gate in gates
    )


def _number(
    name: str, planned: PlannedEstimate | PlannedJudge
) -> tuple[float, str | None]:
    if isinstance(planned, PlannedJudge):
        return getattr(planned.result, name, math.nan), planned.reason
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
        return math.nan, f"{estimate.coefficient} has no value expected by chance"
    # the reason is said
    with warnings.catch_warnings(action="ignore", category=UndefinedStatisticWarning):
        return p_value(estimate), estimate.reason


def read_old_analysis(place: Path, study: str, *, option: str) -> dict[str, Any]:
    """Read the analysis of a report's folder, of a study, or of a file of its own."""
    within = (place / "analysis.json", place / "report" / "analysis.json")
    file = next((p for p in within if p.is_file()), place)
    refuse(
        (
            file.is_dir() or not file.exists(),
            f"{option}: needs an analysis.json, or a folder that has one, as that of a "
            f"report or a study, got {place}",
        ),
        (
            is_cut_off(file.parent),
            f"{option}: {file.parent}: {CUT_OFF}",
        ),
    )
    try:
        document = parse_json(read_regular(file, most=MAX_TABLE))
    except ValueError as error:
        raise ParameterError(
            f"{option}: {file}: is not an analysis: {error}"
        ) from error
    is_analysis = isinstance(document, dict) and isinstance(document.get("study"), str)
    head: dict[str, Any] = document if is_analysis else {}
    version, of = head.get("format", 1), head.get("study")
    refuse(
        (not is_analysis, f"{option}: {file}: is not an analysis of a study"),
        (
            version != ANALYSIS_FORMAT,
            f"{option}: {file}: needs format {ANALYSIS_FORMAT}, got {version!r}",
        ),
        (
            of != study,
            f"{option}: needs an analysis of the study {study!r}, {file} is of {of!r}",
        ),
    )
    return head


def changes_between(
    old: Mapping[str, Any], new: Mapping[str, Any], *, exact: bool = False
) -> list[dict[str, Any]]:
    """Return every value that two analyses do not have in common, and by how much."""
    # exact: also numbers that differ as rounding on another machine does
    before, after = dict(_values(old)), dict(_values(new))
    places = (
        place
        for place in {**after, **before}
        if before.get(place) != after.get(place)
        and (exact or not _is_rounding(before.get(place), after.get(place)))
    )
    changes = dict.fromkeys(  # once where an estimate repeats what its line says
        (
            " ".join(p for p in place[:-1] if p not in _WITHIN).replace("_", " "),
            place[-1].replace("_", " "),
            before.get(place),
            after.get(place),
        )
        for place in places
    )
    return [
        {
            "of": of,
            "field": field,
            "old": one,
            "new": other,
            "difference": _difference(one, other),
        }
        for of, field, one, other in changes
    ]


def _is_rounding(old: str | float | None, new: str | float | None) -> bool:
    numbers = [of for of in (old, new) if isinstance(of, float)]
    return len(numbers) == 2 and math.isclose(
        *numbers, rel_tol=_ROUNDING, abs_tol=1e-12
    )


def _difference(old: str | float | None, new: str | float | None) -> float | None:
    # the new number less the old one, if both are numbers
    if isinstance(old, bool | str | None) or isinstance(new, bool | str | None):
        return None
    return new - old


def changed_inputs(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a line for each input whose hash differs, and for another masrel."""
    before, after = old.get("inputs") or {}, new.get("inputs") or {}
    hashes = {
        name: [str(inputs.get(name) or "none")[:12] for inputs in (before, after)]
        for name in {**after, **before}
        if before.get(name) != after.get(name)
    }
    lines = [
        f"{name.removesuffix('_sha256').replace('_', ' ')}: SHA-256 "
        f"{' before, now '.join(both)}"
        for name, both in hashes.items()
    ]
    versions = [str(d.get("masrel_version")) for d in (old, new)]
    if versions[0] != versions[1]:
        lines.append(f"masrel: {' before, now '.join(versions)}")
    return tuple(lines)


def _values(
    value: Any, place: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    # every value by its place: names of fields, and of elements of lists
    if isinstance(value, Mapping):
        for name, part in value.items():
            if name not in _LEFT_OUT:
                yield from _values(part, (*place, name))
    elif isinstance(value, list) and any(isinstance(part, Mapping) for part in value):
        met: Counter[str] = Counter()
        for part in value:
            name = " ".join(str(part[k]) for k in _NAMES if part.get(k) is not None)
            met[name] += 1
            which = f"{name} ({met[name]})" if met[name] > 1 else name
            yield from _values(part, (*place, which))
    elif isinstance(value, list) and any(isinstance(part, float) for part in value):
        for at, part in enumerate(value, 1):
            yield (*place[:-1], f"{place[-1]} {at}"), part
    elif isinstance(value, list):
        yield place, ", ".join(map(str, value))
    else:
        yield place, value
