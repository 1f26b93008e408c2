"""Section `design`: what was presented to whom, with the constants of the joints."""

from collections.abc import Sequence
from typing import Any

import msgspec

from masrel.lab.protocol import Occasions, PresentationRules
from masrel.lab.protocol._kinds import DEFAULT_KIND, all_values
from masrel.lab.ratings import Rating
from masrel.lab.report._figure_data import MANY_RATERS
from masrel.lab.report._material import Material
from masrel.lab.schedule._orders import orders_in_words
from masrel.pages._sections import Paragraph, Section
from masrel.tables._tables import (
    Column,
    Table,
    Value,
    as_entered,
    counted,
)

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
    "post_catch": ("τ post-catch", "reading of the torque after the catch"),
    "residual_reading": ("Q", "reading of Q"),
}

# The constants that are no numbers but the name of a variant.
_VARIANT_NAMES = {
    "continuous": "continuous: from the residual torque on",
    "additive": "additive: to the torque of pre-catch",
    "residual": "residual over peak torque",
    "decrease": "decrease after the peak over the rise",
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


def design_section(material: Material) -> Section:
    """Describe the study: models with parameters, raters and sessions."""
    protocol = material.protocol
    study, settings = protocol.study, protocol.simulated_raters
    n_models = len(protocol.models)
    n_standard = sum(model.role == "standard" for model in protocol.models)
    texts = [
        f"{study.title}. {counted(n_models, 'haptic model')} ({n_standard} "
        f"standard, {n_models - n_standard} dummy), "
        f"{counted(len(protocol.raters), 'rater')}, "
        f"{counted(len(protocol.sessions), 'session')}; scale {protocol.scale.name}: "
        f"{', '.join(protocol.scale.grades)}."
    ]
    stretches = stretches_asked_for(protocol.presentation)
    if stretches:
        texts[0] += f" {stretches}"
    texts[0] += beside_presentations(protocol.occasions)
    if protocol.schedule.scheme != "random-order":
        texts[0] += (
            " In each session a rater meets the models in "
            f"{orders_in_words(protocol.schedule)}."
        )
    if study.notes:
        texts.append(study.notes)
    if study.source and material.data != "published":  # else it is in the head
        texts.append(f"The study follows {study.source}.")
    n_simulated = len(material.ratings.rows) - material.ratings.n_from_persons
    if material.ratings.simulated and n_simulated:
        texts.append(
            "The grades are simulated: every simulated rater gives the intended grade "
            f"with probability {as_entered(settings.accuracy)} and repeats a grade at "
            f"a retest with probability {as_entered(settings.retest_agreement)} (seed "
            f"{settings.seed}). They show that the study runs; they say nothing about "
            "people or about the models."
        )
    tables = (
        _models(material),
        *_constants(material),
        *_other_kinds(material),
        _sessions(material),
    )
    paragraphs = (Paragraph(text=text) for text in texts)
    return Section(name="design", title="Design", blocks=(*paragraphs, *tables))


def stretches_asked_for(rules: PresentationRules) -> str:
    """Say how often a rater stretches the arm for one grade, unless it is once."""
    if rules.stretches == "free":
        return "Before each grade a rater stretches the arm as often as wanted."
    if isinstance(rules.stretches, tuple):
        speeds = {
            "slow": f"slow (V1, at most {as_entered(rules.slow_speed_deg_s)} deg/s)",
            "fast": f"fast (V3, at least {as_entered(rules.fast_speed_deg_s)} deg/s)",
        }
        cues = ", then ".join(speeds[cue] for cue in rules.stretches)
        return f"Before each grade a rater stretches the arm as told: {cues}."
    if rules.stretches > 1:
        return f"Before each grade a rater stretches the arm {rules.stretches} times."
    return ""


def beside_presentations(occasions: Occasions) -> str:
    """Say what a session has beside its presentations: practice and breaks."""
    text = ""
    if occasions.practice:
        models = ", ".join(occasions.practice)
        text += f" Each session begins with practice on {models}, which is not rated."
    if occasions.break_after is not None:
        presentations = counted(occasions.break_after, "presentation")
        minutes = as_entered(occasions.break_minutes)
        text += f" A break of {minutes} min comes after every {presentations}."
    return text


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
    meaning_of_q = "share of the peak of the catch, as each model reads it (see below)"
    if readings == {"residual"}:
        meaning_of_q = "residual over peak torque of the catch"
    elif readings == {"decrease"}:
        meaning_of_q = "decrease after the peak of the catch over the rise to it"
    notes = [
        "L: catch angle constant; H: catch torque per stretching speed; Q: "
        f"{meaning_of_q}; D: angle travelled during the catch."
    ]
    simulated = ", ".join(model.id for model in models if model.simulated)
    if simulated:
        notes.append(f"Fitted to SIMULATED recordings: {simulated}.")
    return Table(
        name="models",
        caption="Haptic models and their parameters",
        columns=(
            Column(key="model", heading="Model", align="left"),
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
        notes=tuple(notes),
        data=material.data,
    )


def _constants(material: Material) -> list[Table]:
    # those all models share, and, where there are any, those of single models
    protocol = material.protocol
    values: dict[str, Any] = {"start_deg": protocol.stretch.start_deg}
    values |= msgspec.structs.asdict(protocol.elbow)
    shared: list[tuple[Value, ...]] = []
    for key, names in _CONSTANTS.items():
        value = values[key]
        if value != _DEFAULTS.get(key, ""):
            shared.append((*names, _VARIANT_NAMES.get(value) or float(value)))
    single: list[tuple[Value, ...]] = []
    for model in protocol.models:
        for key, value in msgspec.structs.asdict(model.constants).items():
            if value is not None and value != values[key]:
                shown = _VARIANT_NAMES.get(value) or float(value)
                single.append((model.id, *_CONSTANTS[key], shown))
    caption = "Constants all models share"
    if any(model.kind != DEFAULT_KIND for model in protocol.models):
        caption = "Constants all spastic elbows share"
    if single:
        caption += ", but for those in the table below"
    tables = [
        Table(
            name="constants",
            caption=caption,
            columns=_CONSTANT_COLUMNS,
            rows=tuple(shared),
            data=material.data,
        )
    ]
    if single:
        by_model = Column(key="model", heading="Model", align="left")
        tables.append(
            Table(
                name="own_constants",
                caption="Constants that single models have of their own",
                columns=(by_model, *_CONSTANT_COLUMNS),
                rows=tuple(single),
                data=material.data,
            )
        )
    return tables


def _other_kinds(material: Material) -> list[Table]:
    # every number of the models that are no spastic elbows, if there are any
    rows: list[tuple[Value, ...]] = []
    for model in material.protocol.models:
        if model.kind == DEFAULT_KIND:
            continue
        numbers = "; ".join(
            f"{key} {'none' if value is None else as_entered(value)}"
            for key, value in all_values(model.kind, model.parameters).items()
        )
        rows.append((model.id, model.kind, numbers))
    if not rows:
        return []
    return [
        Table(
            name="other_kinds",
            caption="Models of other kinds than the spastic elbow",
            columns=(
                Column(key="model", heading="Model", align="left"),
                Column(key="kind", heading="Kind", align="left"),
                Column(
                    key="numbers",
                    heading="Numbers, by the keys of the protocol",
                    align="left",
                ),
            ),
            rows=tuple(rows),
            notes=("Keys end in their units; what each is stands in docs/tone.md.",),
            data=material.data,
        )
    ]


def _by_rater(ratings: Sequence[Rating], key: str) -> str | None:
    # the value of a column, with the raters who have it where it is not everybody's
    raters: dict[str, dict[str, None]] = {}
    for row in ratings:
        if (value := getattr(row, key)) is not None:
            raters.setdefault(value, {})[row.rater] = None
    if len(raters) < 2:
        return next(iter(raters), None)
    return "; ".join(f"{value}: {', '.join(who)}" for value, who in raters.items())


def _without_ratings(material: Material, graded: Sequence[Rating]) -> list[str]:
    notes = []
    sessions = {row.session for row in graded}
    rated = {row.model for row in graded}
    absent = [each.id for each in material.protocol.sessions if each.id not in sessions]
    if absent:
        notes.append(f"No ratings in these data: session {', '.join(absent)}.")
    unrated = [each.id for each in material.protocol.models if each.id not in rated]
    if unrated and rated:
        notes.append(f"Models without ratings in these data: {', '.join(unrated)}.")
    return notes


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
        n_raters = len(session.raters)
        n_planned = n_raters * len(protocol.models) * protocol.schedule.repeats
        n_given = sum(row.session == session.id for row in graded)
        names = ", ".join(session.raters)
        here = [row for row in ratings if row.session == session.id]
        facts = [_by_rater(here, key) for key in origins]
        note = session.note or None
        rows.append((session.id, n_raters, names, n_planned, n_given, *facts, note))
        if n_raters > MANY_RATERS:
            names = ", ".join([*session.raters[:2], "…", session.raters[-1]])
        shown.append((session.id, n_raters, names, n_planned, n_given, *facts, note))
    notes = [] if shown == rows else ["The file names all raters."]
    notes += _without_ratings(material, graded)
    return Table(
        name="sessions",
        caption="Sessions, their raters, and the ratings there are",
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
        notes=tuple(notes),
        data=material.data,
    )
