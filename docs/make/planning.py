"""The rows of what came true of plans: ``python -m docs.make.planning``.

Writes ``docs/evidence/planning_*.csv``: designs that were planned and then simulated
again with another seed, formulas, presize and kappaSize beside them.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from docs.make.evidence import write_rows
from masrel.planning import LatentModel, Plan, Study, precision, sample_size
from masrel.planning._studies import numbers_of, simulated
from masrel.planning._truth import design_of

ORACLE = Path(__file__).parents[2] / "tests" / "oracles" / "planning.json"
TWO, THREE, FOUR = [0.7, 0.3], [0.5, 0.3, 0.2], [0.4, 0.3, 0.2, 0.1]


def _design(
    name: str,
    raters: int,
    prevalences: list[float],
    value: float,
    model: str,
    **aim: Any,
) -> dict[str, Any]:
    return {
        "coefficient": name,
        "n_raters": raters,
        "prevalences": prevalences,
        "value": value,
        "model": model,
        "target": "items",
        "interval": "t",
        "rng": 1,
        **aim,
    }


_DM = "dirichlet-multinomial"
DESIGNS: tuple[dict[str, Any], ...] = (
    _design("fleiss_kappa", 2, TWO, 0.5, "mixture", half_width=0.15),
    _design("fleiss_kappa", 3, TWO, 0.5, "mixture", half_width=0.15),
    _design("fleiss_kappa", 3, TWO, 0.5, _DM, half_width=0.15),
    _design("fleiss_kappa", 5, TWO, 0.7, _DM, half_width=0.1),
    _design("fleiss_kappa", 4, THREE, 0.6, "mixture", half_width=0.12),
    _design("fleiss_kappa", 4, THREE, 0.6, _DM, half_width=0.12),
    _design("fleiss_kappa", 4, THREE, 0.6, "latent", half_width=0.12),
    _design("fleiss_kappa", 5, FOUR, 0.5, _DM, half_width=0.1, weights="quadratic"),
    _design("fleiss_kappa", 3, THREE, 0.5, _DM, half_width=0.15, p_missing=0.15),
    _design("gwet_ac", 2, [0.9, 0.1], 0.9, "mixture", half_width=0.1),
    _design("cohen_kappa", 2, TWO, 0.6, "mixture", half_width=0.2),
    _design("krippendorff_alpha", 3, THREE, 0.5, _DM, half_width=0.15),
    _design("percent_agreement", 3, TWO, 0.85, "mixture", half_width=0.08),
    _design("conger_kappa", 3, THREE, 0.6, _DM, half_width=0.15),
    _design("fleiss_kappa", 2, TWO, 0.5, "mixture", half_width=0.18, assurance=0.8),
    _design("fleiss_kappa", 4, THREE, 0.6, _DM, half_width=0.12, assurance=0.8),
    _design("scott_pi", 2, TWO, 0.7, "mixture", null=0.4, power=0.8),
    _design("fleiss_kappa", 4, FOUR, 0.6, _DM, null=0.45, power=0.9),
    _design("fleiss_kappa", 3, THREE, 0.7, _DM, lower=0.5, power=0.8, sides=1),
    _design("fleiss_kappa", 3, THREE, 0.6, _DM, lower=0.4, upper=0.8, power=0.8),
)


def came_true(
    design: dict[str, Any], plan: Plan, n_studies: int
) -> tuple[dict[str, float], dict[str, float]]:
    """Return numbers of studies that are drawn anew for a plan, and their errors."""
    shown = {key: value for key, value in design.items() if key != "assurance"}
    size = {"n_items": plan.n_items, "n_raters": plan.n_raters}
    study = design_of(Study(**{**shown, **size}))
    return numbers_of(simulated(study, np.random.default_rng(20261122), n_studies))


def number_of(design: dict[str, Any]) -> str:
    """Return the name of the number that a design aims at."""
    named = [name for name in ("power", "assurance") if name in design]
    return named[0] if named else "expected_half_width"


def _of(design: dict[str, Any]) -> dict[str, object]:
    keys = ("coefficient", "weights", "model", "n_raters")
    return {key: design.get(key, "identity") for key in keys}


def _designs(n_studies: int) -> Iterator[dict[str, object]]:
    for design in DESIGNS:
        plan, name = sample_size(Study(**design)), number_of(design)
        numbers, _ = came_true(design, plan, n_studies)
        yield _of(design) | {
            "aim": _aim(design),
            "n_items": plan.n_items,
            "planned": getattr(plan, name),
            "came_true": numbers[name],
            "method": plan.method,
        }


def _formulas(n_studies: int) -> Iterator[dict[str, object]]:
    for design in DESIGNS[:14]:
        plan = sample_size(Study(**{**design, "method": "wald"}))
        numbers, _ = came_true(design, plan, n_studies)
        yield _of(design) | {
            "half_width": design["half_width"],
            "n_items": plan.n_items,
            "came_true": numbers["expected_half_width"],
            "reached": numbers["assurance"],
        }


def _aim(design: dict[str, Any]) -> str:
    keys = ("half_width", "null", "lower", "upper", "power", "assurance")
    return ", ".join(f"{key} {design[key]}" for key in keys if key in design)


def _by_formula(kappa: float, **design: Any) -> int | None:
    study = Study(
        "fleiss_kappa",
        value=kappa,
        target="items",
        method="goodness-of-fit",
        **design,
    )
    return sample_size(study).n_items


def _packages() -> Iterator[dict[str, object]]:
    oracle = json.loads(ORACLE.read_text("utf-8"))
    for setting in oracle["settings"]:
        if setting["kind"] != "gof_n":
            continue
        at = setting["design"]
        low, high = at["kappa_lower"], at["kappa_upper"]
        n = _by_formula(
            at["kappa"],
            n_raters=at["n_raters"],
            prevalences=at["prevalences"],
            model=_DM if at["n_categories"] > 2 and at["n_raters"] > 2 else "mixture",
            level=at["level"],
            sides=at["sides"],
            lower=low,
            upper=high,
        )
        yield {
            "package": "kappaSize 1.2",
            "kappa": at["kappa"],
            "n_raters": at["n_raters"],
            "n_categories": at["n_categories"],
            "aim": f"{low} to {high or '…'}",
            "masrel": n,
            "theirs": setting.get("package", {}).get("n", ""),
        }
    for case in oracle["presize"]:
        if "width" not in case:
            continue
        n = _by_formula(
            case["kappa"],
            n_raters=case["raters"],
            prevalences=[1 - case["prevalence"], case["prevalence"]],
            model="mixture",
            half_width=case["width"] / 2,
        )
        yield {
            "package": "presize 0.3.9",
            "kappa": case["kappa"],
            "n_raters": case["raters"],
            "n_categories": 2,
            "aim": f"width {case['width']}",
            "masrel": n,
            "theirs": case["presize"],
        }


def _paper() -> Iterator[dict[str, object]]:
    models: dict[str, Any] = {"mixture": "mixture", _DM: _DM}
    models["latent, the same four items"] = _same_items(0.626)
    for name, model in models.items():
        is_latent = isinstance(model, LatentModel)
        for target in ("raters", "items"):
            study = Study(
                "fleiss_kappa",
                value=None if is_latent else 0.626,
                categories=None if is_latent else 6,
                model=model,
                target=target,  # type: ignore[arg-type]
                n_items=4,
                n_raters=8,
                rng=1,
            )
            plan = precision(study)
            yield {
                "model": name,
                "target": target,
                "half_width": plan.expected_half_width,
                "monte_carlo_error": plan.monte_carlo_error,
                "low": plan.expected_low,
                "high": plan.expected_high,
                "coverage": plan.coverage,
            }


def _same_items(value: float) -> LatentModel:
    # items in the middle of four of six grades, noise so that kappa is the value
    from scipy.optimize import brentq

    def model(noise_sd: float) -> LatentModel:
        return LatentModel(
            thresholds=(-1.5, -0.75, 0.0, 0.75, 1.5),
            noise_sd=noise_sd,
            rater_sd=0.5 * noise_sd,
            positions=(-1.125, -0.375, 0.375, 1.125),
        )

    def short_of(noise_sd: float) -> float:
        return of_latent(model(noise_sd)) - value

    return model(float(brentq(short_of, 0.05, 1.0)))


def of_latent(model: LatentModel) -> float:
    """Return Fleiss' kappa of a latent model."""
    shown = precision(
        Study(
            "fleiss_kappa",
            value=None,
            model=model,
            target="raters",
            n_items=4,
            n_raters=8,
            interval="t",
            method="wald",
        )
    )
    return shown.value


def main() -> None:
    """Write the rows."""
    write_rows("planning_designs", list(_designs(100_000)))
    write_rows("planning_formulas", list(_formulas(100_000)))
    write_rows("planning_packages", list(_packages()))
    write_rows("planning_hess2012", list(_paper()))


if __name__ == "__main__":
    main()
