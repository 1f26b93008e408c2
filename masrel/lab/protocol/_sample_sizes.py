"""How the size of a study was chosen, said before the data."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from msgspec import Meta

from masrel._input import listed
from masrel.lab.protocol._decode import got
from masrel.lab.protocol._keys import _Identifier, _Table

_Coefficient = Annotated[float, Meta(ge=-1, le=1)]
_Chance = Annotated[float, Meta(ge=0, le=1)]
_Width = Annotated[float, Meta(ge=0, le=100)]
_End = Annotated[float, Meta(ge=-100, le=100)]
_SUM = 1e-6  # by which prevalences may miss 1


class SampleSize(_Table, frozen=True, kw_only=True):
    """``[[analysis.sample_sizes]]``: what was taken to be true, and what it showed."""

    estimate: _Identifier
    n_items: Annotated[int, Meta(ge=2, le=10_000_000)]
    n_raters: Annotated[int, Meta(ge=1, le=1_000_000)]
    value: _Coefficient
    model: Literal["mixture", "dirichlet-multinomial", "latent", "table", "normal"]
    prevalences: tuple[_Chance, ...] = ()
    table: tuple[tuple[_Chance, ...], ...] = ()
    p_missing: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    sides: Literal[1, 2] = 2
    half_width: Annotated[float, Meta(gt=0, le=1)] | None = None
    lower: _Coefficient | None = None
    upper: _Coefficient | None = None
    null: _Coefficient | None = None
    expected_half_width: _Width | None = None
    expected_low: _End | None = None
    expected_high: _End | None = None
    assurance: _Chance | None = None
    power: _Chance | None = None
    coverage: _Chance | None = None
    method: Literal["exact", "simulation", "wald", "goodness-of-fit"] | None = None
    n_studies: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] | None = None


def sample_size_rules(values: dict[str, Any]) -> Iterator[str]:
    """Check that each is of a line of the plan, and has shares of its grades."""
    analysis = values.get("analysis") or {}
    lines = [line.get("id") for line in analysis.get("estimates") or [] if line]
    grades = (values.get("scale") or {}).get("grades")
    seen: set[str] = set()
    for index, size in enumerate(analysis.get("sample_sizes") or []):
        if size is None:
            continue
        where = f"analysis.sample_sizes[{index}]"
        if (name := size.get("estimate")) is not None:
            if None not in lines and name not in lines:
                known = listed(lines) if lines else "there is none"
                yield (
                    f"{where}.estimate: needed an estimate of the plan ({known}), got "
                    f"{got(name)}"
                )
            if name in seen:
                yield f"{where}.estimate: needed each once, got {got(name)} again"
            seen.add(name)
        yield from _shares(size, None if grades is None else len(grades), where)


def _shares(size: dict[str, Any], n_grades: int | None, where: str) -> Iterator[str]:
    shares, rows = size.get("prevalences") or [], size.get("table") or []
    if rows and size.get("model") not in ("table", None):
        yield f'{where}.table: needed model = "table", got {got(size["model"])}'
    if size.get("model") == "table" and "table" in size and not rows:
        yield f"{where}.table: needed the joint probabilities of two raters, got none"
    is_usable = None not in shares and not any(
        row is None or None in row for row in rows
    )
    if n_grades is None or not is_usable:
        return
    if shares and len(shares) != n_grades:
        yield (
            f"{where}.prevalences: needed one of each of {n_grades} grades, got "
            f"{len(shares)}"
        )
    if rows and [len(row) for row in rows] != [n_grades] * n_grades:
        yield f"{where}.table: needed {n_grades} rows of {n_grades}, one a grade"
    for key, sum_ in (("prevalences", sum(shares)), ("table", sum(map(sum, rows)))):
        if size.get(key) and abs(sum_ - 1.0) > _SUM:
            yield f"{where}.{key}: needed numbers with sum 1, got sum {sum_:g}"
