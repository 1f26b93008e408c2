"""Sections `intended` and `in-person`: grades against what they should equal."""

from masrel.analysis import InPersonAgreement
from masrel.report._tables import Column, Table, counted, number
from masrel.report.material import Material, Paragraph, Section, absent_section

__all__ = ["in_person_section", "intended_section"]


def intended_section(material: Material) -> Section:
    """Show how many raters gave each standard model its intended grade."""
    found = material.analysis.intended
    title = "Agreement with the intended grade"
    if found is None or not found.models:
        why = None if found is None else found.reason
        return absent_section("intended", title, why)
    table = Table(
        name="intended",
        caption=f"Raters who gave the intended grade, session {found.session}",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="intended_grade", heading="Intended grade", align="center"),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="n_agree", heading="As intended"),
            Column(key="percent", heading="Percent", digits=1),
        ),
        rows=tuple(
            (row.model, row.intended_grade, row.n_ratings, row.n_agree, row.percent)
            for row in found.models
        ),
        notes=() if found.reason is None else (f"Mean or SD: {found.reason}.",),
        data=material.data,
    )
    said = (
        f"Mean over the {counted(len(found.models), 'standard model')}: "
        f"{number(found.mean, 1)} % (standard deviation between models "
        f"{number(found.sd, 1)}, n − 1)."
    )
    return Section(name="intended", title=title, blocks=(table, Paragraph(text=said)))


def in_person_section(material: Material) -> Section:
    """Show grades given to patients beside those given to their models."""
    found = material.analysis.in_person
    title = "In-person and haptic grades"
    if found is None or found.n_pairs == 0:
        why = None if found is None else found.reason
        return absent_section("in-person", title, why)
    percent = number(100 * found.n_equal / found.n_pairs, 1)
    said = f"{found.n_equal} of {found.n_pairs} pairs are equal ({percent} %)."
    if found.n_unpaired:
        said += f" Entries that lack one of the two grades: {found.n_unpaired}."
    return Section(
        name="in-person",
        title=title,
        blocks=(Paragraph(text=said), _pairs(material, found)),
    )


def _pairs(material: Material, found: InPersonAgreement) -> Table:
    return Table(
        name="in_person",
        caption=(
            "Grade of the patient in person and of the model built from that patient, "
            f"by the same rater (session {found.session})"
        ),
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="rater", heading="Rater", align="left"),
            Column(key="in_person", heading="In person", align="center"),
            Column(key="haptic", heading="Haptic", align="center"),
            Column(key="equal", heading="Equal", align="center"),
        ),
        rows=tuple(
            (
                pair.model,
                pair.rater,
                pair.in_person,
                pair.haptic,
                "yes" if pair.in_person == pair.haptic else "no",
            )
            for pair in found.pairs
        ),
        notes=_remarks(material),
        data=material.data,
    )


def _remarks(material: Material) -> tuple[str, ...]:
    if material.in_person is None:
        return ()
    said = (
        f"{row.rater}, {row.model} (subject {row.subject}, source table "
        f"{row.source_table}): {row.note}"
        for row in material.in_person.rows
        if row.note
    )
    return tuple(dict.fromkeys(said))
