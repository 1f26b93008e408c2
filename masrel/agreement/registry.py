"""Every coefficient by name, with its properties."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, get_args

import numpy as np

from masrel._input import check_option, refuse, shown
from masrel.agreement._codes import (
    CodedRatings,
    code_pairs,
    code_ratings,
    count_ratings,
    rating_values,
)
from masrel.agreement._engine import Formula, deviations
from masrel.agreement._labels import Label
from masrel.agreement._weights import Weights, WeightsLike, is_identity
from masrel.agreement.icc import (
    _ICC_ALIASES,
    _ICC_FORM_OF,
    _ICC_FORMULAS,
    _ICC_NAMES,
    _bare_form,
    _icc_target,
    icc,
    kendall_w,
    robinson_a,
)
from masrel.agreement.kappas import (
    _BRENNAN_PREDIGER,
    _CONGER,
    _FLEISS,
    _GWET,
    _PERCENT,
    _SCOTT,
    brennan_prediger,
    conger_kappa,
    fleiss_kappa,
    gwet_ac,
    percent_agreement,
    scott_pi,
)
from masrel.agreement.krippendorff import (
    _ALPHA,
    _ORDINAL_ALPHA,
    Metric,
    _metric_weights,
    krippendorff_alpha,
)
from masrel.agreement.measurement import ErrorKind, lin_ccc, mdc, sem
from masrel.agreement.pairs import (
    _COHEN,
    _LIGHT,
    _POOLED_PAIRS,
    _STRATIFIED,
    cohen_kappa,
    light_kappa,
    pooled_kappa,
    stratified_kappa,
)
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Target

Property = Literal[
    "items in any order",
    "raters in any order",
    "categories in any order",
    "unused category",
    "items twice",
    "two categories",
    "perfect agreement",
]
"""Properties of coefficients; each has a test for all coefficients that claim it.

An unused category, or every item twice, changes nothing; the order of categories does
not matter with identity weights; linear and quadratic weights of two categories are
identity weights; perfect agreement on two categories or more is 1.
"""

_EVERY: frozenset[Property] = frozenset(get_args(Property))


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficient:
    """A coefficient, how to compute it, and its properties.

    Attributes
    ----------
    name : str
        Its name; that of its public function unless that has several forms.
    title : str
        Its name for a reader.
    aliases : tuple of str
        Other names of the same number, by which it can be asked for.
    function : callable
        The public function.
    references : tuple of str
        What a report cites it for: keys of its BibTeX file.
    formula : Formula or None
        The coefficient from sums over items, for intervals; None where it has an
        interval of its own or none.
    properties : frozenset of str
        What is true of it.
    shape : {"ratings", "pairs"}
        What the function takes: item × rater, or pairs per rater.
    n_raters : tuple of int or None
        Fewest and most raters; None for any number.
    lowest, highest : float
        Ends of the parameter space.
    chance_corrected : bool
        Whether 0 is what chance gives.
    weighted : bool
        Whether it takes weights.
    interval_target : {"items", "raters", "both"} or None
        What the interval that it comes with generalises to; None without one.
    takes_interval : bool
        Whether its function takes the kind of its interval, or the name of a rule.
    in_units : bool
        Whether its value is in the units of the ratings.
    by_name_only : bool
        Whether it is left out where all coefficients are asked for.
    code : callable
        Ratings and categories to the codes its formula takes.
    metric : {"nominal", "ordinal", "interval", "ratio", "jaccard", "masi"} or None
        Krippendorff's difference function by which it is computed; None for weights.
    tells_raters_apart : bool
        Whether who rated what matters to its value; False where counts of raters per
        item and category are enough.
    rho : {"any raters", "raters alike"} or None
        Of which raters its value in the population is that of Fleiss' κ, which is ρ of
        the Dirichlet-multinomial model; None of others.
    needs_order : bool
        Whether grades without an order have no such coefficient, whatever the weights.
    """

    name: str
    title: str
    function: Callable[..., Estimate]
    references: tuple[str, ...]
    formula: Formula | None
    aliases: tuple[str, ...] = ()
    properties: frozenset[Property] = _EVERY
    shape: Literal["ratings", "pairs"] = "ratings"
    n_raters: tuple[int, int | None] = (2, None)
    lowest: float = -1.0
    highest: float = 1.0
    chance_corrected: bool = True
    weighted: bool = True
    interval_target: Target | None = None
    takes_interval: bool = False
    tells_raters_apart: bool = True
    rho: Literal["any raters", "raters alike"] | None = None
    in_units: bool = False
    by_name_only: bool = False
    code: Callable[..., CodedRatings] = code_ratings
    metric: Metric | None = None

    @property
    def has_interval(self) -> bool:
        """Whether it comes with an interval, and takes its level."""
        return self.interval_target is not None

    @property
    def raters_matter(self) -> bool:
        """Whether other raters with the same counts would have another value."""
        return self.tells_raters_apart and self.rho != "any raters"

    @property
    def needs_order(self) -> bool:
        """Whether grades without an order have none, whatever the weights."""
        return "categories in any order" not in self.properties

    def __call__(
        self,
        ratings: object,
        *,
        categories: Sequence[Label] | None = None,
        weights: "WeightsLike" = "identity",
        level: float = 0.95,
    ) -> Estimate:
        """Estimate the coefficient, as its public function does."""
        # The level is that of an interval which comes with it.
        if self.weighted:
            return self.function(ratings, categories=categories, weights=weights)
        self._refuse_weights(weights)
        more = {"level": level} if self.has_interval else {}
        return self.function(ratings, categories=categories, **more)

    def by_metric(self, metric: Metric | None) -> "Coefficient":
        """Return the coefficient by one of Krippendorff's metrics; itself for None."""
        if metric is None or metric == self.metric:
            return self
        refuse(
            (
                self.name != "krippendorff_alpha",
                f"metric: is only for krippendorff_alpha, got {metric!r} for "
                f"{self.name}; other coefficients take weights",
            )
        )
        check_option("metric", metric, get_args(Metric))
        is_ordered = metric in ("ordinal", "interval", "ratio")
        order: frozenset[Property] = frozenset({"categories in any order"})
        return replace(
            self,
            title=f"{self.title}, {metric} metric",
            function=partial(krippendorff_alpha, metric=metric),
            formula=_ORDINAL_ALPHA if metric == "ordinal" else self.formula,
            properties=self.properties - order if is_ordered else self.properties,
            weighted=False,
            metric=metric,
        )

    def disagreement(self, coded: CodedRatings, weights: "WeightsLike") -> Weights:
        """Return how much categories disagree where no weights are taken, or weigh."""
        self._refuse_weights(weights)
        if self.metric is not None:
            return _metric_weights(self.metric, count_ratings(coded))
        # what categories weigh, less what the first rating does, in some unit
        met, n = coded.codes[coded.codes >= 0], coded.n_categories
        places = np.append(met[:1], np.arange(n)).astype(np.int64)
        values = rating_values(replace(coded, codes=places[:, None]), None)
        v = deviations(values)[0][-n:, 0] if n else values[:, 0]
        return Weights(name="identity", n_categories=n, v=v)

    def _refuse_weights(self, weights: "WeightsLike") -> None:
        takes_none = f"weights: {self.title} takes no weights, got {shown(weights)}"
        refuse((not is_identity(weights), takes_none))


_RANKS = frozenset[Property](
    {"items in any order", "raters in any order", "unused category", "items twice"}
)

_ERRORS: tuple[tuple[str, str, Callable[..., Estimate], ErrorKind, Target], ...] = (
    ("sem", "SEM", sem, "agreement", "both"),
    ("sem_consistency", "SEM, consistency", sem, "consistency", "items"),
    ("mdc", "MDC95", mdc, "agreement", "both"),
    ("mdc_consistency", "MDC95, consistency", mdc, "consistency", "items"),
)

_ALL = (
    Coefficient(
        name="percent_agreement",
        title="Percent agreement",
        function=percent_agreement,
        references=(),  # everybody knows it
        formula=_PERCENT,
        tells_raters_apart=False,
        lowest=0.0,
        chance_corrected=False,
    ),
    Coefficient(
        name="cohen_kappa",
        title="Cohen's κ",
        function=cohen_kappa,
        references=("cohen1960",),
        formula=_COHEN,
        rho="raters alike",
        n_raters=(2, 2),
    ),
    Coefficient(
        name="conger_kappa",
        title="Conger's κ",
        function=conger_kappa,
        references=("conger1980",),
        formula=_CONGER,
        rho="raters alike",
    ),
    Coefficient(
        name="fleiss_kappa",
        title="Fleiss' κ",
        function=fleiss_kappa,
        references=("fleiss1971",),
        formula=_FLEISS,
        rho="any raters",
        tells_raters_apart=False,
    ),
    Coefficient(
        name="light_kappa",
        title="Light's κ",
        function=light_kappa,
        references=("light1971",),
        formula=_LIGHT,
        rho="raters alike",
    ),
    Coefficient(
        name="scott_pi",
        title="Scott's π",
        function=scott_pi,
        references=("scott1955",),
        formula=_SCOTT,
        rho="any raters",
        n_raters=(2, 2),
    ),
    Coefficient(
        name="brennan_prediger",
        title="Brennan-Prediger",
        function=brennan_prediger,
        references=("brennan1981",),
        formula=_BRENNAN_PREDIGER,
        tells_raters_apart=False,
        # Bennett, Alpert and Goldstein (1954); Maxwell (1977), of two categories, which
        # Byrt, Bishop and Carlin (1993) call PABAK; Randolph (2005), of many raters
        aliases=("bennett_s", "randolph_kappa", "maxwell_re", "pabak"),
        properties=_EVERY - {"unused category"},
    ),
    Coefficient(
        name="gwet_ac",
        title="Gwet's AC",
        function=gwet_ac,
        references=("gwet2008",),
        formula=_GWET,
        tells_raters_apart=False,
        properties=_EVERY - {"unused category"},
    ),
    Coefficient(
        name="krippendorff_alpha",
        title="Krippendorff's α",
        function=krippendorff_alpha,
        references=("hayes2007",),
        formula=_ALPHA,
        rho="any raters",
        tells_raters_apart=False,
        properties=_EVERY - {"items twice"},
    ),
    Coefficient(
        name="stratified_kappa",
        title="Stratified κ",
        function=stratified_kappa,
        references=("barlow1991",),
        code=code_pairs,
        formula=_STRATIFIED,
        shape="pairs",
        n_raters=(1, None),
    ),
    Coefficient(
        name="pooled_kappa",
        title="Pooled κ",
        function=pooled_kappa,
        references=("barlow1991",),
        code=code_pairs,
        formula=_POOLED_PAIRS,
        shape="pairs",
        n_raters=(1, None),
    ),
    Coefficient(
        name="kendall_w",
        title="Kendall's W",
        function=kendall_w,
        references=("kendall1939",),
        formula=None,
        properties=(_RANKS - {"items twice"}) | {"perfect agreement"},
        lowest=0.0,
        chance_corrected=False,
        weighted=False,
        interval_target="items",
    ),
    Coefficient(
        name="robinson_a",
        title="Robinson's A",
        function=robinson_a,
        references=("robinson1957",),
        formula=None,
        properties=_RANKS | {"perfect agreement"},
        lowest=0.0,
        chance_corrected=False,
        weighted=False,
    ),
    *(
        Coefficient(
            name=name,
            title=form,
            function=partial(icc, form=form),
            references=("mcgraw1996",),
            formula=_ICC_FORMULAS[form],
            aliases=_ICC_ALIASES[form],
            takes_interval=True,
            properties=(_RANKS - {"items twice"}) | {"perfect agreement"},
            lowest=-math.inf,
            highest=math.inf if form == "ICC(A,k)" else 1.0,
            weighted=False,
            interval_target=_icc_target(form),
        )
        for form, name in _ICC_NAMES.items()
    ),
    Coefficient(
        name="lin_ccc",
        title="Lin's concordance",
        function=lin_ccc,
        references=("lin1989",),
        formula=None,
        properties=_RANKS | {"perfect agreement"},
        weighted=False,
        interval_target="items",
        by_name_only=True,  # ICC(A,1) says nearly the same
    ),
    *(
        Coefficient(
            name=name,
            title=title,
            function=partial(function, kind=kind),
            references=("devet2006",),
            formula=None,
            properties=_RANKS - {"items twice"},
            lowest=0.0,
            highest=math.inf,
            chance_corrected=False,
            weighted=False,
            interval_target=target,
            in_units=True,
            by_name_only=True,
        )
        for name, title, function, kind, target in _ERRORS
    ),
)

COEFFICIENTS: dict[str, Coefficient] = {entry.name: entry for entry in _ALL}
"""Name to coefficient."""

_BY_NAME = {name: entry for entry in _ALL for name in (entry.name, *entry.aliases)}
_BY_ICC = {bare: COEFFICIENTS[_ICC_NAMES[of]] for bare, of in _ICC_FORM_OF.items()}


def coefficient(name: str) -> Coefficient:
    """Look a coefficient up by name.

    Parameters
    ----------
    name : str
        Its name in the register, or another that it is known by.

    Returns
    -------
    Coefficient
        The coefficient; it can be called like its function.

    Raises
    ------
    ParameterError
        If there is no such coefficient; the message lists those that exist, and the
        one that was probably meant.

    Examples
    --------
    >>> coefficient("fleiss_kappa").title
    "Fleiss' κ"
    >>> coefficient("randolph_kappa").name, coefficient("ICC(2,1)").name
    ('brennan_prediger', 'icc_a1')
    """
    is_text = isinstance(name, str)
    if is_text and (entry := _BY_NAME.get(name) or _BY_ICC.get(_bare_form(name))):
        return entry
    meant = _meant_by(name) if is_text else None
    raise ParameterError(
        f"coefficient: needs one of {', '.join(COEFFICIENTS)}, got {name!r}"
        + ("" if meant is None else f"; did you mean {meant}?")
    )


def _meant_by(name: str) -> str | None:
    """Return the one name that an unknown name is a word or a misspelling of."""
    import difflib  # loaded only for an error

    typed = name.strip().lower().replace(" ", "_").replace("-", "_").replace("'", "")
    if parts := [known for known in _BY_NAME if typed in known.split("_")]:
        return parts[0] if len(parts) == 1 else None
    near = difflib.get_close_matches(typed, _BY_NAME, n=1, cutoff=0.75)
    return near[0] if near else None
