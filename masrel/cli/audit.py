"""``masrel audit``: whether any table gives the agreement that a paper prints."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel._input import refuse
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    output_options,
    write_output,
)
from masrel.cli._paths import note_inputs

if TYPE_CHECKING:
    from masrel.audit import Claim

_Texts = Mapping[str, str | tuple[str, str]]

_WIDTH = 88  # of notes below a table
_WEIGHTS = click.Choice(["identity", "linear", "quadratic", "any"])


@click.command("audit", cls=GroupedHelp)
@click.argument("source", required=False, type=click.Path(path_type=Path))
@click.option("--items", "n_items", metavar="INTEGER", help="Number of items.")
@click.option(
    "--categories",
    "n_categories",
    metavar="INTEGER",
    help="Number of categories of the scale.",
)
@click.option(
    "--raters", "n_raters", metavar="INTEGER", help="Raters of each item; default: 2."
)
@click.option(
    "--agreement",
    metavar="TEXT",
    help="Agreement in percent, with the decimals that are printed.",
)
@click.option(
    "--kappa", metavar="TEXT", help="Kappa, with the decimals that are printed."
)
@click.option(
    "--agreement-weights",
    type=_WEIGHTS,
    help="Weights of the agreement; default: identity.",
)
@click.option("--kappa-weights", type=_WEIGHTS, help="Weights of kappa; default: any.")
@click.option(
    "--rounding",
    type=click.Choice(["half_even", "half_up", "either"]),
    help="How ties were rounded; default: either.",
)
@click.option(
    "--margins-1",
    metavar="COUNTS",
    help='Items per category of the first of two raters: "9 11".',
)
@click.option(
    "--margins-2", metavar="COUNTS", help="Items per category of the second rater."
)
@click.option("--standard-error", metavar="TEXT", help="Standard error of kappa.")
@click.option("--interval", nargs=2, metavar="LOW HIGH", help="Interval of kappa.")
@click.option("--level", metavar="FLOAT", help="Level of the interval; default: 0.95.")
@click.option(
    "--p",
    metavar="TEXT",
    help='P-value of the test that kappa is 0: "0.003" or "<0.001".',
)
@click.option(
    "--unrated",
    "n_unrated",
    metavar="INTEGER",
    help="Largest number of items that may have been left out because of a missing "
    "rating.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints '
    "nothing else.",
    csv="Print all readings as CSV.",
    latex="Print the tables as LaTeX.",
    sentence="Print one sentence per claim instead of the tables.",
)
def audit(
    source: Path | None, output: OutputOptions, **printed: str | tuple[str, str] | None
) -> None:
    """Find the tables that give the agreement that a paper reports.

    Give the printed numbers as options, or as SOURCE: a CSV file with one row per
    claim, or a study that has such a file, ratings/claims.csv. Every way to read the
    numbers is tried. If no table fits, the numbers as read contradict each other; the
    reason is unknown.
    """
    # printed: what the options say, by the parameters of a claim
    texts = {name: text for name, text in printed.items() if text is not None}
    claims = (_claim(texts),) if source is None else _claims(source, texts)
    from masrel.audit import audit_claim
    from masrel.tables._claims_table import (
        claims_document,
        claims_table,
        readings_table,
    )

    audits = [audit_claim(claim) for claim in claims]
    table = readings_table if output.csv else claims_table
    write_output(
        output,
        document=lambda: claims_document(audits),
        text=lambda: (
            "\n".join(f"{a.claim.name}: {a.sentence}." for a in audits)
            if output.sentence
            else table(audits)
        ),
        more=(readings_table(audits),) if not (output.csv or output.sentence) else (),
        width=_WIDTH,
    )


def _claims(source: Path, texts: _Texts) -> "tuple[Claim, ...]":
    from masrel.audit import read_claims

    has_own = (
        f"{source}: contains claims, so it cannot be combined with options that give "
        "a claim"
    )
    refuse((texts, has_own))
    file = source
    if source.is_dir():
        from masrel.lab.protocol import StudyPaths

        file = StudyPaths(source).claims_file
        needed = "needs a file of claims, ratings/claims.csv, got none"
        refuse((not file.exists(), f"{source}: {needed}"))
    note_inputs(file)
    return read_claims(file)


def _claim(texts: _Texts) -> "Claim":
    # the claim that the options are
    from masrel.audit._claims import claim_of

    values = {name: text for name, text in texts.items() if isinstance(text, str)}
    values |= dict(zip(("low", "high"), texts.get("interval", ()), strict=False))
    refuse(
        *(
            (name not in texts, f"{name}: needed without a SOURCE, got none")
            for name in ("n_items", "n_categories")
        ),
        *(
            (
                name in texts and other not in texts,
                f"{name}: needs --{other} as well, got none",
            )
            for name, other in _BESIDE.items()
        ),
    )
    return claim_of(values)


# Options that say nothing without another
_BESIDE = {
    "level": "interval",
    "agreement_weights": "agreement",
    "kappa_weights": "kappa",
}
