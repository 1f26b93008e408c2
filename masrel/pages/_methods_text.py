"""Methods texts for a paper: how the estimates were computed."""

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from masrel.agreement import COEFFICIENTS
from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    Questions,
    Row,
)
from masrel.estimates import Interval, _population
from masrel.ratings import RatingsFile
from masrel.scales import PublishedScale
from masrel.tables._tables import counted, joined, number, percent

if TYPE_CHECKING:
    from masrel.intervals import LatentTrait

_FILE = Path(__file__).with_name("templates") / "references.bib"

# Words in the method of an interval to what it rests on
_METHODS = {
    "jackknife": "efron1981",
    "bootstrap": "efron1993",
    "Dirichlet-multinomial": "mosimann1962",
    "delta method": "gwet2014",
}

_SCALES = {
    "modified-ashworth": ("bohannon1987",),
    "ashworth": ("ashworth1964",),
    "tardieu": ("gracies2010",),
    "modified-tardieu": ("boyd1999",),
    "updrs-rigidity": ("goetz2008",),
}


def coefficient_references(coefficient: str, weights: str) -> tuple[str, ...]:
    """Return the keys of what a coefficient is cited for."""
    if (entry := COEFFICIENTS.get(coefficient)) is None:  # kappa of a category
        return ()
    is_alpha = coefficient == "krippendorff_alpha"
    is_of_kappa = entry.weighted and weights != "identity" and not is_alpha
    return (*entry.references, "cohen1968") if is_of_kappa else entry.references


def interval_references(interval: Interval) -> tuple[str, ...]:
    """Return the keys of what the method of an interval is cited for."""
    return tuple(key for words, key in _METHODS.items() if words in interval.method)


def scale_references(scale: PublishedScale | None) -> tuple[str, ...]:
    """Return the keys of what a scale is cited for, if it is one of the literature."""
    return () if scale is None else _SCALES[scale.id]


@cache
def _entries() -> dict[str, str]:
    # key -> entry as it stands in the file
    text = _FILE.read_text(encoding="utf-8")
    entries = (entry.strip() for entry in text.split("\n\n"))
    return {entry.partition("{")[2].partition(",")[0]: entry for entry in entries}


def bibtex(keys: Iterable[str]) -> str:
    """Return entries as BibTeX, in the order of their keys."""
    return "\n\n".join(_entries()[key] for key in sorted(set(keys)))


def cited(keys: Iterable[str]) -> str:
    """Return references in brackets with a space before them; nothing for none."""
    names = "; ".join(map(_author_year, keys))
    return f" ({names})" if names else ""


@cache
def _fields(key: str) -> dict[str, str]:
    # of an entry, without the braces that keep capitals
    fields = re.findall(r"^  (\w+) = \{(.*)\},?$", _entries()[key], re.M)
    return {name: re.sub("[{}]", "", text) for name, text in fields}


def _author_year(key: str) -> str:
    fields = _fields(key)
    surnames = [name.partition(",")[0] for name in fields["author"].split(" and ")]
    if len(surnames) > 2 or surnames[-1] == "others":
        return f"{surnames[0]} et al., {fields['year']}"
    return f"{' & '.join(surnames)}, {fields['year']}"


def reference_texts(keys: Iterable[str]) -> list[str]:
    """Return references as a paper lists them."""
    return sorted(map(_reference_text, set(keys)))


def _reference_text(key: str) -> str:
    fields = _fields(key)
    authors = "; ".join(fields["author"].split(" and ")).replace("; others", " et al.")
    where = fields.get("journal") or fields.get("booktitle") or fields["publisher"]
    number = f"({fields['number']})" if "number" in fields else ""
    parts = (where, f"{fields.get('volume', '')}{number}", fields.get("pages", ""))
    listed = ", ".join(filter(None, parts)).replace("--", "–")
    doi = f" https://doi.org/{fields['doi']}" if "doi" in fields else ""
    return f"{authors} ({fields['year']}). {fields['title']}. {listed}.{doi}"


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
    # the picture of limits is of their own answer
    drawn = {"limits": "bland_altman"}.get(questions.command)
    names = dict.fromkeys((*by_name, *(of for of in pictures if of != drawn)))
    also = (
        (text, by_name[name].shown or [] if name in by_name else [])
        for name in names
        for text in _TEXTS.get(name, ())
        if has_ends or not text.is_of_ends
    )
    texts = (
        _of_data(file, items),
        _of_coefficients(rows, used, questions.metric),
        *_of_intervals(rows, used, items, questions.metric),
        *_of_tables(also, used, "clusters" if file.read.get("clusters") else "items"),
        _SOFTWARE.format(*map(version, ("masrel", "numpy", "scipy"))),
    )
    return " ".join(filter(None, texts)), tuple(dict.fromkeys(used))


_SOFTWARE = "Numbers were computed with masrel {} (numpy {}, scipy {})."


class _Text(NamedTuple):
    """A sentence on how something was made."""

    text: str
    keys: tuple[str, ...] = ()  # what it cites
    is_of_ends: bool = False  # whether it is of intervals, which need a target


_HOLM = _Text(
    "The p-values of all pairs of groups are adjusted by Holm's method{}.",
    ("holm1979",),
)
_LIMITS = _Text(
    "Limits of agreement are the mean difference ± 1.96 standard deviations of "
    "differences; their intervals are exact if differences are normal{}.",
    ("bland1999", "carkeet2015"),
)
_REPEATS = _Text(
    "Limits of agreement are for single measurements: {} ± 1.96 standard deviations, "
    "computed from the variances between and within items. Their intervals combine "
    "those of the parts (MOVER); the interval of the slope uses HC3 errors{{}}.",
    ("zou2013", "bland1999", "mackinnon1985"),
)
_WITHOUT = _Text(
    "The effect of each rater is the change of the coefficient without the rater, "
    "with an interval by a jackknife over items{}.",
    ("efron1981",),
    is_of_ends=True,
)
_SPECIFIC = (
    _Text(
        "Agreement on a grade is specific agreement: how often another rater also "
        "gave a grade that one rater gave{}.",
        ("cicchetti1990",),
    ),
    _Text(
        "Its intervals are Clopper-Pearson intervals at the effective number of "
        "items{}.",
        ("korn1998",),
        is_of_ends=True,
    ),
)
# Answers and pictures by name to how they were made
_TEXTS: dict[str, tuple[_Text, ...]] = {
    "symmetry": (
        _Text(
            "Whether changes from one rater to the other balance was tested by "
            "{tests}{}."
        ),
    ),
    "indices": (
        _Text(
            "Prevalence and bias are described by their indices, PABAK, the largest κ "
            "that the margins allow, and agreement on each grade{}.",
            ("byrt1993", "cicchetti1990"),
        ),
    ),
    "limits_of_agreement": (_LIMITS,),
    **{
        name: (_REPEATS._replace(text=_REPEATS.text.format(middle)),)
        for name, middle in (
            ("limits_with_repeats", "the mean difference"),
            ("limits_that_follow", "a line of differences over means"),
            ("limits_of_ratios", "the mean of logarithms"),
        )
    },
    "limits_with_mean": (
        _Text(
            "Limits of agreement with the mean of all raters, SEM and MDC95 were "
            "computed from the variances between raters and of the rest; their "
            "intervals are those of a sum of mean squares{}.",
            ("christensen2020", "graybill1980"),
        ),
    ),
    "bland_altman": (_LIMITS,),
    "differences": (
        _Text(
            "Intervals and tests of differences between groups are by a jackknife "
            "over {units}, with Student's t{}.",
            ("gwet2016", "efron1981"),
        ),
        _HOLM,
    ),
    "judges": (
        _Text(
            "Whether {judges} can replace a human was tested by the alternative "
            "annotator test{}. It compares how close the grades of judge and human "
            "are to those of the other humans (score: {row[score]}), and tests "
            "whether the human is better by ε = {row[epsilon]} or more.",
            ("calderon2025",),
        ),
        _Text(
            "The interval of the advantage is by a jackknife with Student's t on the "
            "logit scale{}.",
            ("efron1981",),
            is_of_ends=True,
        ),
    ),
    "humans": (
        _Text(
            "P-values for humans are {tests}, by Tango's statistic{}, and adjusted "
            "over all humans for each judge.",
            ("tango1998", "benjamini2001"),
        ),
    ),
    "judge_reference": (
        _Text(
            "How often judge and human give the grade of the reference was compared "
            "by Tango's test and interval{}, with ε = {row[epsilon]}.",
            ("tango1998",),
        ),
    ),
    "judge_differences": (
        _Text(
            "Advantages of judges on the same items were compared by a jackknife, with "
            "Student's t and Holm's adjustment{}.",
            ("efron1981", "holm1979"),
        ),
    ),
    "preferences": (
        _Text(
            "The effect of the order on a judge was estimated from pairs shown in "
            "both orders, by Tango's interval and McNemar's exact test{}.",
            ("tango1998", "mcnemar1947"),
        ),
    ),
    "strengths": (
        _Text(
            "Strengths are from the model of Bradley and Terry{}, with the variance "
            "between items.",
            ("bradley1952",),
        ),
    ),
    "truth": (
        _Text(
            "Classes of items and errors of raters were estimated by Dawid and "
            "Skene's model{}, starting from the majority, with posteriors drawn by "
            "Gibbs sampling. The model assumes that raters err independently.",
            ("dawid1979",),
        ),
    ),
    "rates": (
        _Text(
            "The rate of {row[grade]} was estimated by prediction-powered inference{} "
            "from {row[n_labels]} labels and {row[n_judged]} grades of a judge.",
            ("angelopoulos2023",),
        ),
        _Text(
            "The judge's rate corrected for its sensitivity and specificity is also "
            "given{}.",
            ("rogan1978", "lang2014"),
        ),
    ),
    "equality": (_Text("{tests} tests whether all groups agree equally well{}."),),
    "diagnosis_raters": (_WITHOUT,),
    "pairs": (_WITHOUT,),
    "diagnosis_categories": _SPECIFIC,
    "categories": _SPECIFIC,
    "components": (
        _Text(
            "Variances of items, raters and the rest are from ICC(A,1){}.",
            ("mcgraw1996",),
        ),
    ),
}

_TESTS = {
    "McNemar, exact": "mcnemar1947",
    "Bowker": "bowker1948",
    "Stuart-Maxwell": "maxwell1970",
    "Bhapkar": "bhapkar1966",
    "Hotelling's T² as F": "vanbelle2017",
    "Fleiss' weighted χ²": "fleiss1981",
}


def _of_tables(
    texts: Iterable[tuple[_Text, Sequence[Row]]], used: list[str], units: str
) -> Iterator[str]:
    # each with the rows of its table
    made: dict[str, None] = {}
    for text, rows in texts:
        if text is _HOLM and len({row["group"] for row in rows}) < 2:
            continue
        tests = list(dict.fromkeys(row["test"] for row in rows if "test" in row))
        keys = (*text.keys, *(_TESTS[test] for test in tests if test in _TESTS))
        used += keys
        judges = dict.fromkeys(of["judge"] for of in rows if "judge" in of)
        named = {"units": units, "tests": joined(tests), "judges": joined([*judges])}
        row = next((of for of in rows if of.get("is_default")), next(iter(rows), {}))
        made[text.text.format(cited(keys), **named, row=row)] = None
    yield from made


def _of_data(file: RatingsFile, items: str) -> str:
    read, grades = file.read, file.scale.grades
    rated = counted(read["n_items"], "item", items)
    in_clusters = f" in {counted(read.get('n_clusters', 0), 'cluster')}"
    rated += in_clusters * bool(read.get("clusters"))
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
            f" {counted(n_missing, 'rating')} {are} missing; estimates use all others."
        )
    return text


def _of_coefficients(
    rows: Sequence[AgreementRow], used: list[str], metric: str | None
) -> str:
    names: dict[str, None] = {}
    for row in rows:
        keys = coefficient_references(row.estimate.coefficient, row.estimate.weights)
        used += keys
        names[_in_words(row, metric) + cited(keys)] = None
    return f"Agreement was estimated by {joined(list(names))}." if names else ""


def _in_words(row: AgreementRow, metric: str | None) -> str:
    # within a sentence, where only names of persons begin with a capital
    name, weights = row.estimate.coefficient, row.estimate.weights
    entry = COEFFICIENTS.get(name)  # none of kappa of a category
    if entry is None or (metric is not None and name == "krippendorff_alpha"):
        return row.title
    title = "percent agreement" if name == "percent_agreement" else entry.title
    is_weighted = entry.weighted and weights != "identity"
    return f"{title} with {weights} weights" if is_weighted else title


def _of_intervals(
    rows: Sequence[AgreementRow], used: list[str], items: str, metric: str | None
) -> Iterator[str]:
    # one sentence for each kind of interval, with the coefficients that have it
    titles: dict[tuple[str, str, str, str], dict[str, None]] = {}
    for row in rows:
        interval = row.estimate.interval
        if interval is not None and not math.isnan(interval.low):
            titles.setdefault(_kind(interval, items), {})[_in_words(row, metric)] = None
            used += interval_references(interval)
    for (kind, to, method, references), of in titles.items():
        which = "" if len(titles) == 1 else f" of {joined(list(of))}"
        yield f"The {kind}{which}, for {to} like these, are by {method}{references}."


def _kind(interval: Interval, items: str) -> tuple[str, str, str, str]:
    ends = "lower bounds" if interval.is_one_sided else "intervals"
    return (
        f"{percent(interval.level)} % {interval.kind} {ends}",
        _population(interval).replace("items", items),
        interval.method,
        cited(interval_references(interval)),
    )


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
    software = _SOFTWARE.format(*map(version, ("masrel", "numpy", "scipy")))
    return text + software, ("uebersax1993", "foreman2013")
