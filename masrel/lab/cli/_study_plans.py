"""What every line of a study's plan can show at the study's size."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click

from masrel.agreement import coefficient
from masrel.errors import ParameterError
from masrel.lab.protocol import (
    EstimatePlan,
    Protocol,
    SampleSize,
    StudyPaths,
    read_protocol,
    scale_of,
)
from masrel.planning import Plan, Study, precision

_USUAL_VALUES = (0.4, 0.6, 0.8)
_AIM = ("half_width", "lower", "upper", "null")


def study_plans(
    folder: Path, options: dict[str, Any], progress: Callable[[int, int], None]
) -> tuple[tuple[str, ...], tuple[Plan, ...]]:
    """Return the ids of lines, and their plans; what has none is noted."""
    cells = list(_cells(read_protocol(StudyPaths(folder).protocol), options))
    labelled: list[tuple[str, Plan]] = []
    for place, (line, arguments) in enumerate(cells, 1):
        try:
            labelled.append((line.id, precision(Study(line.coefficient, **arguments))))
        except ParameterError as error:
            click.echo(f"note: {line.id}: {error}", err=True)
        progress(place, len(cells))
    if not labelled:
        raise ParameterError(
            f"{folder}: needs a line of [[analysis.estimates]] that can be planned for"
        )
    labels, plans = zip(*labelled, strict=True)
    return labels, plans


def _cells(
    protocol: Protocol, options: dict[str, Any]
) -> Iterator[tuple[EstimatePlan, dict[str, Any]]]:
    # every line that has an interval, for every value that is taken to be true
    sizes = {size.estimate: size for size in protocol.analysis.sample_sizes}
    for line in protocol.analysis.estimates:
        size = sizes.get(line.id)
        if line.interval == "none" and "interval" not in options:
            note = "has no interval to be planned for; --interval names one"
            click.echo(f"note: {line.id}: {note}", err=True)
            continue
        arguments = _arguments(protocol, line, size, options)
        for name, words in (("n_items", "items"), ("n_raters", "raters")):
            planned, actual = getattr(size, name, arguments[name]), arguments[name]
            if planned != actual:  # a study that is not as large as was planned
                click.echo(
                    f"note: {line.id}: the plan is for {planned} {words}, but the "
                    f"study has {actual}",
                    err=True,
                )
        usual = _USUAL_VALUES if size is None else (size.value,)
        for value in options.get("value", usual):
            yield line, {**arguments, "value": value}


def _arguments(
    protocol: Protocol,
    line: EstimatePlan,
    size: SampleSize | None,
    options: dict[str, Any],
) -> dict[str, Any]:
    # what the options say, else how the size was chosen, else what is usual
    is_normal = line.coefficient.startswith("icc")
    level = protocol.analysis.level
    declared: dict[str, Any] = {"level": level, "model": "dirichlet-multinomial"}
    declared["interval"] = "auto" if is_normal else line.interval
    if size is not None:
        declared |= {
            name: getattr(size, name) for name in ("model", "sides", "p_missing")
        }
        declared["prevalences"] = size.table or size.prevalences or None
        if options.keys().isdisjoint(_AIM):
            declared |= {name: getattr(size, name) for name in _AIM}
    declared |= {**options, "categories": scale_of(protocol).values}
    if is_normal:
        declared |= dict.fromkeys(("categories", "prevalences", "model"))
    n_items, n_raters = _study_size(protocol, line)
    return {
        **declared,
        "n_items": n_items,
        "n_raters": n_raters,
        "weights": line.weights,
        "target": line.target,
    }


def _study_size(protocol: Protocol, line: EstimatePlan) -> tuple[int, int]:
    # items are models as often as they are presented; a rater alone has two sessions
    n_models = sum(line.models in ("all", model.role) for model in protocol.models)
    sessions = {session.id: set(session.raters) for session in protocol.sessions}
    n_raters = len(set.intersection(*(sessions[name] for name in line.sessions)))
    if line.kind == "test-retest" and coefficient(line.coefficient).shape != "pairs":
        n_raters = 2
    return n_models * protocol.schedule.repeats, n_raters
