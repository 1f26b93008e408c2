"""Sections `design` and `sample-size`: what was presented to whom, and to how many."""

import math
from collections.abc import Iterator, Sequence

import msgspec

from masrel.lab.analysis import PlannedEstimate
from masrel.lab.protocol import Protocol, SampleSize
from masrel.lab.protocol._kinds import DEFAULT_KIND, all_values
from masrel.lab.ratings import Rating
from masrel.lab.report._material import (
    MANY_RATERS,
    MODEL,
    Material,
    estimate_titles,
    lacking,
    lines_of,
    macros,
    sentence,
    text_of,
)
from masrel.lab.report._paragraphs import planned_text
from masrel.pages._sections import Content, Paragraph
from masrel.tables._tables import Column, Table, Value, as_entered

_PARAMETERS = (
    ("catch_angle_constant_deg", "L (deg)"),
    ("catch_torque_nms_rad", "H (N·m·s/rad)"),
    ("residual_ratio", "Q"),
    ("catch_travel_deg", "D (deg)"),
)

# Constants of a joint and of its stretch: symbol and meaning.
_CONSTANTS = {
    "inertia_kg_m2": ("m", "inertia (kg·m²)"),
    "damping_nms_rad": ("b", "damping (N·m·s/rad)"),
    "stiffness_nm_rad": ("k", "stiffness (N·m/rad)"),
    "catch_slope_s": ("α", "catch slope (s)"),
    "peak_duration_s": ("ΔT_peak", "duration of the peak (s)"),
    "post_catch_stiffness_nm_rad": ("k_post", "post-catch stiffness (N·m/rad)"),
    "speed_threshold_deg_s": ("ν_th", "speed threshold (deg/s)"),
    "slowest_mean_speed_deg_s": ("ν_L", "slowest mean speed (deg/s)"),
    "smallest_catch_angle_deg": ("θ_L", "smallest catch angle (deg)"),
    "rest_angle_deg": ("θ_rest", "angle without elastic torque (deg)"),
    "catch_rise_s": ("ΔT_rise", "rise of the catch to its peak (s)"),
    "start_deg": ("θ_start", "start of a stretch (deg)"),
    "range_end_deg": ("θ_end", "end of the range of motion (deg)"),
    "post_catch": ("τ post-catch", "definition of the torque after the catch"),
    "residual_reading": ("Q", "definition of Q"),
}

# The constants that are not numbers but the name of a variant.
_VARIANT_NAMES = {
    "continuous": "continuous: continues from the residual torque",
    "additive": "additive: added to the torque before the catch",
    "residual": "residual torque divided by the peak",
    "decrease": "decrease after the peak divided by the rise",
}

# What the table of shared constants leaves out where no model departs from it.
_DEFAULTS = {
    "rest_angle_deg": None,
    "catch_rise_s": 0.0,
    "post_catch": "continuous",
    "residual_reading": "residual",
}

_CONSTANT_COLUMNS = (
    Column(key="symbol", heading="Symbol", align="left"),
    Column(key="meaning", heading="Meaning", align="left"),
    Column(key="value", heading="Value"),
)


def design_section(material: Material) -> Iterator[Content]:
    """Describe the study: models with parameters, raters and sessions."""
    protocol = material.protocol
    study, settings = protocol.study, protocol.simulated_raters
    grades = f"Scale {protocol.scale.name}: {', '.join(protocol.scale.grades)}."
    yield Paragraph(text=f"{study.title}. {planned_text(protocol)} {grades}")
    if study.notes:
        yield Paragraph(text=study.notes)
    if study.source and material.origin != "published":  # else it is in the head
        yield Paragraph(text=f"The study follows {study.source}.")
    if n_simulated := material.ratings.n_by_programs:
        yield Paragraph(
            text=f"{n_simulated} of {len(material.ratings.rows)} grades are simulated: "
            "a simulated rater gives the intended "
            f"grade with probability {as_entered(settings.accuracy)} and repeats a "
            f"grade at a retest with probability "
            f"{as_entered(settings.retest_agreement)} (seed {settings.seed}). They "
            "show that the study runs; they say nothing about people or about the "
            "models."
        )
    yield _models(material)
    yield from _constants(material)
    yield from _other_kinds(material)
    yield _sessions(material)


def _models(material: Material) -> Table:
    models = material.protocol.models
    parameters = [[getattr(model, key) for model in models] for key, _ in _PARAMETERS]
    # as many decimals as the number with most was entered with
    decimals = [
        max(
            len(as_entered(v).partition(".")[2]) if v is not None else 0 for v in values
        )
        for values in parameters
    ]
    shared = material.protocol.elbow.residual_reading
    readings = {model.constants.residual_reading or shared for model in models}
    simulated = [model.id for model in models if model.simulated]
    notes = macros("design.txt", {}).models(sorted(readings), simulated)
    return Table(
        name="models",
        caption="Haptic models and their parameters",
        columns=(
            MODEL,
            Column(key="role", heading="Role", align="left"),
            Column(key="intended_grade", heading="Intended grade", align="center"),
            *(
                Column(key=key, heading=heading, digits=digits)
                for (key, heading), digits in zip(_PARAMETERS, decimals, strict=True)
            ),
        ),
        rows=tuple(
            (model.id, model.role, model.intended_grade, *values)
            for model, *values in zip(models, *parameters, strict=True)
        ),
        notes=tuple(lines_of(notes)),
        data=material.data,
    )


def _constants(material: Material) -> Iterator[Table]:
    # those all models share, and, where there are any, those of single models
    protocol = material.protocol
    values = msgspec.structs.asdict(protocol.elbow)
    values["start_deg"] = protocol.stretch.start_deg
    shared = [
        (*names, _VARIANT_NAMES.get(values[key]) or float(values[key]))
        for key, names in _CONSTANTS.items()
        if values[key] != _DEFAULTS.get(key, "")
    ]
    single = [
        (model.id, *_CONSTANTS[key], _VARIANT_NAMES.get(value) or float(value))
        for model in protocol.models
        for key, value in msgspec.structs.asdict(model.constants).items()
        if value not in (None, values[key])
    ]
    caption = "Constants shared by all models"
    if any(model.kind != DEFAULT_KIND for model in protocol.models):
        caption = "Constants shared by all spastic elbows"
    yield Table(
        name="constants",
        caption=caption + ", except those in the table below" * bool(single),
        columns=_CONSTANT_COLUMNS,
        rows=tuple(shared),
        data=material.data,
    )
    if single:
        yield Table(
            name="own_constants",
            caption="Constants specific to single models",
            columns=(MODEL, *_CONSTANT_COLUMNS),
            rows=tuple(single),
            data=material.data,
        )


def _other_kinds(material: Material) -> Iterator[Table]:
    # every number of the models that are not spastic elbows, if there are any
    others = [m for m in material.protocol.models if m.kind != DEFAULT_KIND]
    numbers = (
        "; ".join(
            f"{key} {'none' if value is None else as_entered(value)}"
            for key, value in all_values(model.kind, model.parameters).items()
        )
        for model in others
    )
    if others:
        heading = "Parameters, by their keys in the protocol"
        yield Table(
            name="other_kinds",
            caption="Models other than spastic elbows",
            columns=(
                MODEL,
                Column(key="kind", heading="Kind", align="left"),
                Column(key="numbers", heading=heading, align="left"),
            ),
            rows=tuple(
                (model.id, model.kind, text)
                for model, text in zip(others, numbers, strict=True)
            ),
            notes=("Keys end in their units; docs/reference/tone explains each.",),
            data=material.data,
        )


def _sessions(material: Material) -> Table:
    protocol, ratings = material.protocol, material.ratings.rows
    graded = [row for row in ratings if row.grade is not None]
    # known of ratings from session logs
    origins = {
        key: heading
        for key, heading in (("grades_from", "Grades from"), ("device", "Device"))
        if any(getattr(row, key) is not None for row in ratings)
    }
    rows, shown = [], []
    for session in protocol.sessions:
        here = [row for row in ratings if row.session == session.id]
        n_raters = len(session.raters)
        few = [*session.raters[:2], "…", session.raters[-1]]
        cells = (
            n_raters * len(protocol.models) * protocol.schedule.repeats,
            sum(row.grade is not None for row in here),
            *(_by_rater(here, key) for key in origins),
            session.note or None,
        )
        rows.append((session.id, n_raters, ", ".join(session.raters), *cells))
        raters = few if n_raters > MANY_RATERS else session.raters
        shown.append((session.id, n_raters, ", ".join(raters), *cells))
    return Table(
        name="sessions",
        caption="Sessions, raters and number of ratings",
        columns=(
            Column(key="session", heading="Session", align="left"),
            Column(key="n_raters", heading="Raters"),
            Column(key="raters", heading="Who", align="left"),
            Column(key="n_planned", heading="Ratings planned"),
            Column(key="n_given", heading="Ratings given"),
            *(Column(key=k, heading=text, align="left") for k, text in origins.items()),
            Column(key="note", heading="Note", align="left"),
        ),
        rows=tuple(rows),
        page_rows=tuple(shown),
        notes=(
            *["The file names all raters."] * (shown != rows),
            *lines_of(macros("design.txt", {}).without(protocol, graded)),
        ),
        data=material.data,
    )


def _by_rater(ratings: Sequence[Rating], key: str) -> str | None:
    # the value of a column, with the raters who have it where it is not everybody's
    raters: dict[str, dict[str, None]] = {}
    for row in ratings:
        if (value := getattr(row, key)) is not None:
            raters.setdefault(value, {})[row.rater] = None
    if len(raters) < 2:
        return next(iter(raters), None)
    return "; ".join(f"{value}: {', '.join(who)}" for value, who in raters.items())


_SIZES = (
    Column(key="title", heading="Estimate", align="left", where="page"),
    Column(key="estimate", heading="Estimate", where="csv"),
    Column(key="what", heading="Planned or obtained", align="left"),
    Column(key="n_items", heading="Items"),
    Column(key="n_raters", heading="Raters"),
    Column(key="value", heading="Value", digits=3),
    Column(key="half_width", heading="Half-width", digits=3),
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
    Column(key="assurance", heading="Assurance", digits=3),
    Column(key="power", heading="Power", digits=3),
)


def sample_size_section(material: Material) -> Iterator[Content]:
    """Show how the size was chosen, as the protocol says it, and what was obtained."""
    sizes = material.protocol.analysis.sample_sizes
    if not sizes:
        yield lacking(sentence("sample-size", "nothing"))
        return
    of_line = {planned.line.id: planned for planned in material.analysis.estimates}
    titles = estimate_titles([planned.line for planned in of_line.values()])
    rows: list[tuple[Value, ...]] = []
    for size in sizes:
        result = of_line[size.estimate]
        planned = size_sentence(material.protocol, size)
        obtained = text_of("design.txt", "outcome", result, size, *_ends(result))
        yield Paragraph(text=f"{titles[size.estimate]}: {planned} {obtained}")
        rows += _size_rows(titles[size.estimate], result, size)
    yield Table(
        name="sample_size",
        caption="Size of the study, as planned and as obtained",
        columns=_SIZES,
        rows=tuple(rows),
        notes=(sentence("sample-size", "planned"),),
        data=material.data,
    )


def size_sentence(protocol: Protocol, size: SampleSize) -> str:
    """Say what a protocol states that a size can show."""
    # imported here: a report without such a section loads nothing of planning
    from masrel.planning import Plan
    from masrel.tables._planning_tables import planning_sentence

    # the plan as it is written: nothing is computed
    line = next(e for e in protocol.analysis.estimates if e.id == size.estimate)
    plan = Plan(
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
    return planning_sentence(plan)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


_Ends = tuple[float, float, float] | tuple[None, None, None]


def _ends(result: PlannedEstimate) -> _Ends:
    # half the width and the ends of the interval that came, if it has both
    interval = None if result.estimate is None else result.estimate.interval
    if interval is None or math.isnan(interval.high - interval.low):
        return None, None, None
    return 0.5 * (interval.high - interval.low), interval.low, interval.high


def _size_rows(
    title: str, result: PlannedEstimate, size: SampleSize
) -> list[tuple[Value, ...]]:
    names = (
        *("n_items", "n_raters", "value", "expected_half_width"),
        *("expected_low", "expected_high", "assurance", "power"),
    )
    obtained = (
        *(len(result.items) or None, len(result.raters) or None),
        *(getattr(result.estimate, "value", None), *_ends(result), None, None),
    )
    return [
        (title, result.line.id, "planned", *(getattr(size, name) for name in names)),
        (title, result.line.id, "obtained", *obtained),
    ]
