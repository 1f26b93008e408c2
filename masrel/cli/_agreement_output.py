"""How `masrel agree` shows what it estimated, and what it says of it."""

import shlex
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.analysis._file_estimates import AgreementRow, EstimateOptions
from masrel.cli._options import OutputOptions, echo_notes, write_output
from masrel.cli._reading import ReadingOptions, what_was_read

if TYPE_CHECKING:
    from masrel.plots._drawn_values import Content
    from masrel.ratings import RatingsFile
    from masrel.tables._further_tables import FurtherTable
    from masrel.tables._tables import Table


_WIDTHS = (88, 100)
"""Width of notes where there is no terminal, and the largest in one."""

ARGUMENTS = "masrel.arguments"
"""Where the context of a command keeps its arguments as they were typed."""


class WithArguments(click.Command):
    """A command that keeps its arguments as they were typed."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Keep the arguments before they are taken apart."""
        ctx.meta[ARGUMENTS] = tuple(args)
        return super().parse_args(ctx, args)


@dataclass(frozen=True, slots=True, kw_only=True)
class FileAgreement:
    """The agreement in a file of ratings: what was read and what was estimated."""

    ratings: "RatingsFile"
    reading: ReadingOptions
    options: EstimateOptions
    by: str | None  # what tells groups apart
    rows: "Sequence[AgreementRow]"
    # tables below that of the estimates, or in its place if there are none
    further: "Sequence[FurtherTable]"
    explain: bool  # whether notes say what every interval promises

    @property
    def data(self) -> str:
        """Where the ratings come from, as tables have it."""
        return "simulated" if self.ratings.simulated else "foreign"

    def notes(self) -> tuple[str, ...]:
        """Return what may have been read wrongly, and what is left out of it."""
        from masrel.ratings._grade_texts import MEASUREMENTS

        is_warned = not self._weighs_distances()
        warnings = tuple(
            f"warning: {text}"
            for text in self.ratings.warnings
            if is_warned or MEASUREMENTS not in text
        )
        if self.ratings.is_ordered or not self.options.takes_all:
            return warnings
        return (
            *warnings,
            "Left out: the six forms of ICC, Kendall's W and Robinson's A, which need "
            "grades that are numbers or --categories with every grade in order.",
        )

    def tables(self, *, in_sentences: bool) -> "list[Table]":
        """Return the table of the estimates and those below it."""
        # in_sentences: whether sentences take the place of the first
        from masrel.tables._agreement_table import agreement_table

        read, notes = tuple(what_was_read(self.ratings)), self.notes()
        more = [other.table for other in self.further]
        if more and not self.rows:
            first, *more = more
            return [replace(first, read=read, notes=(*notes, *first.notes)), *more]
        table = agreement_table(
            self.rows,
            caption=f"Agreement of the raters in {self.ratings.read['file']}",
            by=self.by,
            bands=self.options.words,
            read=read,
            notes=notes,
            explain=self.explain,
            in_sentences=in_sentences,
            data=self.data,
        )
        return [table, *more]

    def sentences(self) -> str:
        """Return a sentence for every estimate."""
        from masrel.tables._agreement_table import agreement_sentences

        words = self.options.words
        return agreement_sentences(self.rows, by=self.by, bands=words, data=self.data)

    def record(self) -> dict[str, object]:
        """Return everything for JSON."""
        from masrel.tables._agreement_table import agreement_record

        read = self.ratings.read
        record = agreement_record(
            self.rows,
            read={
                "file": read["file"],
                "sha256": self.ratings.sha256(),
                **read,
                "options": self.reading.record(),
            },
            options={**self.options.record(), "by": read["by"]},
            scale=self.ratings.scale,
            notes=self.notes(),
            by=self.by,
            bands=self.options.words,
        )
        return record | {other.key: other.documents for other in self.further}

    def figure(self) -> "Callable[[], Content] | None":
        """Return what makes the figure: that of a table, else of the estimates."""
        from masrel.tables._agreement_table import agreement_forest

        for other in self.further:
            if other.figure is not None:
                content = other.figure
                return lambda: content
        target = self.options.target
        if target is None:
            return None
        drawn = self.rows or [row for other in self.further for row in other.rows]
        return lambda: agreement_forest(drawn, target)

    def _weighs_distances(self) -> bool:
        """Whether every coefficient weighs how far grades lie from each other."""
        from masrel.agreement import COEFFICIENTS

        estimates = [row.estimate for row in self.rows]
        return bool(estimates) and all(
            COEFFICIENTS[estimate.coefficient].needs_order
            or estimate.weights not in ("identity", "nominal")
            for estimate in estimates
        )


def write_agreement(agreement: FileAgreement, output: OutputOptions) -> None:
    """Print and write estimates in the forms that were chosen."""
    from masrel.tables._tables import SIMULATED

    ratings, is_sentence = agreement.ratings, output.sentence and bool(agreement.rows)
    table, *more = agreement.tables(in_sentences=output.sentence)
    read_lines = table.read
    write_output(
        output,
        document=agreement.record,
        text=lambda: agreement.sentences() if is_sentence else table,
        figure=agreement.figure(),
        stamp=SIMULATED if ratings.simulated else "",
        notes=(*read_lines, *agreement.notes()),
        more=more,
        width=_screen_width(),
    )
    if is_sentence:
        echo_notes((*read_lines, *table.notes))
    offer = _interval_offer(agreement.rows, agreement.options)
    # what came through a pipe is gone
    if offer is not None and Path(ratings.read["file"]).is_file():
        click.echo(offer, err=True)


def _screen_width() -> int:
    """Return how wide notes are printed."""
    elsewhere, most = _WIDTHS
    if not sys.stdout.isatty():
        return elsewhere
    return min(shutil.get_terminal_size((elsewhere, 24)).columns, most)


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
    arguments = click.get_current_context().meta[ARGUMENTS]
    # what follows a -- is no option
    parts = [*more, *arguments] if "--" in arguments else [*arguments, *more]
    command = shlex.join(["masrel", "agree", *parts])
    return f"no interval; for other items like these{but}: {command}"
