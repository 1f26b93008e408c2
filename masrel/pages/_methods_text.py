"""How estimates were made, in sentences for a paper, written from what was computed."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING

from masrel.agreement import COEFFICIENTS
from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    Questions,
)
from masrel.estimates import Interval, _population
from masrel.pages._references import (
    cited,
    coefficient_references,
    interval_references,
)
from masrel.ratings import RatingsFile
from masrel.tables._tables import counted, number, percent

if TYPE_CHECKING:
    from masrel.intervals import LatentTrait

_MOST_LISTED = 12  # grades that are named


def methods(
    file: RatingsFile,
    questions: Questions,
    answers: Sequence[Answer],
    pictures: Iterable[str],
    items: str,
) -> tuple[str, tuple[str, ...]]:
    """Return a paragraph, and the keys of what it cites."""
    rows = [row for answer in answers for row in answer.estimates]
    used: list[str] = []
    by_name = {answer.name: answer for answer in answers}
    has_ends = questions.target is not None and not file.read.get("clusters")
    names = {*by_name, *pictures}
    also = [
        name
        for name, (_, _, is_of_ends) in _TEXTS.items()
        if name.split(":")[0] in names and (has_ends or not is_of_ends)
    ]
    units = "clusters" if file.read.get("clusters") else "items"
    texts = (
        _of_data(file, items),
        _of_coefficients(rows, used),
        *_of_intervals(rows, used, items),
        *_of_tables(also, by_name, used, units),
        _SOFTWARE.format(*map(version, ("masrel", "numpy", "scipy"))),
    )
    return " ".join(filter(None, texts)), tuple(dict.fromkeys(used))


_SOFTWARE = "Numbers were computed with masrel {} (numpy {}, scipy {})."

_SPECIFIC = (
    "Agreement on a grade is specific agreement, the share of the ratings in it that "
    "meets the same of another rater{}.",
    ("cicchetti1990",),
    False,
)
_CLOPPER = (
    "Its intervals are Clopper and Pearson's at the effective number of items{}.",
    ("korn1998",),
    True,
)
_LIMITS = (
    "Limits of agreement are the mean difference ± 1.96 standard deviations of "
    "differences; their intervals are exact for normal differences{}.",
    ("bland1999", "carkeet2015"),
    False,
)
_WITHOUT = (
    "What each rater adds is how the coefficient changes without the rater; its "
    "interval is by a jackknife over items{}.",
    ("efron1981",),
    True,
)
_TEXTS: dict[str, tuple[str, tuple[str, ...], bool]] = {
    "symmetry": (
        "Whether changes from one rater to the other balance was tested: {tests}{}.",
        (),
        False,
    ),
    "indices": (
        "Prevalence and bias are told by their indices, PABAK, the largest κ that the "
        "margins allow, and agreement on each grade{}.",
        ("byrt1993", "cicchetti1990"),
        False,
    ),
    "limits_of_agreement": _LIMITS,
    "bland_altman": _LIMITS,
    "differences": (
        "Differences between groups have intervals and tests by a jackknife over "
        "{units}, with Student's t{}.",
        ("gwet2016", "efron1981"),
        False,
    ),
    "equality": ("{tests} tests whether all groups agree as well{}.", (), False),
    "diagnosis_raters": _WITHOUT,
    "pairs": _WITHOUT,
    "diagnosis_categories": _SPECIFIC,
    "diagnosis_categories:ends": _CLOPPER,
    "categories": _SPECIFIC,
    "categories:ends": _CLOPPER,
    "components": (
        "Variances of items, raters and the rest are those of ICC(A,1){}.",
        ("mcgraw1996",),
        False,
    ),
}
"""Answers and pictures by name to how they were made, what that is cited for, and
whether it is of intervals that are there with a target alone."""

_HOLM = "The p-values of all pairs of groups are adjusted by Holm's method{}."

_TESTS = {
    "McNemar, exact": "mcnemar1947",
    "Bowker": "bowker1948",
    "Stuart-Maxwell": "maxwell1970",
    "Bhapkar": "bhapkar1966",
    "Hotelling's T² as F": "vanbelle2017",
    "Fleiss' weighted χ²": "fleiss1981",
}


def _of_tables(
    names: Iterable[str], answers: Mapping[str, Answer], used: list[str], units: str
) -> Iterator[str]:
    made: dict[str, None] = {}
    for name in names:
        text, keys, _ = _TEXTS[name]
        rows = answers[name].shown or [] if name in answers else []
        tests = list(dict.fromkeys(row["test"] for row in rows if "test" in row))
        keys += tuple(_TESTS[test] for test in tests if test in _TESTS)
        used += keys
        made[text.format(cited(keys), units=units, tests=_joined(tests))] = None
        if name == "differences" and len({row["group"] for row in rows}) > 1:
            used.append("holm1979")
            made[_HOLM.format(cited(["holm1979"]))] = None
    yield from made


def _of_data(file: RatingsFile, items: str) -> str:
    read, grades = file.read, file.scale.grades
    rated = counted(read["n_items"], "item", items)
    if read.get("clusters"):
        rated += f" in {counted(read.get('n_clusters', 0), 'cluster')}"
    order = "ordered grade" if file.is_ordered else "unordered grade"
    how = f"with {counted(len(grades), order)}"
    if len(grades) <= _MOST_LISTED:
        how += f" ({', '.join(grades)})"
    elif file.is_ordered:
        how = f"with values from {grades[0]} to {grades[-1]}"
    text = f"{counted(read['n_raters'], 'rater')} rated {rated} {how}."
    if n_missing := read["n_missing"]:
        are = "is" if n_missing == 1 else "are"
        text += (
            f" {counted(n_missing, 'rating')} {are} missing; estimates use all that "
            "are there."
        )
    return text


def _of_coefficients(rows: Sequence[AgreementRow], used: list[str]) -> str:
    names: dict[str, None] = {}
    for row in rows:
        keys: tuple[str, ...] = ()
        if (name := row.estimate.coefficient) in COEFFICIENTS:
            keys = coefficient_references(name, row.estimate.weights)
        used += keys
        names[_in_words(row) + cited(keys)] = None
    return f"Agreement was estimated by {_joined(list(names))}." if names else ""


def _in_words(row: AgreementRow) -> str:
    # within a sentence, where only names of persons begin with a capital
    entry = COEFFICIENTS.get(row.estimate.coefficient)
    name = row.title
    if entry is not None and name == f"{entry.title}, {row.estimate.weights}":
        name = f"{entry.title} with {row.estimate.weights} weights"
    return name.replace("Percent", "percent")


def _of_intervals(
    rows: Sequence[AgreementRow], used: list[str], items: str
) -> Iterator[str]:
    # one sentence for each kind of interval, with the coefficients that have it
    titles: dict[tuple[str, str, str, str], dict[str, None]] = {}
    for row in rows:
        interval = row.estimate.interval
        if interval is not None and not math.isnan(interval.low):
            titles.setdefault(_kind(interval, items), {})[_in_words(row)] = None
            used += interval_references(interval)
    for (kind, to, method, references), of in titles.items():
        which = "" if len(titles) == 1 else f" of {_joined(list(of))}"
        yield f"The {kind}{which}, for {to} like these, are by {method}{references}."


def _kind(interval: Interval, items: str) -> tuple[str, str, str, str]:
    ends = "lower bounds" if interval.is_one_sided else "intervals"
    return (
        f"{percent(interval.level)} % {interval.kind} {ends}",
        _population(interval).replace("items", items),
        interval.method,
        cited(interval_references(interval)),
    )


def _joined(names: Sequence[str]) -> str:
    # a, b and c
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def latent_methods(
    file: RatingsFile, result: "LatentTrait"
) -> tuple[str, tuple[str, ...]]:
    """Return a paragraph on a latent-trait model, and the keys of what it cites."""
    text = (
        f"{_of_data(file, 'items')} An ordinal latent-trait model with a bias and a "
        f"noise of each rater{cited(['uebersax1993'])} was sampled by "
        f"{result.n_chains} chains of {result.n_steps} steps{cited(['foreman2013'])}; "
        f"the largest R-hat was {number(result.r_hat, 4)} and the smallest effective "
        f"sample size {number(result.ess, 0)}. Prior: {result.prior.words}. "
    )
    used = ("uebersax1993", "foreman2013")
    return text + _SOFTWARE.format(*map(version, ("masrel", "numpy", "scipy"))), used
