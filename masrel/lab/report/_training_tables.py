"""A training: its learning curve and its confusions as tables, and its figure.

In: a `TrainingRecord`. Out: tables, the same as plain values for JSON, and the figure.
"""

import math
from collections import Counter

from masrel.estimates import Interval
from masrel.lab.report._figure_data import FIGURES, LearningView
from masrel.lab.training._lessons import (
    CURVE_SETS,
    CurvePoint,
    TrainingRecord,
    learning_curve,
)
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import (
    SIMULATED,
    Column,
    Table,
    Value,
    counted,
    interval_text,
    number,
    percent,
)

NOT_RATINGS = "Nothing of a training enters the ratings of the study."


def training_tables(record: TrainingRecord, *, level: float) -> tuple[Table, Table]:
    """Return the learning curve of a training, and which grades were given for which.

    Takes the level of the intervals.
    """
    return _curve_table(record, level), _confusion_table(record)


def outcome(record: TrainingRecord) -> str:
    """Return in words how a training ended."""
    n_presentations = len(record.lessons)
    if record.passed is None:
        return f"goes on, {counted(n_presentations, 'presentation')} so far"
    word = "passed" if record.passed else "not passed"
    return f"{word} after {counted(n_presentations, 'presentation')}"


def _curve_table(record: TrainingRecord, level: float) -> Table:
    points = learning_curve(record, level=level)
    return Table(
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
        rows=tuple(_row(point) for point in points),
        notes=_notes(record),
        data=_data_of(record),
    )


def _row(point: CurvePoint) -> tuple[Value, ...]:
    low, high = _ends(point.kappa.interval)
    return (
        point.position,
        point.n_right,
        point.n_presentations,
        f"{point.n_right} of {point.n_presentations}",
        point.kappa.value,
        low,
        high,
        interval_text(low, high),
        point.evidence,
    )


def _ends(interval: Interval | None) -> tuple[float, float]:
    if interval is None:
        return math.nan, math.nan
    return interval.low, interval.high


def _notes(record: TrainingRecord) -> tuple[str, ...]:
    criterion = record.criterion
    return (
        f"κ with the intended grades, {criterion.weights} weights, of the last "
        f"{CURVE_SETS * criterion.n_models} presentations; each interval holds by "
        "itself.",
        f"Passed at evidence {number(record.boundary, 2)}: the largest, of all runs of "
        f"at most {criterion.window} presentations up to the last, of their number "
        f"times what κ has above {criterion.reference}.",
        f"Of raters whose κ stays at {criterion.insufficient}, at most "
        f"{number(100.0 * record.false_pass, 1)} % pass; of raters whose κ is at "
        f"{criterion.sufficient} from the start, at most "
        f"{number(100.0 * record.false_fail, 1)} % fail, as measured on simulated "
        "trainees.",
        NOT_RATINGS,
    )


def _confusion_table(record: TrainingRecord) -> Table:
    grades = record.criterion.grades
    freq = Counter((one.intended, one.grade) for one in record.lessons)
    intended = [grade for grade in grades if any(g == grade for g, _ in freq)]
    return Table(
        name="training_grades",
        caption=f"Grades of {record.rater} by intended grade, the whole training",
        columns=(
            Column(key="intended", heading="Intended", align="left"),
            *(Column(key=f"given_{grade}", heading=grade) for grade in grades),
        ),
        rows=tuple((one, *(freq[one, grade] for grade in grades)) for one in intended),
        data=_data_of(record),
    )


def training_stamp(record: TrainingRecord, study: str) -> str:
    """Return the line that the figure of a training carries."""
    return SIMULATED if record.simulated else f"{study}, training"


def _data_of(record: TrainingRecord) -> str:
    return "simulated" if record.simulated else "recorded"


def training_document(record: TrainingRecord, *, level: float) -> dict[str, object]:
    """Return a training as plain values; null for what is undefined."""
    criterion = record.criterion
    return {
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
        "curve": [_point(p) for p in learning_curve(record, level=level)],
        "lessons": [
            {
                "position": one.position,
                "model": one.model,
                "intended": one.intended,
                "grade": one.grade,
            }
            for one in record.lessons
        ],
    }


def _point(point: CurvePoint) -> dict[str, object]:
    interval = point.kappa.interval
    low, high = _ends(interval)
    return {
        "position": point.position,
        "n_presentations": point.n_presentations,
        "n_right": point.n_right,
        "kappa": _finite(point.kappa.value),
        "low": _finite(low),
        "high": _finite(high),
        "method": None if interval is None else interval.method,
        "evidence": _finite(point.evidence),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def learning_view(record: TrainingRecord, *, level: float) -> Drawn:
    """Return what the figure of a training shows."""
    points = learning_curve(record, level=level)
    criterion = record.criterion
    code = {grade: at for at, grade in enumerate(criterion.grades)}
    shown = LearningView(
        title=f"Training of {record.rater}: {outcome(record)}",
        positions=tuple(point.position for point in points),
        kappas=tuple((p.kappa.value, *_ends(p.kappa.interval)) for p in points),
        level=level,
        bounds=(criterion.insufficient, criterion.sufficient),
        differences=tuple(
            code[one.grade] - code[one.intended] for one in record.lessons
        ),
    )
    return Drawn(FIGURES + "_learning_figure:learning_figure", (shown,))
