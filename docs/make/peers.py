"""The page of other programs: ``python -m docs.make.peers``, of `.ci/long`.

Writes ``docs/evidence/peers.md`` and its rows: ten files through masrel, Python's
irrCAC, krippendorff, pingouin, statsmodels and scikit-learn (the extra `peers`) and
R's psych, vcd and lme4 (`peers.R`, if R is installed), value by value. A difference
that nothing here explains ends the program; an explanation of nothing is left out.
"""

import itertools
import json
import math
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd

import masrel
from docs.make.evidence import EVIDENCE, table, write_rows
from masrel.agreement import COEFFICIENTS
from tests.benchmarks.peers import present

DOCS = Path(__file__).parents[1]
PAGE, ROWS = EVIDENCE / "peers.md", EVIDENCE / "peers.csv"
HEAD = ("file", "ratings", "numbers compared", "equal")
ORACLES = DOCS.parent / "tests" / "oracles" / "agreement.json"
R_PROGRAM = Path(__file__).with_suffix(".R")
QUANTITIES = {"value": "", "error": ", SE", "low": ", low", "high": ", high"}
COLUMNS = ("value", "standard_error", "low", "high")  # of a table
SHOWN = 12  # rows of a file that the page shows
CLOSE = 1e-9  # of what is the same but for the last digits of floats
# what programs are held to that iterate, or round
CLOSENESS = {"lme4": 5e-6, "psych": 5e-6, "pingouin, ends": 0.005001}

Values = Mapping[str, float | str]  # of the QUANTITIES, or why there is no value


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """A coefficient."""

    coefficient: str
    weights: str = "identity"
    metric: str | None = None

    @property
    def title(self) -> str:
        """What the page calls it."""
        kind = self.metric or self.weights
        title = COEFFICIENTS[self.coefficient].title
        return title if kind == "identity" else f"{title}, {kind}"


@dataclass(frozen=True, slots=True, kw_only=True)
class File:
    """A file, and what is asked of it."""

    name: str
    about: str
    rows: list[list[str]]
    categories: list[str]  # none of measurements
    values: list[float]  # of the categories
    questions: tuple[Question, ...]

    @property
    def numbers(self) -> pd.DataFrame:
        """The ratings as numbers, which other programs take."""
        of = dict(zip(self.categories, self.values, strict=True))
        cells = [
            [of[text] if text in of else float(text or "nan") for text in row]
            for row in self.rows
        ]
        items = [f"item{k}" for k in range(1, len(cells) + 1)]
        return pd.DataFrame(cells, index=items, columns=self.raters)

    @property
    def raters(self) -> list[str]:
        """Names of the columns."""
        return [f"R{k}" for k in range(1, len(self.rows[0]) + 1)]

    @property
    def csv(self) -> str:
        """The file."""
        items = (f"item{k}" for k in itertools.count(1))
        rows = [[item, *row] for item, row in zip(items, self.rows, strict=False)]
        return "".join(f"{','.join(row)}\n" for row in [["item", *self.raters], *rows])


def named(*names: str, weights: str = "identity") -> tuple[Question, ...]:
    """Return coefficients with some weights."""
    return tuple(Question(coefficient=name, weights=weights) for name in names)


def alphas(*metrics: str) -> tuple[Question, ...]:
    """Return Krippendorff's alpha by some of his metrics."""
    return tuple(Question(coefficient="krippendorff_alpha", metric=m) for m in metrics)


def from_oracles(source: str, name: str, about: str, *questions: Question) -> File:
    """Return a file of the ratings of an oracle."""
    sets = json.loads(ORACLES.read_text(encoding="utf-8"))["datasets"]
    data = next(of for of in sets if of["name"] == source)
    is_shown = len(data["ratings"]) <= SHOWN
    where = "" if is_shown else f" (`{source}` of `tests/oracles/agreement.json`)"
    return File(
        name=name,
        about=about + where,
        rows=[["" if c is None else str(c) for c in row] for row in data["ratings"]],
        categories=list(map(str, data.get("categories", ()))),
        values=list(map(float, data.get("category_values", ()))),
        questions=questions,
    )


ALIKE = ("percent_agreement", "fleiss_kappa", "gwet_ac", "brennan_prediger")
ICCS = named("icc_1", "icc_a1", "icc_c1", "icc_1k", "icc_ak", "icc_ck")
UNITS = "11-1 2232 3333 3333 2222 1234 4444 1121 2222 -555 --11 --3-"
SHROUT_FLEISS = from_oracles(
    "shrout_fleiss1979",
    "shrout_fleiss.csv",
    "The measurements of Shrout and Fleiss (1979), table 2",
    *ICCS,
    *alphas("interval"),
)


def with_gaps(file: File, *cells: tuple[int, int]) -> list[list[str]]:
    """Return the rows without some cells."""
    return [
        ["" if (i, j) in cells else text for j, text in enumerate(row)]
        for i, row in enumerate(file.rows)
    ]


def files() -> list[File]:
    """Return the ten files."""
    return [
        from_oracles(
            "hess2012_tableV",
            "table_v.csv",
            "Eight raters of four models on the Modified Ashworth Scale",
            *named(*ALIKE, "conger_kappa", "light_kappa", "krippendorff_alpha"),
            *named("fleiss_kappa", "gwet_ac", weights="quadratic"),
            *alphas("ordinal"),
        ),
        from_oracles(
            "nominal2",
            "animals.csv",
            "Two raters of 50 items, three nominal grades, made by chance",
            *named("cohen_kappa", *ALIKE, "krippendorff_alpha"),
        ),
        from_oracles(
            "ordinal2",
            "ordinal.csv",
            "Two raters of 200 items, five grades in order, made by chance",
            *named("cohen_kappa"),
            *named("cohen_kappa", "gwet_ac", weights="linear"),
            *named("cohen_kappa", "gwet_ac", weights="quadratic"),
            *alphas("ordinal", "interval"),
        ),
        from_oracles(
            "trap_two_raters_unused_middle",
            "unused.csv",
            "Two raters of ten items on grades 1 to 5; nobody gave 3",
            *named("cohen_kappa", "brennan_prediger"),
            *named("cohen_kappa", weights="linear"),
            *named("cohen_kappa", weights="quadratic"),
            *alphas("ordinal", "interval"),
        ),
        from_oracles(
            "uneven_values",
            "uneven.csv",
            "Four raters of 80 items on grades 1, 2, 5, 10 and 20, 15 % missing",
            *named(*ALIKE, "conger_kappa", "krippendorff_alpha"),
            *named("fleiss_kappa", "gwet_ac", weights="quadratic"),
            *alphas("ordinal", "interval", "ratio"),
        ),
        File(
            name="units.csv",
            about="Krippendorff's units (2011): four raters of twelve, some missing",
            rows=[["" if c == "-" else c for c in unit] for unit in UNITS.split()],
            categories=list("12345"),
            values=[1.0, 2.0, 3.0, 4.0, 5.0],
            questions=(
                *named(*ALIKE, "conger_kappa", "krippendorff_alpha"),
                *alphas("ordinal", "interval", "ratio"),
            ),
        ),
        from_oracles(
            "skew4",
            "rare.csv",
            "Four raters of 400 items, 95 % of them in one of three grades",
            *named(*ALIKE, "conger_kappa", "light_kappa", "krippendorff_alpha"),
        ),
        from_oracles(
            "deg_one_category_declared2",
            "one.csv",
            "Three raters of five items; two grades declared, one given",
            *named(*ALIKE, "krippendorff_alpha"),
        ),
        SHROUT_FLEISS,
        replace(
            SHROUT_FLEISS,
            name="shrout_fleiss_gaps.csv",
            about="The same without three measurements",
            rows=with_gaps(SHROUT_FLEISS, (0, 2), (1, 1), (5, 3)),
        ),
    ]


# ---- the programs ----


def ours(file: File, path: Path) -> dict[Question, Values]:
    """Return what masrel makes of a file."""
    has_gaps = any("" in row for row in file.rows)
    values = {}
    for question in file.questions:
        of_icc = question.coefficient.startswith("icc")
        of_both = question.coefficient in ("icc_a1", "icc_ak")
        kind = "auto" if of_icc and (has_gaps or not of_both) else "analytic"
        target = "both" if of_both else "items"
        values[question] = agreed(file, path, question, target=target, interval=kind)
    return values


def agreed(file: File, path: Path, question: Question, **options: Any) -> Values:
    """Return what `masrel.agree` has, one call a coefficient."""
    options |= {"weights": question.weights, "metric": question.metric}
    row = masrel.agree(
        path,
        coefficients=question.coefficient,
        reading=masrel.Reading(categories=file.categories or None),
        estimating=masrel.Estimating(**options),
    ).table.iloc[0]
    return dict(zip(QUANTITIES, row[[*COLUMNS]], strict=True))


def irrcac(file: File, question: Question) -> Values:
    """Return what the package irrCAC has."""
    from irrCAC.raw import CAC

    method = {
        "fleiss_kappa": "fleiss",
        "conger_kappa": "conger",
        "gwet_ac": "gwet",
        "brennan_prediger": "bp",
        "krippendorff_alpha": "krippendorff",
    }.get(question.coefficient)
    if method is None or question.metric or not file.categories:
        return {}
    options = {"weights": question.weights, "categories": file.values, "digits": 12}
    found = getattr(CAC(file.numbers, **options), method)()["est"]
    low, high = found["confidence_interval"]
    value, error = found["coefficient_value"], found["se"]
    return {"value": value, "error": error, "low": low, "high": high}


def krippendorff(file: File, question: Question) -> Values:
    """Return what the package krippendorff has."""
    import krippendorff as package

    metric = question.metric or "nominal"
    if question.coefficient != "krippendorff_alpha" or question.weights != "identity":
        return {}
    data = file.numbers.to_numpy().T
    return {"value": package.alpha(data, level_of_measurement=metric)}


def pingouin(file: File, question: Question) -> Values:
    """Return what the package pingouin has."""
    import pingouin as package

    row = dict(zip([q.coefficient for q in ICCS], range(6), strict=True))
    if question.coefficient not in row:
        return {}
    long = file.numbers.rename_axis("item").reset_index().melt("item")
    names = {"targets": "item", "raters": "variable", "ratings": "value"}
    frame = package.intraclass_corr(long, **names, nan_policy="omit")
    found = frame.iloc[row[question.coefficient]]
    low, high = found[next(name for name in frame.columns if name.startswith("CI95"))]
    return {"value": found["ICC"], "low": low, "high": high}


def statsmodels(file: File, question: Question) -> Values:
    """Return what the package statsmodels has."""
    from statsmodels.stats import inter_rater

    method = {"fleiss_kappa": "fleiss", "brennan_prediger": "randolph"}
    if question.coefficient == "cohen_kappa":
        codes = file.numbers.apply(pd.Categorical, categories=file.values)
        table = pd.crosstab(codes["R1"], codes["R2"], dropna=False)
        kind = None if question.weights == "identity" else question.weights
        found = inter_rater.cohens_kappa(table.to_numpy(), wt=kind)
        ends = {"low": found.kappa_low, "high": found.kappa_upp}
        return {"value": found.kappa, "error": found.std_kappa, **ends}
    if question.coefficient not in method or question.weights != "identity":
        return {}
    counts = inter_rater.aggregate_raters(file.numbers)[0]
    name = method[question.coefficient]
    return {"value": inter_rater.fleiss_kappa(counts, method=name)}


def sklearn(file: File, question: Question) -> Values:
    """Return what the package scikit-learn has."""
    from sklearn.metrics import cohen_kappa_score

    if question.coefficient != "cohen_kappa":
        return {}
    kind = None if question.weights == "identity" else question.weights
    one, other = (file.numbers[name].astype(int) for name in ("R1", "R2"))
    return {"value": cohen_kappa_score(one, other, weights=kind)}


PROGRAMS: dict[str, Callable[[File, Question], Values]] = {
    "irrCAC": irrcac,
    "krippendorff": krippendorff,
    "pingouin": pingouin,
    "statsmodels": statsmodels,
    "scikit-learn": sklearn,
}
OF_R = ("psych", "vcd", "lme4")


def by_python(
    file: File, versions: Mapping[str, str]
) -> Iterator[tuple[str, Question, Values]]:
    """Yield what programs in Python make of a file."""
    names = [name for name in PROGRAMS if name in versions]
    for question, name in itertools.product(file.questions, names):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            try:
                values = PROGRAMS[name](file, question)
            except Exception as error:  # noqa: BLE001 - whatever they raise is shown
                values = {"value": type(error).__name__}
        yield name, question, values


def by_r(
    file: File, folder: Path, versions: dict[str, str]
) -> Iterator[tuple[str, Question, Values]]:
    """Yield what programs in R make of a file, and note their versions."""
    path = folder / f"numbers_{file.name}"
    file.numbers.to_csv(path)
    kind = "grades" if file.categories else "measurements"
    run = subprocess.run(
        ["Rscript", R_PROGRAM, path, kind, ",".join(map(str, file.values)) or "1"],
        capture_output=True,
        text=True,
        check=True,
    )
    values: dict[tuple[str, Question], dict[str, float | str]] = {}
    for line in run.stdout.splitlines():
        program, *cells = line.rstrip("\t").split("\t")
        if program == "version":
            versions[cells[0]] = cells[1]
            continue
        coefficient, weights, quantity, text = cells
        question = Question(coefficient=coefficient, weights=weights)
        each = values.setdefault((program, question), {})
        each[quantity] = (
            "error" if text == "error" else float(text.replace("NA", "nan"))
        )
    for (program, question), each in values.items():
        if question in file.questions:
            yield program, question, each


# ---- what differs, and why ----


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Why a program has other numbers, of what, and where; everywhere unless said."""

    why: str
    program: str
    coefficients: tuple[str, ...] = ()
    quantities: tuple[str, ...] = tuple(QUANTITIES)
    files: tuple[str, ...] = ()
    weights: tuple[str, ...] = ()
    variant: str = ""  # how it is called
    convention: str | None = None  # of masrel, by which these are had again

    def explains(
        self, file: str, question: Question, quantity: str, program: str
    ) -> bool:
        """Return whether it is of this number."""
        name, _, variant = program.partition(" ")
        return (
            name == self.program
            and self.variant in ("", variant)
            and quantity in self.quantities
            and question.coefficient in (self.coefficients or (question.coefficient,))
            and question.weights in (self.weights or (question.weights,))
            and file in (self.files or (file,))
        )


ENDS = ("low", "high")
GAPS = ("uneven.csv", "units.csv")
DIFFERENCES = (
    Difference(
        program="irrCAC",
        coefficients=("fleiss_kappa", "krippendorff_alpha"),
        quantities=("value",),
        files=("one.csv",),
        why="All ratings are alike, which is 0/0: masrel's value is undefined, with "
        "the reason; irrCAC stops with Python's ZeroDivisionError.",
    ),
    Difference(
        program="irrCAC",
        quantities=ENDS,
        files=("one.csv",),
        why="An error of 0 gives an interval without width; masrel's is undefined, "
        "with the reason that no item differs from another.",
    ),
    Difference(
        program="irrCAC",
        coefficients=("krippendorff_alpha",),
        quantities=("error", *ENDS),
        convention="irrcac",
        why="irrCAC's error of α treats the correction for few ratings as fixed. With "
        "complete ratings it equals the error of Fleiss' κ.",
    ),
    Difference(
        program="irrCAC",
        quantities=("error", *ENDS),
        files=GAPS,
        convention="irrcac",
        why="irrCAC's error counts an item with one rating as disagreement, and its t "
        "counts it as an item; masrel's uses items with a pair.",
    ),
    Difference(
        program="krippendorff",
        files=("one.csv",),
        why="All ratings are alike, which is 0/0: krippendorff stops with Python's "
        "ValueError, since its data have a single value.",
    ),
    Difference(
        program="statsmodels",
        coefficients=("cohen_kappa",),
        quantities=("error", *ENDS),
        convention="over_n",
        why="statsmodels divides the variance by n and uses the normal distribution; "
        "masrel divides by n − 1 and uses t.",
    ),
    Difference(
        program="vcd",
        quantities=("error", *ENDS),
        convention="over_n",
        why="vcd divides the variance by n and uses the normal distribution.",
    ),
    Difference(
        program="psych",
        coefficients=("cohen_kappa",),
        quantities=ENDS,
        weights=("identity",),
        convention="over_n",
        why="psych divides the variance of κ by n and uses the normal distribution.",
    ),
    Difference(
        program="psych",
        coefficients=("cohen_kappa",),
        quantities=ENDS,
        weights=("linear", "quadratic"),
        why="psych's variance of weighted κ has rows and columns exchanged; for "
        "`unused.csv` it is 0.",
    ),
    Difference(
        program="statsmodels",
        coefficients=("fleiss_kappa", "brennan_prediger"),
        files=GAPS,
        why="`aggregate_raters` counts missing ratings as one more category.",
    ),
    Difference(
        program="statsmodels",
        coefficients=("brennan_prediger",),
        files=("unused.csv", "one.csv"),
        why="`aggregate_raters` uses the grades that were given; masrel uses those "
        "declared.",
    ),
    Difference(
        program="scikit-learn",
        files=("unused.csv",),
        why="scikit-learn weighs by the position among the grades given: if nobody "
        "gave 3, 2 and 4 are neighbours, unless `labels` lists all grades.",
    ),
    Difference(
        program="pingouin",
        files=("shrout_fleiss_gaps.csv",),
        why='`nan_policy="omit"` leaves out every item with a gap, here three of six; '
        "masrel uses all measurements, by REML.",
    ),
    Difference(
        program="psych",
        variant="lmer=FALSE",
        files=("shrout_fleiss_gaps.csv",),
        why="Without a mixed model psych stops at a gap.",
    ),
    Difference(
        program="psych",
        coefficients=("icc_1", "icc_1k"),
        quantities=("value",),
        files=("shrout_fleiss_gaps.csv",),
        why="psych computes the one-way ICC from the variances of the two-way model; "
        "lme4's one-way model agrees with masrel.",
    ),
    Difference(
        program="psych",
        quantities=ENDS,
        files=("shrout_fleiss_gaps.csv",),
        why="psych's intervals treat the table as complete; masrel's use the profile "
        "likelihood of what was measured.",
    ),
)


# ---- the page ----


def is_same(program: str, quantity: str, one: float | str, other: float | str) -> bool:
    """Return whether two programs have the same number, as far as theirs goes."""
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    if math.isnan(one) or math.isnan(other):
        return math.isnan(one) and math.isnan(other)
    name = program.partition(" ")[0]
    is_end = quantity in ("low", "high")
    close = CLOSENESS.get(f"{name}, ends" * is_end, CLOSENESS.get(name, CLOSE))
    return abs(one - other) <= max(close, CLOSE * abs(one))


def digits(value: float | str) -> str:
    """Return a number as the page shows it."""
    if isinstance(value, str):
        return value
    return "–" if math.isnan(value) else f"{value:.4f}".replace("-", "−")


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """A number of another program beside ours, and why it is another."""

    file: str
    question: Question
    quantity: str
    program: str
    own: float | str
    other: float | str
    why: Difference | None  # None where it is the same


def compared(
    file: File, path: Path, theirs: list[tuple[str, Question, Values]]
) -> Iterator[Comparison]:
    """Yield every number of other programs beside ours, in the order of the page."""
    mine = ours(file, path)
    for question, quantity in itertools.product(file.questions, QUANTITIES):
        for program, of, values in theirs:
            if of == question and quantity in values:
                own, other = mine[question][quantity], values[quantity]
                is_alike = is_same(program, quantity, own, other)
                yield Comparison(
                    file=file.name,
                    question=question,
                    quantity=quantity,
                    program=program,
                    own=own,
                    other=other,
                    why=None
                    if is_alike
                    else reason(file, path, question, quantity, program, other),
                )


def reason(
    file: File,
    path: Path,
    question: Question,
    quantity: str,
    program: str,
    other: float | str,
) -> Difference:
    """Return why a number is another; if nothing explains it, that is the end."""
    about = (file.name, question, quantity, program)
    why = next((of for of in DIFFERENCES if of.explains(*about)), None)
    if why is None:
        raise SystemExit(f"{about}: {other}, which nothing explains")
    if why.convention:
        old = agreed(file, path, question, convention=why.convention)[quantity]
        if not is_same(program, quantity, old, other):
            raise SystemExit(f"{about}: {other}, but {old} by {why.convention}")
    return why


def rows_of(
    comparisons: list[Comparison], whys: list[Difference]
) -> Iterator[dict[str, str]]:
    """Yield the rows of a file; explanations are numbered as they are met."""
    for (question, quantity), group in itertools.groupby(
        comparisons, key=lambda of: (of.question, of.quantity)
    ):
        row, others = list(group), []
        for of in row:
            if of.why is not None:
                whys += [of.why] * (of.why not in whys)
                number = whys.index(of.why) + 1
                others.append(f"{of.program} {digits(of.other)} ({number})")
        yield {
            "file": row[0].file,
            "number": f"{question.title}{QUANTITIES[quantity]}",
            "masrel": digits(row[0].own),
            "equal": ", ".join(of.program for of in row if of.why is None),
            "other (reason)": "; ".join(others),
        }


def opening(comparisons: list[Comparison], versions: Mapping[str, str]) -> list[str]:
    """Return what stands above the table of files."""
    whys = [of.why for of in comparisons if of.why is not None]
    n_again = sum(why.convention is not None for why in whys)
    absent = [name for name in (*PROGRAMS, *OF_R) if name not in versions]
    programs = ", ".join(f"{name} {number}" for name, number in versions.items())
    command = "`python -m docs.make.peers`".replace(" ", "\N{NO-BREAK SPACE}")
    paragraphs = (
        "*Where does another program have another number, and why?* Ten files, each "
        f"through masrel and through {programs}: value, standard error (SE) and 95 % "
        "interval, as far as they have them, by the call that a reader would write."
        + f" Not there, and in no table: {', '.join(absent)}."
        * bool(absent)
        + f" {command} in `.ci/long` writes this page, and stops at a difference "
        "without a reason.",
        f"Of {len(comparisons)} numbers of other programs, "
        f"{len(comparisons) - len(whys)} equal ours: to the last digits of floats, "
        "or as far as they are computed (psych and lme4 by steps, 5 · 10⁻⁶) or printed "
        f"(pingouin's ends, two decimals). {n_again} are reproduced by "
        "[`--convention`](../howto/old_numbers.md), which is checked. The others are "
        f"explained [below](#why). Every number is in [{ROWS.name}]({ROWS.name}).",
        'masrel\'s numbers are those of `masrel.agree(file, target="items")` with the '
        'declared categories and `Estimating(interval="analytic")`, whose t is also '
        "irrCAC's; ICC has the interval of its form. Without these options masrel "
        "chooses [another interval](../explanation/intervals.md), often a better one.",
    )
    title = "# The same files through other programs"
    return [
        title,
        "",
        *itertools.chain(*((fill(text, 118), "") for text in paragraphs)),
    ]


def closing(whys: list[Difference]) -> list[str]:
    """Return why numbers differ."""
    return [
        "## Why",
        "",
        *(
            f"{number}. {of.why}"
            + f" `--convention {of.convention}` reproduces it." * bool(of.convention)
            for number, of in enumerate(whys, 1)
        ),
    ]


def main() -> None:
    """Run all programs, and write the page."""
    lines, shown, rows = list[tuple[object, ...]](), list[str](), list[dict[str, str]]()
    whys, every = list[Difference](), list[Comparison]()
    versions, has_r = present(list(PROGRAMS)), shutil.which("Rscript") is not None
    with tempfile.TemporaryDirectory() as folder:
        for file in files():
            path = Path(folder) / file.name
            path.write_text(file.csv, encoding="utf-8")
            theirs = list(by_python(file, versions))
            theirs += by_r(file, Path(folder), versions) if has_r else []
            comparisons = list(compared(file, path, theirs))
            every += comparisons
            rows += rows_of(comparisons, whys)
            n_equal = sum(of.why is None for of in comparisons)
            lines.append((f"`{file.name}`", file.about, len(comparisons), n_equal))
            if len(file.rows) <= SHOWN:
                shown += [f"`{file.name}`", "", "```text", *file.csv.splitlines()]
                shown += ["```", ""]
    write_rows(ROWS.stem, rows)
    page = [*opening(every, versions), table(HEAD, lines, n_text=2), ""]
    page += [*closing(whys), "", "## The small files", "", *shown]
    PAGE.write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main()
