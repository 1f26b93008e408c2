"""Options of `masrel agree` that print another table below that of agreement."""

import warnings
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import click

from masrel.analysis._file_estimates import (
    OF_MEASUREMENTS,
    EstimateOptions,
    check_order,
    entries,
)
from masrel.cli._options import grouped
from masrel.errors import MasrelWarning, ParameterError

if TYPE_CHECKING:
    from masrel.ratings import RatingsFile
    from masrel.tables._further_tables import FurtherTable

_PAIRS = ("stratified_kappa", "pooled_kappa")
"""Coefficients of each rater's grades of two sessions."""


# What is asked for as a coefficient and is a table of its own
_NO_COEFFICIENTS = {
    **dict.fromkeys(("mcnemar", "bowker", "stuart_maxwell", "bhapkar"), "--symmetry"),
    "bland_altman": "--limits-of-agreement",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FurtherOptions:
    """Which tables are printed beside that of agreement."""

    retest: bool
    each_category: bool
    symmetry: bool
    indices: bool
    compare: bool
    diagnose: bool
    reference: str | None
    limits_of_agreement: bool
    unit: str | None

    @property
    def has_figure(self) -> bool:
        """Whether a table has a figure of its own."""
        return self.diagnose or self.limits_of_agreement

    def record(self) -> dict[str, object]:
        """Return the tables that were chosen, the reference and the unit."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if value}

    def checked(
        self, options: EstimateOptions, by: str | None, clusters: str | None
    ) -> EstimateOptions:
        """Return what is estimated between raters, with the defaults of its tables."""
        self._check_own(options)
        if clusters is not None:
            options = self._with_clusters(options)
        if self.compare:
            return self._with_comparison(options, by)
        if self.limits_of_agreement and options.weights == "identity":
            # weights are those of a kappa
            return replace(options, usual=OF_MEASUREMENTS)
        return options

    def _check_own(self, options: EstimateOptions) -> None:
        for name in options.names:
            option = _NO_COEFFICIENTS.get(name.lower().replace("-", "_"))
            if option is not None:
                raise ParameterError(
                    f"--coefficients: needed coefficients, got {name!r}: {option} has "
                    "that table"
                )
        if self.reference is not None and not self.diagnose:
            raise ParameterError("--reference: belongs to --diagnose, got it alone")
        if self.unit is not None and not self.limits_of_agreement:
            raise ParameterError(
                "--unit: belongs to --limits-of-agreement, got it alone"
            )
        if self.diagnose and self.limits_of_agreement:
            raise ParameterError(
                "--diagnose and --limits-of-agreement: each has a figure, so needs one "
                "of them, got both"
            )
        if self.diagnose and options.target in ("raters", "both"):
            raise ParameterError(
                "--diagnose: is of these raters, so its intervals generalise to other "
                f"items: --target items or none, got --target {options.target}"
            )

    def _with_comparison(
        self, options: EstimateOptions, by: str | None
    ) -> EstimateOptions:
        if by is None:
            raise ParameterError(
                "--compare: needs --by with the column that tells the groups apart"
            )
        if options.target not in (None, "items"):
            raise ParameterError(
                "--compare: a difference generalises to other items, so it takes "
                f"--target items, got --target {options.target}"
            )
        return replace(options, target="items")

    def _with_clusters(self, options: EstimateOptions) -> EstimateOptions:
        others = [name for name in self.record() if name != "compare"]
        if others:
            option = others[0].replace("_", "-")
            raise ParameterError(
                f"--clusters: --{option} takes every item by itself, so needs one of "
                "them, got both"
            )
        if options.target not in (None, "items"):
            raise ParameterError(
                "--clusters: what is left out is a cluster of items, so it takes "
                f"--target items, got --target {options.target}"
            )
        return replace(options, target="items")

    def other_raters(self, file: "RatingsFile") -> "RatingsFile":
        """Return the ratings of all but the reference."""
        if self.reference is None:
            return file
        from masrel.analysis._file_parts import without_reference

        return without_reference(file, self.reference)

    def between_raters(
        self, file: "RatingsFile", options: EstimateOptions
    ) -> EstimateOptions | None:
        """Return what is estimated between raters; None where that is nothing."""
        if not self.retest:
            return options
        if all(len(part.raters) == 1 for part in file.parts):
            return None
        if options.coefficients is None:
            return options
        rest = [name for name in options.coefficients if name not in _PAIRS]
        return replace(options, coefficients=rest) if rest else None

    def part_labels(self, file: "RatingsFile") -> tuple[str | None, list[str]]:
        """Return what tells groups and sessions apart, and what each is called."""
        from masrel.analysis._file_parts import label, part_names

        names = [part_names(file, part) for part in file.parts]
        return ", ".join(names[0]) or None, [label(of.values()) for of in names]


further_options = grouped(
    "further",
    FurtherOptions,
    click.option(
        "--retest",
        is_flag=True,
        help="Agreement of each rater with him- or herself in the two sessions of "
        "--session, and of all; stratified_kappa, and pooled_kappa if named.",
    ),
    click.option(
        "--each-category",
        is_flag=True,
        help="Kappa of each category against all others.",
    ),
    click.option(
        "--symmetry",
        is_flag=True,
        help="Tests of change of two raters: McNemar, Bowker, Stuart-Maxwell, Bhapkar.",
    ),
    click.option(
        "--indices",
        is_flag=True,
        help="Of two raters and two categories: PABAK, prevalence, bias, largest "
        "kappa, positive and negative agreement.",
    ),
    click.option(
        "--compare",
        is_flag=True,
        help="Differences between the groups of --by, with p and Holm's adjustment, "
        "and the test that three or more are equal.",
    ),
    click.option(
        "--diagnose",
        is_flag=True,
        help="Which rater, which pair, which category: every pair, all without each "
        "rater, each category, confusions; --figure draws them.",
    ),
    click.option(
        "--reference",
        metavar="RATER",
        help="With --diagnose, the rater that the others are held against, and that is "
        "in no estimate between raters.",
    ),
    click.option(
        "--limits-of-agreement",
        is_flag=True,
        help="Of two raters, the mean of their differences and Bland and Altman's "
        "limits, with exact intervals; --figure draws them.",
    ),
    click.option(
        "--unit",
        metavar="UNIT",
        help="With --limits-of-agreement, the unit of the ratings, such as deg.",
    ),
)


def further_tables(
    file: "RatingsFile",
    others: "RatingsFile",
    further: FurtherOptions,
    options: EstimateOptions,
    *,
    explain: bool,
) -> "list[FurtherTable]":
    """Return the tables that were chosen; of those that were not nothing is loaded."""
    # others: the same without the reference
    if not further.record():
        return []
    check_order(options, file.scale, file.is_ordered)
    tables = []
    with warnings.catch_warnings():
        # Every note is in a result, and so below its table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        if further.retest or further.each_category:
            from masrel.tables._further_tables import category_table, retest_table

            if further.retest:
                tables.append(retest_table(file, options, explain=explain))
            if further.each_category:
                tables.append(category_table(others, options, explain=explain))
        if further.diagnose:
            tables += _diagnosis(file, further, options)
        if further.symmetry or further.indices:
            from masrel.tables._two_rater_tables import index_table, symmetry_table

            tables += [symmetry_table(others)] if further.symmetry else []
            tables += [index_table(others)] if further.indices else []
        if further.limits_of_agreement:
            from masrel.tables._limits_table import limits_table

            tables.append(limits_table(others, level=options.level, unit=further.unit))
        between = further.between_raters(others, options)
        if further.compare and between is not None:
            tables += _comparisons(others, between)
    return tables


def _diagnosis(
    file: "RatingsFile",
    further: FurtherOptions,
    options: EstimateOptions,
) -> "list[FurtherTable]":
    from masrel.tables._diagnosis_tables import diagnosis_tables

    if options.takes_all or (options.coefficients is None and options.metric is None):
        options = replace(options, coefficients=["fleiss_kappa"])
    if len(options.names) > 1:
        raise ParameterError(
            "--diagnose: needs one coefficient, got --coefficients "
            f"{','.join(options.names)}"
        )
    n_raters = max(len(part.raters) for part in file.parts)
    (entry,) = entries(options, n_raters, file.scale, file.is_ordered)
    return diagnosis_tables(file, entry, options, further.reference)


def _comparisons(file: "RatingsFile", options: EstimateOptions) -> "list[FurtherTable]":
    from masrel.tables._comparison_tables import difference_table, equality_table

    n_raters = max(len(part.raters) for part in file.parts) or file.read["n_raters"]
    of_all = entries(options, n_raters, file.scale, file.is_ordered)
    tables = [difference_table(file, of_all, options)]
    if len(file.parts) > 2:  # of two the difference says it
        tables.append(equality_table(file, of_all, options))
    return tables
