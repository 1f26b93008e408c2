"""What every line of a study's plan can show at the study's size."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from masrel.cli._planning_options import PlanningOptions
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.lab.protocol import EstimatePlan, Protocol, SampleSize
    from masrel.planning import Plan

_USUAL_VALUES = (0.4, 0.6, 0.8)
_OF_THE_STUDY = (
    *("coefficient", "weights", "items", "raters", "categories", "target", "pilot"),
    *("power", "assurance", "max_cost", "prices", "executor", "scheduler", "resume"),
)


def study_plans(
    study: Path,
    options: PlanningOptions,
    progress: Callable[[int], Callable[[int, int], None]],
) -> "tuple[tuple[str, ...], tuple[Plan, ...]]":
    """Return the ids of lines, and their plans; what has none is noted."""
    # progress: takes how many plans are still to come
    from masrel.lab.protocol import StudyPaths, read_protocol

    options.refuse(_OF_THE_STUDY, "is not of a study, whose protocol says it")
    protocol = read_protocol(StudyPaths(study).protocol)
    cells = list(_cells(protocol, options))
    labels: list[str] = []
    plans: list[Plan] = []
    for place, (line, arguments) in enumerate(cells):
        try:
            plan = _planned(line, arguments, progress(len(cells) - place))
        except ParameterError as error:
            click.echo(f"note: {line.id}: {error}", err=True)
            continue
        labels.append(line.id)
        plans.append(plan)
    if not plans:
        raise ParameterError(
            f"{study}: needs a line of [[analysis.estimates]] that can be planned for"
        )
    return tuple(labels), tuple(plans)


def _cells(
    protocol: "Protocol", options: PlanningOptions
) -> "Iterator[tuple[EstimatePlan, dict[str, Any]]]":
    # every line that has an interval, for every value that is taken to be true
    sizes = {size.estimate: size for size in protocol.analysis.sample_sizes}
    for line in protocol.analysis.estimates:
        size = sizes.get(line.id)
        if line.interval == "none" and options.interval is None:
            note = "has no interval to be planned for; --interval names one"
            click.echo(f"note: {line.id}: {note}", err=True)
            continue
        common = _arguments(protocol, line, size, options)
        values: Sequence[float] = options.value or _USUAL_VALUES
        if options.value is None and size is not None:
            values = (size.value,)
        if size is not None:
            _compare(line, size, common)
        yield from ((line, {**common, "value": value}) for value in values)


def _planned(
    line: "EstimatePlan", arguments: dict[str, Any], progress: Callable[..., None]
) -> "Plan":
    from masrel.planning import precision

    return precision(line.coefficient, **arguments, progress=progress)


def _arguments(
    protocol: "Protocol",
    line: "EstimatePlan",
    size: "SampleSize | None",
    options: PlanningOptions,
) -> dict[str, Any]:
    # what the options say, else how the size was chosen, else what is usual
    from masrel.lab.protocol import scale_of

    n_items, n_raters = _study_size(protocol, line)
    shares = options.shares
    if shares is None and size is not None:
        shares = size.table or size.prevalences or None
    is_normal = line.coefficient.startswith("icc")
    model = options.model or (size.model if size else "dirichlet-multinomial")
    aim = options.aim()
    if size is not None and not any(x is not None for x in aim.values()):
        aim = {name: getattr(size, name) for name in aim}
    return {
        "n_items": n_items,
        "n_raters": n_raters,
        "weights": line.weights,
        "categories": None if is_normal else scale_of(protocol).values,
        "prevalences": None if is_normal else shares,
        "model": None if is_normal else model,
        "target": line.target,
        "interval": options.interval or ("auto" if is_normal else line.interval),
        "level": options.level or protocol.analysis.level,
        "sides": options.sides or (size.sides if size else 2),
        "p_missing": options.p_missing or (size.p_missing if size else 0.0),
        "method": options.method,
        "rng": options.seed,
        **aim,
    }


def _study_size(protocol: "Protocol", line: "EstimatePlan") -> tuple[int, int]:
    # items are models as often as they are presented; a rater alone has two sessions
    from masrel.agreement import coefficient

    n_models = sum(line.models in ("all", model.role) for model in protocol.models)
    sessions = {session.id: set(session.raters) for session in protocol.sessions}
    n_raters = len(set.intersection(*(sessions[name] for name in line.sessions)))
    if line.kind == "test-retest" and coefficient(line.coefficient).shape != "pairs":
        n_raters = 2
    return n_models * protocol.schedule.repeats, n_raters


def _compare(
    line: "EstimatePlan", size: "SampleSize", arguments: dict[str, Any]
) -> None:
    # a study that is not as large as was planned
    for name, words in (("n_items", "items"), ("n_raters", "raters")):
        planned, actual = getattr(size, name), arguments[name]
        if planned != actual:
            click.echo(
                f"note: {line.id}: {planned} {words} were planned for, the study has "
                f"{actual}",
                err=True,
            )
