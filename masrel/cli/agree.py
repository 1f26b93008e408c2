"""``masrel agree``: agreement of any file of ratings, no study needed."""

import shlex
import shutil
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    EstimateOptions,
    check_order,
    entries,
    estimate_rows,
    group_key,
)
from masrel.cli._agree_options import (
    FurtherOptions,
    estimate_options,
    further_options,
)
from masrel.cli._options import (
    OutputOptions,
    echo_notes,
    grouped,
    output_options,
    write_output,
)
from masrel.cli._paths import InputFile
from masrel.cli._reading import (
    read_file,
    reading_options,
    table_options,
    what_was_read,
)
from masrel.errors import MasrelWarning, ParameterError, RatingsError
from masrel.ratings._findings import ReadingOptions

if TYPE_CHECKING:
    from masrel.agreement import Coefficient
    from masrel.plots._drawn_values import Content, Drawn
    from masrel.ratings import RatingsFile
    from masrel.tables._tables import Table

_WIDTHS = (88, 100)
"""Width of notes where there is no terminal, and the largest in one."""

_DRAWERS = {
    "diagnosis_pairs": "masrel.plots._rater_pairs:rater_figure",
    "limits_of_agreement": "masrel.plots._limits_figure:limits_figure",
}

_ARGUMENTS = "masrel.arguments"
"""Where the context of a command keeps its arguments as they were typed."""


class _WithArguments(click.Command):
    """A command that keeps its arguments as they were typed."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Keep the arguments before they are taken apart."""
        ctx.meta[_ARGUMENTS] = tuple(args)
        return super().parse_args(ctx, args)


@click.command("agree", cls=_WithArguments)
@click.argument("file", type=InputFile(path_type=Path, allow_dash=True))
@grouped(
    "reading",
    ReadingOptions,
    *reading_options,
    *table_options,
    click.option("--by", metavar="COL", help="Estimate each group of this column."),
    click.option(
        "--stream/--no-stream",
        default=None,
        help="Read batch by batch, as files larger than memory are (Parquet, text); by "
        "size unless given.",
    ),
    click.option(
        "--clusters",
        metavar="COL",
        help="Column of the clusters that items come in, such as patients with several "
        "sites: they are left out as a whole.",
    ),
)
@estimate_options
@further_options
@click.option(
    "--explain", is_flag=True, help="Say in notes what every interval promises."
)
@output_options(
    json="Write a record of all here; - prints it, and nothing else, on stdout.",
    figure="Draw the intervals into this .png, .svg or .pdf; needs --target, "
    "--diagnose or --limits-of-agreement.",
    csv="Print every digit as CSV.",
    latex="Print a LaTeX table.",
    sentence="Print a sentence for a paper instead of the table, one an estimate.",
)
def agree(
    file: Path,
    reading: ReadingOptions,
    options: EstimateOptions,
    further: FurtherOptions,
    explain: bool,
    output: OutputOptions,
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a table in whatever shape a program left it: text, a workbook, Parquet,
    JSON, SPSS, Stata, SAS, packed or not; one row an item and a column a rater, or
    one row a rating. "-" reads standard input. What was read is shown; what could be
    read in two ways is refused with the option that decides.
    """
    options = further.checked(options, reading.by, reading.clusters)
    if output.figure is not None and options.target is None and not further.has_figure:
        raise ParameterError(
            "--figure: shows intervals, so it needs --target raters, items or both"
        )
    ratings = read_file(file, reading)
    by, groups = _groups(ratings, further, file)
    others = ratings
    if further.reference is not None:
        from masrel.analysis._file_questions import without_reference

        others = without_reference(ratings, further.reference)
    # what does not fit these tables is said first: it says most
    answers = _further_answers(ratings, others, further, options)
    rows = _estimate(others, groups, further.between_raters(others, options))
    if rows:
        heads = {} if by is None else {group_key(by): by}
        agreement = Answer(
            name="agreement",
            rows=[dict.fromkeys(heads, row.group) for row in rows],
            heads=heads,
            of=ratings.read["file"],
            estimates=rows,
        )
        answers.insert(0, agreement)
    _write(
        _FileAgreement(
            ratings=others,
            reading=reading,
            options=options,
            answers=answers,
            explain=explain,
        ),
        output,
    )


def _groups(
    ratings: "RatingsFile", further: FurtherOptions, file: Path
) -> tuple[str | None, list[str]]:
    # what tells parts apart, and what each is called
    if further.retest:
        from masrel.analysis._file_questions import label, part_names

        names = [part_names(ratings, part) for part in ratings.parts]
        return ", ".join(names[0]) or None, [label(of.values()) for of in names]
    sessions = list(dict.fromkeys(str(part.session) for part in ratings.parts))
    if len(sessions) > 1:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({', '.join(sessions)}), so that "
            "raters graded the same item more than once; "
            f"--by {ratings.read['session']} estimates each"
        )
    return ratings.read["by"], [part.group or "" for part in ratings.parts]


def _estimate(
    ratings: "RatingsFile", groups: list[str], options: EstimateOptions | None
) -> "list[AgreementRow]":
    if options is None:
        return []
    return [
        row
        for part, group in zip(ratings.parts, groups, strict=True)
        for row in estimate_rows(
            part,
            group=group,
            n_raters=len(part.raters) or ratings.read["n_raters"],
            scale=ratings.scale,
            is_ordered=ratings.is_ordered,
            options=options,
        )
    ]


def _further_answers(
    file: "RatingsFile",
    others: "RatingsFile",
    further: FurtherOptions,
    options: EstimateOptions,
) -> "list[Answer]":
    """Return what was asked beside agreement; for what was not, nothing is loaded."""
    # others: the same without the reference
    if not further.record():
        return []
    check_order(options, file.scale, file.is_ordered)
    from masrel.analysis import _file_questions as questions

    answers = []
    with warnings.catch_warnings():
        # Every note is in a result, and so below its table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        if further.retest:
            answers.append(questions.retest(file, options))
        if further.each_category:
            answers.append(questions.categories(others, options))
        if further.diagnose:
            entry, of_one = _diagnosed(file, options)
            answers += questions.diagnosis(file, entry, of_one, further.reference)
        if further.symmetry:
            answers.append(questions.symmetry(others))
        if further.indices:
            answers.append(questions.indices(others))
        if further.limits_of_agreement:
            answers.append(questions.limits(others, options, further.unit))
        between = further.between_raters(others, options)
        if further.compare and between is not None:
            answers += _comparisons(others, between)
    return answers


def _diagnosed(
    file: "RatingsFile", options: EstimateOptions
) -> "tuple[Coefficient, EstimateOptions]":
    # the one coefficient of a diagnosis
    if options.takes_all or (options.coefficients is None and options.metric is None):
        options = replace(options, coefficients=["fleiss_kappa"])
    if len(options.names) > 1:
        raise ParameterError(
            "--diagnose: needs one coefficient, got --coefficients "
            f"{','.join(options.names)}"
        )
    n_raters = max(len(part.raters) for part in file.parts)
    (entry,) = entries(options, n_raters, file.scale, file.is_ordered)
    return entry, options


def _comparisons(file: "RatingsFile", options: EstimateOptions) -> "list[Answer]":
    from masrel.analysis._file_comparisons import difference_rows, equality_rows

    n_raters = max(len(part.raters) for part in file.parts) or file.read["n_raters"]
    of_all = entries(options, n_raters, file.scale, file.is_ordered)
    answers = [difference_rows(file, of_all, options)]
    if len(file.parts) > 2:  # of two the difference says it
        answers.append(equality_rows(file, of_all, options))
    return answers


@dataclass(frozen=True, slots=True, kw_only=True)
class _FileAgreement:
    """The agreement in a file of ratings: what was read and what was estimated."""

    ratings: "RatingsFile"
    reading: ReadingOptions
    options: EstimateOptions
    answers: "Sequence[Answer]"  # first that of agreement between raters, if any is
    explain: bool  # whether notes say what every interval promises

    @property
    def rows(self) -> "Sequence[AgreementRow]":
        """The estimates between raters."""
        first = self.answers[0]
        return first.estimates if first.name == "agreement" else ()

    def notes(self) -> tuple[str, ...]:
        """Return what may have been read wrongly, and what is left out of it."""
        from masrel.agreement import COEFFICIENTS

        # of measurements it is warned unless all coefficients weigh how far they lie
        # from each other
        estimates = [row.estimate for row in self.rows]
        is_warned = not estimates or any(
            not COEFFICIENTS[estimate.coefficient].needs_order
            and estimate.weights in ("identity", "nominal")
            for estimate in estimates
        )
        notes = [
            f"warning: {text}"
            for text in self.ratings.warnings
            if is_warned or text.code != "measurements"
        ]
        if self.options.takes_all and not self.ratings.is_ordered:
            notes.append(
                "Left out: the six forms of ICC, Kendall's W and Robinson's A, which "
                "need grades that are numbers or --categories with every grade in "
                "order."
            )
        return tuple(notes)

    def tables(self, data: str, *, in_sentences: bool) -> "list[Table]":
        """Return the table of every answer; the first has what was read."""
        # in_sentences: whether sentences take the place of that of agreement
        from masrel.tables._answer_tables import answer_table

        first, *more = [
            answer_table(
                answer,
                bands=self.options.words,
                explain=self.explain,
                in_sentences=in_sentences and answer.name == "agreement",
                data=data,
            )
            for answer in self.answers
        ]
        read, notes = tuple(what_was_read(self.ratings)), self.notes()
        return [replace(first, read=read, notes=(*notes, *first.notes)), *more]

    def record(self) -> dict[str, object]:
        """Return everything for JSON."""
        from masrel import __version__
        from masrel.tables._answer_tables import answer_documents

        read, scale = dict(self.ratings.read), self.ratings.scale
        record: dict[str, object] = {
            "masrel": __version__,
            "file": read.pop("file"),
            "sha256": self.ratings.sha256(),
            "options": {**self.options.record(), "by": read["by"]},
            "scale": {
                "name": scale.name,
                "grades": list(scale.grades),
                "values": list(scale.values),
            },
            "read": {**read, "options": self.reading.record()},
            "notes": list(self.notes()),
            "estimates": [],
        }
        for answer in self.answers:
            key = "estimates" if answer.name == "agreement" else answer.name
            record[key] = answer_documents(answer, self.options.words)
        return record

    def figure(self) -> "Content | Drawn":
        """Return what is drawn: the figure of an answer, else of the estimates."""
        from masrel.plots._drawn_values import Drawn
        from masrel.tables._answer_tables import agreement_forest

        for answer in self.answers:
            if answer.figure:
                drawer = _DRAWERS[answer.name]
                return Drawn(drawer, (answer.figure, answer.of))
        drawn = self.rows or [row for of in self.answers for row in of.estimates]
        return agreement_forest(drawn, self.options.target or "items")


def _write(agreement: _FileAgreement, output: OutputOptions) -> None:
    """Print and write estimates in the forms that were chosen."""
    from masrel.tables._answer_tables import agreement_sentences
    from masrel.tables._tables import SIMULATED

    ratings, words = agreement.ratings, agreement.options.words
    is_sentence = output.sentence and bool(agreement.rows)
    data = "simulated" if ratings.simulated else "foreign"
    table, *more = agreement.tables(data, in_sentences=output.sentence)
    shown: Table | str = table
    if is_sentence:
        shown = agreement_sentences(agreement.answers[0], bands=words, data=data)
    width, widest = _WIDTHS
    if sys.stdout.isatty():
        width = min(shutil.get_terminal_size((width, 24)).columns, widest)
    write_output(
        output,
        document=agreement.record,
        text=lambda: shown,
        figure=agreement.figure,
        stamp=SIMULATED if ratings.simulated else "",
        notes=(*table.read, *agreement.notes()),
        more=more,
        width=width,
    )
    if is_sentence:
        echo_notes((*table.read, *table.notes))
    offer = _interval_offer(agreement.rows, agreement.options)
    # what came through a pipe is gone
    if offer is not None and Path(ratings.read["file"]).is_file():
        click.echo(offer, err=True)


def _interval_offer(
    rows: "Sequence[AgreementRow]", options: EstimateOptions
) -> str | None:
    """Return the command that gives an interval, where there is none."""
    from masrel.agreement import COEFFICIENTS

    entries = [COEFFICIENTS[row.estimate.coefficient] for row in rows]
    can = [
        entry.formula is not None and row.estimate.reason is None
        for entry, row in zip(entries, rows, strict=True)
    ]
    if options.target is not None or not any(can):
        return None
    more, but = ["--target", "items"], ""
    without = [e for e in entries if e.formula is None and e.interval_target != "items"]
    if without and not options.takes_all:  # named, they would be refused
        others = (entry.name for entry in entries if entry not in without)
        more = ["--coefficients", ",".join(dict.fromkeys(others)), *more]
        but = f" (without {', '.join(dict.fromkeys(e.title for e in without))})"
    arguments = click.get_current_context().meta[_ARGUMENTS]
    # what follows a -- is no option
    parts = [*more, *arguments] if "--" in arguments else [*arguments, *more]
    command = shlex.join(["masrel", "agree", *parts])
    return f"no interval; for other items like these{but}: {command}"
