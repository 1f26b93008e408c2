"""Section `sample-size`: what the plan could show before the study, and what came."""

import math
from typing import TYPE_CHECKING

from masrel.lab.analysis import PlannedEstimate
from masrel.lab.protocol import Protocol, SampleSize
from masrel.lab.report._material import Material
from masrel.lab.report._sentences import sentence
from masrel.pages._sections import Content, Paragraph, Section, absent_section
from masrel.tables._tables import Column, Table, Value, counted, number

if TYPE_CHECKING:
    from masrel.planning import Plan

_TITLE = "Sample size"
_COLUMNS = (
    Column(key="estimate", heading="Estimate", align="left"),
    Column(key="what", heading="Planned or came", align="left"),
    Column(key="n_items", heading="Items"),
    Column(key="n_raters", heading="Raters"),
    Column(key="value", heading="Value", digits=3),
    Column(key="half_width", heading="Half-width", digits=3),
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
    Column(key="assurance", heading="Assurance", digits=3),
    Column(key="power", heading="Power", digits=3),
)


def sample_size_section(material: Material) -> Section:
    """Show how the size was chosen, as the protocol says it, and what came of it."""
    sizes = material.protocol.analysis.sample_sizes
    if not sizes:
        return absent_section("sample-size", _TITLE, sentence("sample-size", "nothing"))
    of_line = {planned.line.id: planned for planned in material.analysis.estimates}
    pairs = [(of_line[size.estimate], size) for size in sizes]
    blocks: list[Content] = [
        Paragraph(
            text=f"{result.line.id}: "
            f"{size_sentence(material.protocol, size)} "
            f"{_outcome(result, size)}"
        )
        for result, size in pairs
    ]
    rows = [row for pair in pairs for row in _rows(*pair)]
    blocks.append(
        Table(
            name="sample_size",
            caption="What was planned, and what came",
            columns=_COLUMNS,
            rows=tuple(rows),
            notes=(sentence("sample-size", "planned"),),
            data=material.data,
        )
    )
    return Section(name="sample-size", title=_TITLE, blocks=tuple(blocks))


def size_sentence(protocol: Protocol, size: SampleSize) -> str:
    """Say what a protocol states that a size can show."""
    # imported here: a report without such a section loads nothing of planning
    from masrel.tables._planning_tables import planning_sentence

    return planning_sentence(_stated(protocol, size))


def _stated(protocol: Protocol, size: SampleSize) -> "Plan":
    # the plan as it is written: nothing is computed
    from masrel.planning import Plan

    line = next(e for e in protocol.analysis.estimates if e.id == size.estimate)
    return Plan(
        coefficient=line.coefficient,
        weights=line.weights,
        value=size.value,
        n_items=size.n_items,
        n_raters=size.n_raters,
        model=size.model,
        target=line.target,
        interval=line.interval,
        level=protocol.analysis.level,
        sides=size.sides,
        method=size.method or "",
        prevalences=size.prevalences,
        p_missing=size.p_missing,
        half_width=size.half_width,
        lower=size.lower,
        upper=size.upper,
        null=size.null,
        expected_half_width=_or_nan(size.expected_half_width),
        expected_low=_or_nan(size.expected_low),
        expected_high=_or_nan(size.expected_high),
        assurance=_or_nan(size.assurance),
        power=_or_nan(size.power),
        coverage=_or_nan(size.coverage),
        n_studies=size.n_studies,
    )


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _ends(result: PlannedEstimate) -> tuple[float, float] | None:
    # of the interval that came, if there is one with two ends
    interval = None if result.estimate is None else result.estimate.interval
    if interval is None or math.isnan(interval.high - interval.low):
        return None
    return interval.low, interval.high


def _outcome(result: PlannedEstimate, size: SampleSize) -> str:
    if result.reason is not None:
        return sentence("sample-size", "absent", reason=result.reason)
    absent = f" ({result.n_missing} ratings missing)" if result.n_missing else ""
    words = {
        "items": counted(len(result.items), "item"),
        "raters": counted(len(result.raters), "rater"),
        "missing": absent,
    }
    ends = _ends(result)
    if ends is None:
        return sentence("sample-size", "no_interval", **words)
    half = 0.5 * (ends[1] - ends[0])
    low, high = (number(end, 3) for end in ends)
    words.update(half_width=number(half, 3), low=low, high=high)
    limit = size.half_width or size.expected_half_width
    if limit is None:
        return sentence("sample-size", "interval", **words)
    name = "narrow" if half <= limit else "wide"
    what = "wanted" if size.half_width else "expected"
    return sentence("sample-size", name, **words, what=what, limit=number(limit, 3))


def _rows(result: PlannedEstimate, size: SampleSize) -> tuple[tuple[Value, ...], ...]:
    planned = (
        size.n_items,
        size.n_raters,
        size.value,
        size.expected_half_width,
        size.expected_low,
        size.expected_high,
        size.assurance,
        size.power,
    )
    ends = _ends(result)
    came: tuple[Value, ...] = (
        *(len(result.items) or None, len(result.raters) or None),
        None if result.estimate is None else result.estimate.value,
        *((None,) * 3 if ends is None else (0.5 * (ends[1] - ends[0]), *ends)),
        *(None, None),
    )
    return (
        (result.line.id, "planned", *planned),
        (result.line.id, "came", *came),
    )
