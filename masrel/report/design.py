"""Sections `design` and `grades`: what was presented to whom, and what they said."""

from masrel.protocol import Protocol, Session
from masrel.report._tables import (
    Column,
    Table,
    Value,
    as_entered,
    counted,
    entered_decimals,
)
from masrel.report.constants import constants_tables, reading_of_q
from masrel.report.grid import grade_grid
from masrel.report.material import Drawing, Material, Paragraph, Section

__all__ = ["design_section", "grades_section"]

_PARAMETERS = (
    ("catch_angle_constant_deg", "L (deg)"),
    ("catch_torque_nms_rad", "H (N·m·s/rad)"),
    ("residual_ratio", "Q"),
    ("catch_travel_deg", "D (deg)"),
)


def design_section(material: Material) -> Section:
    """Describe the study: models with parameters, raters and sessions."""
    protocol = material.protocol
    study = protocol.study
    n_standard = sum(1 for model in protocol.models if model.role == "standard")
    said = [
        f"{study.title}. {counted(len(protocol.models), 'haptic model')} ({n_standard} "
        f"standard, {len(protocol.models) - n_standard} dummy), "
        f"{counted(len(protocol.raters), 'rater')}, "
        f"{counted(len(protocol.sessions), 'session')}; scale {protocol.scale.name}: "
        f"{', '.join(protocol.scale.grades)}."
    ]
    said.extend(text for text in (study.notes,) if text)
    if study.source and material.data != "published":  # else it is in the head
        said.append(f"The study follows {study.source}.")
    if material.ratings.simulated:
        said.append(_simulation(protocol))
    return Section(
        name="design",
        title="Design",
        blocks=(
            *(Paragraph(text=text) for text in said),
            _models_table(material),
            *constants_tables(material),
            _sessions_table(material),
        ),
    )


def _simulation(protocol: Protocol) -> str:
    settings = protocol.simulated_raters
    accuracy, again = (
        as_entered(settings.accuracy),
        as_entered(settings.retest_agreement),
    )
    return (
        "The grades are simulated: every simulated rater gives the intended grade with "
        f"probability {accuracy} and repeats a grade at a retest with probability "
        f"{again} (seed {settings.seed}). They show that the study runs; they say "
        "nothing about people or about the models."
    )


def _models_table(material: Material) -> Table:
    models = material.protocol.models
    parameters = [
        tuple(float(getattr(model, key)) for key, _ in _PARAMETERS) for model in models
    ]
    digits = [entered_decimals(values) for values in zip(*parameters, strict=True)]
    notes = [
        "L: catch angle constant; H: catch torque per stretching speed; Q: "
        f"{reading_of_q(material)}; D: angle travelled during the catch."
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
                Column(key=key, heading=heading, digits=decimals)
                for (key, heading), decimals in zip(_PARAMETERS, digits, strict=True)
            ),
        ),
        rows=tuple(
            (model.id, model.role, model.intended_grade, *own)
            for model, own in zip(models, parameters, strict=True)
        ),
        notes=tuple(notes),
        data=material.data,
    )


def _sessions_table(material: Material) -> Table:
    rows = [_session_row(material, session) for session in material.protocol.sessions]
    absent = [str(row[0]) for row in rows if row[4] == 0]
    notes = [f"No ratings in these data: session {', '.join(absent)}."]
    return Table(
        name="sessions",
        caption="Sessions, their raters, and the ratings there are",
        columns=(
            Column(key="session", heading="Session", align="left"),
            Column(key="n_raters", heading="Raters"),
            Column(key="raters", heading="Who", align="left"),
            Column(key="n_planned", heading="Ratings planned"),
            Column(key="n_given", heading="Ratings given"),
            Column(key="note", heading="Note", align="left"),
        ),
        rows=tuple(rows),
        notes=tuple(notes if absent else ()),
        data=material.data,
    )


def _session_row(material: Material, session: Session) -> tuple[Value, ...]:
    protocol, table = material.protocol, material.ratings.table
    of_session = table[table["session"] == session.id]
    n_raters = len(session.raters)
    return (
        session.id,
        n_raters,
        ", ".join(session.raters),
        n_raters * len(protocol.models) * protocol.schedule.repeats,
        int(of_session["grade"].notna().sum()),
        session.note or None,
    )


def grades_section(material: Material) -> Section:
    """Show every grade of every session."""
    blocks: list[Paragraph | Table | Drawing] = []
    for session in material.sessions:
        blocks.extend(grade_grid(material, session))
    if not blocks:
        blocks.append(Paragraph(text="These data hold no ratings.", absent=True))
    return Section(name="grades", title="Grades", blocks=tuple(blocks))
