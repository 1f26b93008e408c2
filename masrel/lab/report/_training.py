"""A training: its learning curve and its confusions as tables, a figure and a page.

In: a `TrainingRecord`. Out: tables, the same as plain values for JSON, a figure, and a
page that needs no other file.
"""

import math
from collections import Counter

from masrel import __version__
from masrel.lab.analysis._results import as_plain
from masrel.lab.protocol import Protocol, protocol_hash
from masrel.lab.report._material import FIGURES
from masrel.lab.training._lessons import (
    CURVE_SETS,
    CurvePoint,
    TrainingRecord,
    learning_curve,
)
from masrel.pages._sections import (
    Document,
    Drawing,
    Paragraph,
    Section,
    chapters,
    drawn_block,
    html_page,
)
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import (
    SIMULATED,
    Column,
    Table,
    counted,
    interval_text,
    number,
    percent,
    tag_of,
)

NOT_RATINGS = "Trainings never enter the ratings of the study."


def outcome(record: TrainingRecord) -> str:
    """Return in words how a training ended."""
    n_presentations = len(record.lessons)
    if record.passed is None:
        return f"continues, {counted(n_presentations, 'presentation')} so far"
    word = "passed" if record.passed else "not passed"
    return f"{word} after {counted(n_presentations, 'presentation')}"


def training_tables(record: TrainingRecord, *, level: float) -> tuple[Table, Table]:
    """Return the learning curve of a training, and which grades were given for which.

    Takes the level of the intervals.
    """
    criterion, grades = record.criterion, record.criterion.grades
    data = "simulated" if record.simulated else "recorded"
    curve = Table(
        name="training",
        caption=f"Training of {record.rater}: {outcome(record)}",
        columns=(
            Column(key="position", heading="Presentations"),
            Column(key="n_right", heading="Right", where="csv"),
            Column(key="n_counted", heading="Of", where="csv"),
            Column(key="right", heading="Right", where="page"),
            Column(key="kappa", heading="Weighted κ", digits=3),
            Column(key="low", heading="Low", where="csv"),
            Column(key="high", heading="High", where="csv"),
            Column(
                key="interval", heading=f"{percent(level)} % interval", where="page"
            ),
            Column(key="evidence", heading="Evidence", digits=2),
        ),
        rows=tuple(
            (
                point.position,
                point.n_right,
                point.n_presentations,
                f"{point.n_right} of {point.n_presentations}",
                point.kappa.value,
                *_ends(point),
                interval_text(*_ends(point)),
                point.evidence,
            )
            for point in learning_curve(record, level=level)
        ),
        notes=(
            f"κ with the intended grades, {criterion.weights} weights, of the last "
            f"{CURVE_SETS * criterion.n_models} presentations; each interval holds "
            "separately.",
            f"Passed once the evidence reaches {number(record.boundary, 2)}. Evidence: "
            f"the largest value, over all runs of at most {criterion.window} "
            "presentations up to the last, of their number times the excess of κ over "
            f"{criterion.reference}.",
            f"At most {number(100.0 * record.false_pass, 1)} % of raters whose κ stays "
            f"at {criterion.insufficient} pass; at most "
            f"{number(100.0 * record.false_fail, 1)} % of raters whose κ is "
            f"{criterion.sufficient} from the start fail (simulated trainees).",
            NOT_RATINGS,
        ),
        data=data,
    )

    freq = Counter((one.intended, one.grade) for one in record.lessons)
    intended = [grade for grade in grades if any(g == grade for g, _ in freq)]
    confusion = Table(
        name="training_grades",
        caption=f"Grades of {record.rater} by intended grade, the whole training",
        columns=(
            Column(key="intended", heading="Intended", align="left"),
            *(Column(key=f"given_{grade}", heading=grade) for grade in grades),
        ),
        rows=tuple((one, *(freq[one, grade] for grade in grades)) for one in intended),
        data=data,
    )
    return curve, confusion


def _ends(point: CurvePoint) -> tuple[float, float]:
    interval = point.kappa.interval
    return (math.nan, math.nan) if interval is None else (interval.low, interval.high)


def training_stamp(record: TrainingRecord, study: str) -> str:
    """Return the line that the figure of a training carries."""
    return SIMULATED if record.simulated else f"{study}, training"


def training_document(record: TrainingRecord, *, level: float) -> dict[str, object]:
    """Return a training as plain values; null for what is undefined."""
    criterion = record.criterion
    document: dict[str, object] = as_plain(
        {
            "rater": record.rater,
            "simulated": record.simulated,
            "enters_ratings": False,
            "passed": record.passed,
            "n_presentations": len(record.lessons),
            "criterion": {
                "weights": criterion.weights,
                "kappa_insufficient": criterion.insufficient,
                "kappa_sufficient": criterion.sufficient,
                "window": criterion.window,
                "max_presentations": criterion.max_presentations,
                "order": criterion.order,
                "boundary": record.boundary,
                "false_pass": record.false_pass,
                "false_fail": record.false_fail,
            },
            "level": level,
            "curve": [_point(point) for point in learning_curve(record, level=level)],
            "lessons": record.lessons,
        }
    )
    return document


def _point(point: CurvePoint) -> dict[str, object]:
    interval, (low, high) = point.kappa.interval, _ends(point)
    return {
        "position": point.position,
        "n_presentations": point.n_presentations,
        "n_right": point.n_right,
        "kappa": point.kappa.value,
        "low": low,
        "high": high,
        "method": None if interval is None else interval.method,
        "evidence": point.evidence,
    }


def learning_content(record: TrainingRecord, *, level: float) -> Drawn:
    """Return what the figure of a training shows."""
    criterion, points = record.criterion, learning_curve(record, level=level)
    code = {grade: at for at, grade in enumerate(criterion.grades)}
    shown = (
        f"Training of {record.rater}: {outcome(record)}",
        [(point.position, point.kappa.value, *_ends(point)) for point in points],
        level,
        (criterion.insufficient, criterion.sufficient),
        [code[one.grade] - code[one.intended] for one in record.lessons],
    )
    return Drawn(FIGURES + "_study_figures:learning_figure", shown)


def training_page(record: TrainingRecord, protocol: Protocol, *, level: float) -> bytes:
    """Return the page of a training; takes the level of its intervals."""
    curve, confusion = training_tables(record, level=level)
    drawing = Drawing(
        name="training",
        caption="Weighted kappa with the intended grades, as presentations went on; "
        "below, by how many grades each was too high",
        alt="Learning curve with its interval; the numbers are in the table below.",
        content=learning_content(record, level=level),
        stamp=training_stamp(record, protocol.study.id),
    )
    blocks = (Paragraph(text=NOT_RATINGS), drawing, curve, confusion)
    section = Section(name="training", title="Training", blocks=blocks)
    document = Document(
        title=f"Training of {record.rater}",
        tag=tag_of(curve.data),
        banner=f"{SIMULATED}: no person gave these grades" * record.simulated,
        provenance=f"Study {protocol.study.id}: {protocol.study.title}",
        result=f"Training of {record.rater}: {outcome(record)}.",
        sections=chapters([section], drawn_block),
        inputs=(("SHA-256 of the protocol", protocol_hash(protocol)),),
        version=__version__,
    )
    return html_page(document).encode()
