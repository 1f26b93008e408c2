"""``masrel audit``: whether any table gives the agreement that a paper prints."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._options import (
    OutputOptions,
    grouped,
    output_options,
    write_output,
)
from masrel.cli._paths import note_inputs
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.audit import Claim
    from masrel.tables._tables import Table

_WIDTH = 88  # of notes below a table
_WEIGHTS = click.Choice(["identity", "linear", "quadratic", "any"])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Printed:
    """What the options say of one claim."""

    n_items: int | None
    n_categories: int | None
    n_raters: int | None
    agreement: str | None
    kappa: str | None
    agreement_weights: str | None
    kappa_weights: str | None
    rounding: str | None
    margins_1: str | None
    margins_2: str | None
    standard_error: str | None
    interval: tuple[str, str] | None
    level: float | None
    p: str | None
    n_unrated: int | None

    def values(self) -> dict[str, object]:
        """Return the parameters of a claim that were said."""
        from masrel.audit._claims import margins_of

        values: dict[str, object] = {
            name: getattr(self, name)
            for name in self.__dataclass_fields__
            if getattr(self, name) is not None
        }
        for key in ("margins_1", "margins_2"):
            if key in values:
                values[key] = margins_of(key, str(values[key]))
        if self.interval is not None:
            del values["interval"]
            values["low"], values["high"] = self.interval
        return values


@click.command("audit")
@click.argument("source", required=False, type=click.Path(path_type=Path))
@grouped(
    "printed",
    _Printed,
    click.option("--items", "n_items", type=int, help="Items that were rated."),
    click.option("--categories", "n_categories", type=int, help="Of the scale."),
    click.option("--raters", "n_raters", type=int, help="Of each item; default: 2."),
    click.option(
        "--agreement", metavar="TEXT", help="In percent, with the decimals printed."
    ),
    click.option("--kappa", metavar="TEXT", help="With the decimals printed."),
    click.option(
        "--agreement-weights",
        type=_WEIGHTS,
        help="Of the agreement; default: identity.",
    ),
    click.option("--kappa-weights", type=_WEIGHTS, help="Of kappa; default: any."),
    click.option(
        "--rounding",
        type=click.Choice(["half_even", "half_up", "either"]),
        help="What became of ties; default: either.",
    ),
    click.option(
        "--margins-1",
        metavar="COUNTS",
        help='Items per category of the first of two raters: "9 11".',
    ),
    click.option("--margins-2", metavar="COUNTS", help="Those of the second."),
    click.option("--standard-error", metavar="TEXT", help="Of kappa."),
    click.option(
        "--interval", nargs=2, metavar="LOW HIGH", help="The interval of kappa."
    ),
    click.option("--level", type=float, help="Of the interval; default: 0.95."),
    click.option("--p", metavar="TEXT", help='Of kappa 0: "0.003" or "<0.001".'),
    click.option(
        "--unrated",
        "n_unrated",
        type=int,
        help="Items at most that may have been left out since a rating was absent.",
    ),
)
@output_options(
    json="Write every reading here; - prints it, and nothing else, on stdout.",
    csv="Print every reading as CSV.",
    latex="Print LaTeX tables.",
    sentence="Print a sentence a claim instead of the tables.",
)
def audit(source: Path | None, printed: _Printed, output: OutputOptions) -> None:
    """Say which tables give the agreement that a paper prints, by every reading of it.

    What is printed comes as options, or SOURCE is a CSV file with a claim a row, or a
    study that has such a file, ratings/claims.csv. No table at all means that the
    numbers cannot belong together as they were read; it does not say why.
    """
    claims = _claims(source, printed)
    from masrel.audit import audit_claim
    from masrel.tables._claims_table import (
        claims_document,
        claims_table,
        readings_table,
    )

    audits = [audit_claim(claim) for claim in claims]

    def text() -> "Table | str":
        if output.sentence:
            return "\n".join(f"{a.claim.name}: {a.sentence}." for a in audits)
        return (readings_table if output.csv else claims_table)(audits)

    is_table = not (output.csv or output.sentence)
    write_output(
        output,
        document=lambda: claims_document(audits),
        text=text,
        more=(readings_table(audits),) if is_table else (),
        width=_WIDTH,
    )


def _claims(source: Path | None, printed: _Printed) -> "tuple[Claim, ...]":
    from masrel.audit import read_claims

    if source is None:
        try:
            return (_of_options(printed),)
        except ParameterError as error:  # its message begins with the parameter
            names, _, rest = str(error).partition(":")
            options = ", ".join(_OPTIONS.get(n, f"--{n}") for n in names.split(", "))
            raise ParameterError(f"{options.replace('_', '-')}:{rest}") from None
    if any(value is not None for value in dataclasses.astuple(printed)):
        raise ParameterError(
            f"{source}: has claims of its own, so it needs no option that has one"
        )
    file = source
    if source.is_dir():
        from masrel.lab.protocol import StudyPaths

        file = StudyPaths(source).claims_file
    if source.is_dir() and not file.exists():
        raise ParameterError(
            f"{source}: needs a file of claims, ratings/claims.csv, got none"
        )
    note_inputs(file)
    return read_claims(file)


_OPTIONS = {
    "n_items": "--items",
    "n_categories": "--categories",
    "n_raters": "--raters",
    "n_unrated": "--unrated",
    "low": "--interval",
    "high": "--interval",
}
"""Options that are not called as the parameter."""

_BESIDE = {
    "level": "interval",
    "agreement_weights": "agreement",
    "kappa_weights": "kappa",
}
"""Options that say nothing without another."""


def _of_options(printed: _Printed) -> "Claim":
    from masrel.audit import Claim

    values = printed.values()
    for name in ("n_items", "n_categories"):
        if name not in values:
            raise ParameterError(f"{name}: needed without a SOURCE, got none")
    for name, other in _BESIDE.items():
        if getattr(printed, name) is not None and getattr(printed, other) is None:
            raise ParameterError(f"{name}: needs --{other} beside it, got none")
    return Claim(**values)  # type: ignore[arg-type]
