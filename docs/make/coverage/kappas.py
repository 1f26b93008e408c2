"""How often intervals of coefficients hold them, by question, size and coefficient."""

import warnings
import zlib
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from itertools import product

import numpy as np

from docs.make.coverage.populations import (
    Population,
    dirichlet_multinomial,
    latent_trait,
    some_careless,
)
from docs.make.coverage.study import Answer, Cell, answer
from masrel.agreement import COEFFICIENTS, CodedRatings
from masrel.errors import MasrelError, MasrelWarning
from masrel.estimates import Estimate, Interval, Target
from masrel.intervals import analytic, bootstrap, estimate, jackknife

Method = Callable[[str, CodedRatings, str], Interval | None]
"""From a coefficient, ratings and weights to an interval."""

SEED, N_STUDIES = 20_261, 1_000

SHARES = (0.35, 0.3, 0.2, 0.15)
KAPPAS = (0.2, 0.6, 0.9)
SIZES = ((4, 8), (16, 8), (30, 3), (100, 5))
N_POOL = 100  # raters, of whom those of a study are drawn
ALIKE, TRAIT, BIASED = "Dirichlet-multinomial", "latent trait", "strong biases"
SOME_CARELESS = "one rater in five careless"

SEVERAL = (
    "fleiss_kappa", "conger_kappa", "krippendorff_alpha", "gwet_ac",
    "percent_agreement", "fleiss_kappa, quadratic",
)  # fmt: skip
TWO = ("cohen_kappa", "scott_pi", "cohen_kappa, quadratic")


def cells() -> list[Cell]:
    """Return the cells; the first coefficient of each is asked of other intervals."""
    every = []
    for study, target, family, kappa, size in _designs():
        of_first = _others(target)
        for coefficient in SEVERAL if size[1] > 2 else TWO:
            cell = cell_of(
                {"study": study, "family": family, "population": f"κ {kappa:g}"},
                size,
                coefficient,
                partial(_population, target, family, kappa, size),
                {"default": partial(ask, of=estimate, target=target)} | of_first,
            )
            every.append(cell)
            of_first = {}
    return every


def _designs() -> Iterator[tuple[str, Target, str, float, tuple[int, int]]]:
    targets: tuple[Target, ...] = ("items", "raters", "both")
    for target in targets:
        families = (ALIKE, TRAIT) if target == "items" else (BIASED,)
        for family, size, kappa in product(families, SIZES, KAPPAS):
            yield target, target, family, kappa, size
    for n, kappa in product((5, 16, 50), KAPPAS):
        yield "two raters", "items", TRAIT, kappa, (n, 2)
    for n_raters in (3, 5, 12):
        yield "careless raters", "raters", SOME_CARELESS, 0.5, (30, n_raters)


def _others(target: Target) -> dict[str, Method]:
    # what is printed is of other items, whatever is asked
    printed = partial(ask, of=analytic, target="items")
    drawn = {"n_resamples": 1_000, "exact": False, "rng": 1}
    return {
        "jackknife": partial(ask, of=jackknife, target=target),
        "bootstrap": partial(ask, of=bootstrap, target=target, **drawn),
        "normal": partial(printed, distribution="normal"),
        "irrCAC": partial(printed, convention="irrcac"),
        "SPSS": partial(printed, convention="spss", distribution="normal"),
    }


def ask(
    name: str,
    ratings: CodedRatings,
    weights: str,
    *,
    of: Callable[..., Estimate | Interval],
    **options: object,
) -> Interval | None:
    """Return the interval that a function of the package gives."""
    found = of(name, ratings, weights=weights, **options)
    return found.interval if isinstance(found, Estimate) else found


@cache
def _population(
    target: Target, family: str, kappa: float, size: tuple[int, int]
) -> Population:
    n_items, n_raters = size
    if family == ALIKE:
        return dirichlet_multinomial(SHARES, kappa, n_raters)
    if family == TRAIT:
        return latent_trait(SHARES, kappa, n_raters)
    drawn = some_careless(SHARES, n_raters)
    if family == BIASED:
        drawn = latent_trait(SHARES, kappa, N_POOL, 1.0, n_drawn=n_raters)
    return drawn.with_items_fixed(n_items) if target == "raters" else drawn


def cell_of(
    at: Mapping[str, object],
    size: tuple[int, int],
    coefficient: str,
    make: Callable[[], Population],
    methods: Mapping[str, Method],
    seed: int = SEED,
    n_studies: int = N_STUDIES,
) -> Cell:
    """Return a cell of a population, whose coefficients all see the same studies."""
    key = " ".join(map(str, (at["family"], at["population"], *size)))
    names = {"n_items": size[0], "n_raters": size[1], "coefficient": coefficient}
    return Cell(
        at={**at, **names},
        ask=partial(_asked, make, size[0], coefficient, methods),
        seed=(seed, zlib.crc32(key.encode())),
        n_studies=n_studies,
    )


def _asked(
    make: Callable[[], Population],
    n_items: int,
    coefficient: str,
    methods: Mapping[str, Method],
    rng: np.random.Generator,
    n_studies: int,
) -> Iterator[Answer]:
    population = make()
    name, _, weights = coefficient.partition(", ")
    weights = weights or "identity"
    truth = population.truth(name, weights)
    scale = tuple(range(population.chances.shape[-1]))

    @cache  # equal studies are computed once
    def answers(text: bytes) -> list[Answer]:
        codes = np.frombuffer(text, np.int8).reshape(n_items, -1)
        ratings = CodedRatings(codes=codes, categories=scale)
        is_defined = np.isfinite(COEFFICIENTS[name](ratings, weights=weights).value)
        return [
            _answer(of, truth, partial(method, name, ratings, weights))
            for of, method in methods.items()
            if is_defined
        ]

    for _ in range(n_studies):
        codes = population.draw(n_items, rng)
        # the order of items says nothing
        yield from answers(codes[np.lexsort(codes.T[::-1])].tobytes())


def _answer(name: str, truth: float, ask: Callable[[], Interval | None]) -> Answer:
    with warnings.catch_warnings(record=True, action="always") as noted:
        try:
            interval = ask()
        except MasrelError:
            interval = None
    warned = any(issubclass(of.category, MasrelWarning) for of in noted)
    is_given = interval is not None and interval.reason is None
    return answer(name, interval, truth, warned=warned or not is_given)
