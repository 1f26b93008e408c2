"""Options by which a verb says what has changed since an older report."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click

from masrel.cli._options import Decorator, grouped
from masrel.errors import ParameterError


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareOptions:
    """What a report is held against, and whether a change is a failure."""

    against: Path | None
    no_change: bool

    def __post_init__(self) -> None:
        if self.no_change and self.against is None:
            raise ParameterError("--no-change: needs --against, the report to compare")

    def read(self, study: Path) -> dict[str, Any] | None:
        """Return the older analysis of a study; None if nothing is to be compared."""
        if self.against is None:
            return None
        # Imported here, as below: a report that is current is told so without it.
        from masrel.lab.analysis._comparison import read_old_analysis
        from masrel.lab.protocol import StudyPaths, read_protocol

        protocol = read_protocol(StudyPaths(study).protocol)
        return read_old_analysis(self.against, protocol.study.id, option="--against")

    def compare(
        self, old: Mapping[str, Any], new: Mapping[str, Any], *, shows: bool
    ) -> dict[str, object]:
        """Return what has changed as a document, and show it unless JSON is printed."""
        from masrel.lab.analysis._comparison import changed_inputs, changes_between
        from masrel.lab.report._jobs import changes_table
        from masrel.tables._tables import as_text

        changes, inputs = changes_between(old, new), changed_inputs(old, new)
        if shows and changes:
            simulated = bool(old.get("simulated") or new.get("simulated"))
            table = changes_table(
                changes, inputs, str(self.against), simulated=simulated
            )
            click.echo(as_text(table))
        elif shows:
            click.echo(f"no number has changed since {self.against}")
            for line in inputs:
                click.echo(line)
        return {
            "against": str(self.against),
            "changes": [{**asdict(c), "difference": c.difference} for c in changes],
            "inputs": list(inputs),
        }


def compare_options() -> Decorator:
    """Return the options of a comparison, as one argument `comparing` of a command."""
    return grouped(
        "comparing",
        CompareOptions,
        click.option(
            "--against",
            type=click.Path(path_type=Path),
            metavar="OLD",
            help="Say, number by number, what has changed since an older report: its "
            "folder, a study, or an analysis.json.",
        ),
        click.option(
            "--no-change",
            is_flag=True,
            help="With --against: exit with 1 if a number has changed.",
        ),
    )
