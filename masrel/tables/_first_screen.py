"""What is shown first: what was read of a file, the tables of answers, and notes."""

from collections.abc import Sequence
from dataclasses import replace

from masrel.agreement import COEFFICIENTS
from masrel.analysis._file_estimates import Answer, Questions
from masrel.ratings import Finding, RatingsFile
from masrel.tables._answer_tables import answer_table
from masrel.tables._tables import Table, counted

_SHOWN = 12  # raters that are named


def first_screen(
    ratings: RatingsFile,
    questions: Questions,
    answered: Sequence[Answer],
    *,
    explain: bool = False,
    in_sentences: bool = False,
) -> list[Table]:
    """Return the tables of answers, the first with what was read above it."""
    # explain: whether notes say what intervals promise; in_sentences: whether those of
    # estimates are for sentences
    first, *more = [
        answer_table(
            answer,
            bands=questions.words,
            explain=explain,
            in_sentences=in_sentences and answer.name == "agreement",
            data="simulated" if ratings.simulated else "foreign",
        )
        for answer in answered
    ]
    read, notes = what_was_read(ratings), reading_notes(ratings, questions, answered[0])
    return [replace(first, read=tuple(read), notes=(*notes, *first.notes)), *more]


def what_was_read(file: RatingsFile) -> list[str]:
    """Return the lines that say what was read, above a table."""
    read = file.read
    form = [read["format"], read.get("delimiter"), read.get("encoding")]
    if read.get("sheet"):
        form.append(f"sheet {read['sheet']}")
    names = read["raters"]
    raters = ", ".join(names[:_SHOWN])
    if len(names) > _SHOWN:
        raters += f" and {len(names) - _SHOWN} more"
    items = ""
    if read["item"] and read["layout"] != "table":
        columns = [repr(name) if name else "the first column" for name in read["item"]]
        items = f" named by {' and '.join(columns)}"
    if read.get("clusters"):
        items += f" in {counted(read['n_clusters'], 'cluster')} by {read['clusters']!r}"
    if read.get("frequency"):
        items += f" counted by {read['frequency']!r}"
    counts = f"{counted(read['n_items'], 'item')}{items}, "
    counts += counted(read["n_raters"], "rater")
    first = f"Read {', '.join(filter(None, form))}: {counts}"
    return [first + (f" ({raters})." if raters else "."), " ".join(_of_grades(file))]


def _of_grades(file: RatingsFile) -> list[str]:
    read, scale = file.read, file.scale
    grades = list(read["grades"].items())
    listed = ", ".join(f"{grade} ×{n}" for grade, n in grades[:_SHOWN])
    if len(grades) > _SHOWN:
        listed = f"{len(grades)} from {grades[0][0]} to {grades[-1][0]}"
    parts = [f"Grades: {listed}."]
    if read["n_missing"]:
        codes = ", ".join(f"{c or 'empty'} ×{n}" for c, n in read["missing"].items())
        parts.append(f"Missing: {codes or read['n_missing']}.")
    if read["n_repeated"]:
        parts.append(f"Repeated: {read['n_repeated']}, {read['repeated']} taken.")
    if read["dropped"]:
        rows = ", ".join(f"{n} {why}" for why, n in read["dropped"].items())
        parts.append(f"Rows left out: {rows}.")
    if "unit" in read:
        parts.append(f"Unit, left off: {read['unit']}.")
    if "thousands" in read:
        parts.append(f"Thousands mark, left off: {read['thousands']!r}.")
    merged = {g: s for g, s in read["merged"].items() if len(s) > 1}
    if merged:
        same = "; ".join(
            f"{' = '.join(spellings)}" for spellings in list(merged.values())[:_SHOWN]
        )
        parts.append(f"The same grade: {same}.")
    if scale.name == "MAS":
        parts.append(
            f"Scale: the Modified Ashworth Scale, {', '.join(scale.grades)}, told by "
            "its grade 1+; --categories declares another."
        )
    elif scale.name == "observed":
        parts.append(
            "Scale: the grades met (AC and Brennan-Prediger depend on it; --categories "
            "declares another)."
        )
    return parts


def reading_warnings(ratings: RatingsFile, first: Answer) -> tuple[Finding, ...]:
    """Return what may have been read wrongly."""
    # of measurements it is warned unless all coefficients weigh how far they lie from
    # each other
    estimates = [row.estimate for row in first.estimates if first.name == "agreement"]
    is_warned = not estimates or any(
        not COEFFICIENTS[estimate.coefficient].needs_order
        and estimate.weights in ("identity", "nominal")
        for estimate in estimates
    )
    return tuple(
        finding
        for finding in ratings.warnings
        if is_warned or finding.code != "measurements"
    )


def reading_notes(
    ratings: RatingsFile, questions: Questions, first: Answer
) -> list[str]:
    """Return what may have been read wrongly, and what is left out of it."""
    notes = [f"warning: {text}" for text in reading_warnings(ratings, first)]
    if questions.takes_all and not ratings.is_ordered:
        notes.append(
            "Left out: the six forms of ICC, Kendall's W and Robinson's A, which need "
            "grades that are numbers or --categories with every grade in order."
        )
    return notes
