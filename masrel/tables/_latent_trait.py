"""The table and the JSON of a latent-trait model of ratings."""

from collections.abc import Iterable, Iterator

from masrel.estimates import as_document
from masrel.intervals import LatentTrait, Quantity
from masrel.tables._tables import Column, Table, number, percent, significant, table_of

_COLUMNS = (
    Column(key="what", heading="What", align="left"),
    Column(key="of", heading="Of", align="left"),
    Column(key="median", heading="Median", digits=3),
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
    Column(key="other_low", heading="Low, other prior", digits=3),
    Column(key="other_high", heading="High, other prior", digits=3),
)

# A p-value of the predictive check below this, or above 1 less this, is noted.
_UNLIKELY = 0.01


def latent_table(result: LatentTrait, *, read: tuple[str, ...], data: str) -> Table:
    """Return the table of every quantity of the model with its interval."""
    # intervals under the other prior stand beside those under the first
    beside = result.other or result
    rows = [
        row | {"other_low": other["low"], "other_high": other["high"]}
        for row, other in zip(_rows(result), _rows(beside), strict=True)
    ]
    return table_of(
        "latent_trait",
        "",
        _COLUMNS if result.other is not None else _COLUMNS[:-2],
        rows,
        notes=tuple(_notes(result)),
        read=read,
        data=data,
    )


def _rows(result: LatentTrait) -> Iterator[dict[str, object]]:
    quantities: list[tuple[str, Iterable[Quantity]]] = [
        ("bias", result.raters),
        ("noise", result.noises),
        ("share of variance", result.shares),
        ("threshold", result.thresholds),
        ("severity", result.items),
    ]
    cells = [("kappa", "two new raters", result.kappa.value, result.kappa.interval)]
    cells += [
        (what, of.name, of.value, of.interval) for what, of_ in quantities for of in of_
    ]
    for what, name, median, interval in cells:
        if interval is not None:
            ends = {"low": interval.low, "high": interval.high}
            yield {"what": what, "of": name, "median": median, **ends}


def _notes(result: LatentTrait) -> Iterator[str]:
    # what the numbers are about, and their unit
    if (interval := result.kappa.interval) is not None:
        whom = "these items" if interval.target == "raters" else "new items like these"
        yield (
            f"Kappa: agreement of two new raters on {whom}. Low and High: central "
            f"{percent(interval.level)} % credible interval."
        )
    yield (
        "Unit: the standard deviation of a rating; 0 is the mean severity of these "
        "items, and for biases the mean of all raters. A rater with a positive bias "
        "grades high; noise is how much a rater's perception of the same item varies."
    )
    if len(thresholds := [quantity.value for quantity in result.thresholds]) > 1:
        distance = (thresholds[-1] - thresholds[0]) / (len(thresholds) - 1)
        yield (
            f"Neighbouring thresholds are {number(distance, 2)} apart on average; a "
            "bias of that size is about one grade."
        )
    yield f"Prior: {result.prior.words}."
    if result.other is not None:
        yield f"Other prior: {result.other.prior.words}."
    unlikely = [
        f"{check.name} {significant(check.observed, 3)}, expected "
        f"{significant(check.low, 3)} to {significant(check.high, 3)}"
        for check in result.checks
        if not _UNLIKELY <= check.p_value <= 1.0 - _UNLIKELY
    ]
    makes = "does not make" if unlikely else "makes"
    which = f": {'; '.join(unlikely)}" if unlikely else ""
    yield f"The model {makes} ratings like these (predictive check){which}."
    yield (
        f"{result.n_chains} chains of {result.n_steps} steps; R-hat at most "
        f"{number(result.r_hat, 4)}, effective size at least {number(result.ess, 0)}; "
        f"seed {result.seed}."
    )


def latent_document(result: LatentTrait) -> dict[str, object]:
    """Return a result as plain values for JSON, every digit kept."""
    parts = {
        "items": result.items,
        "thresholds": result.thresholds,
        "raters": result.raters,
        "noises": result.noises,
        "shares": result.shares,
        "noise_spread": (result.noise_spread,),
    }
    return {
        "kappa": as_document(result.kappa),
        **{name: list(map(_quantity, part)) for name, part in parts.items()},
        "grades": [list(row) for row in result.grades],
        "checks": [
            {
                name: getattr(check, name)
                for name in ("name", "observed", "low", "high", "p_value")
            }
            for check in result.checks
        ],
        "prior": result.prior.words,
        "r_hat": result.r_hat,
        "ess": result.ess,
        "n_chains": result.n_chains,
        "n_steps": result.n_steps,
        "seed": result.seed,
        "other": None if result.other is None else latent_document(result.other),
    }


def _quantity(quantity: Quantity) -> dict[str, object]:
    return {
        "name": quantity.name,
        "value": quantity.value,
        "interval": as_document(quantity.interval),
        "r_hat": quantity.r_hat,
        "ess": quantity.ess,
    }
