"""The page of what came true of plans: ``python -m docs.make.planning``.

Writes ``docs/evidence/planning.md`` and ``docs/figures/planning_error.png``: designs
that were planned and then simulated anew with another seed, formulas beside them,
presize and kappaSize beside, and how Monte Carlo error falls with time.
"""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from masrel.planning import LatentModel, Plan, Study, precision, sample_size
from masrel.planning._studies import numbers_of, simulated
from masrel.planning._truth import design_of

DOCS = Path(__file__).parents[1]
PAGE = DOCS / "evidence" / "planning.md"
FIGURE = DOCS / "figures" / "planning_error.png"
ORACLE = DOCS.parent / "tests" / "oracles" / "planning.json"
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


def _designs(n_studies: int) -> list[str]:
    lines = [
        "| coefficient | model | raters | aim | items | planned | came true | method |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for design in DESIGNS:
        plan = sample_size(Study(**design))
        numbers, _ = came_true(design, plan, n_studies)
        name = number_of(design)
        lines.append(
            f"| {design['coefficient']} {design.get('weights', '')} "
            f"| {design['model']} | {plan.n_raters} | {_aim(design)} | {plan.n_items} "
            f"| {getattr(plan, name):.4f} | {numbers[name]:.4f} "
            f"| {plan.method} |"
        )
        print(lines[-1], flush=True)
    return lines


def _formulas(n_studies: int) -> list[str]:
    lines = [
        "| coefficient | model | raters | wanted | items by formula | came true "
        "| studies that reach it |",
        "|---|---|---|---|---|---|---|",
    ]
    for design in DESIGNS[:14]:
        plan = sample_size(Study(**{**design, "method": "wald"}))
        numbers, _ = came_true(design, plan, n_studies)
        half, reached = numbers["expected_half_width"], numbers["assurance"]
        lines.append(
            f"| {design['coefficient']} {design.get('weights', '')} "
            f"| {design['model']} | {plan.n_raters} | {design['half_width']} "
            f"| {plan.n_items} | {half:.4f} | {100 * reached:.0f} % |"
        )
    return lines


def _aim(design: dict[str, Any]) -> str:
    keys = ("half_width", "null", "lower", "upper", "power", "assurance")
    return ", ".join(f"{key} {design[key]}" for key in keys if key in design)


def _packages() -> list[str]:
    oracle = json.loads(ORACLE.read_text("utf-8"))
    lines = [
        "| κ | raters | categories | limits | masrel | kappaSize 1.2 |",
        "|---|---|---|---|---|---|",
    ]
    for setting in oracle["settings"]:
        if setting["kind"] != "gof_n":
            continue
        at = setting["design"]
        three = at["n_categories"] > 2 and at["n_raters"] > 2
        plan = sample_size(
            Study(
                "fleiss_kappa",
                value=at["kappa"],
                n_raters=at["n_raters"],
                prevalences=at["prevalences"],
                model=_DM if three else "mixture",
                target="items",
                level=at["level"],
                sides=at["sides"],
                lower=at["kappa_lower"],
                upper=at["kappa_upper"],
                method="goodness-of-fit",
            )
        )
        printed = setting.get("package", {}).get("n")
        limits = f"{at['kappa_lower']} to {at['kappa_upper'] or '…'}"
        lines.append(
            f"| {at['kappa']} | {at['n_raters']} | {at['n_categories']} | {limits} "
            f"| {plan.n_items} | {printed or '–'} |"
        )
    lines += [
        "",
        "| κ | raters | width | masrel | presize 0.3.9 |",
        "|---|---|---|---|---|",
    ]
    for case in oracle["presize"]:
        if "width" in case:
            plan = sample_size(
                Study(
                    "fleiss_kappa",
                    value=case["kappa"],
                    n_raters=case["raters"],
                    prevalences=[1 - case["prevalence"], case["prevalence"]],
                    model="mixture",
                    target="items",
                    half_width=case["width"] / 2,
                    method="goodness-of-fit",
                )
            )
            lines.append(
                f"| {case['kappa']} | {case['raters']} | {case['width']} "
                f"| {plan.n_items} | {case['presize']} |"
            )
    return lines


def _paper() -> list[str]:
    lines = [
        "| model | interval for other | half-width | low | high | coverage |",
        "|---|---|---|---|---|---|",
    ]
    models: dict[str, Any] = {"mixture": "mixture", _DM: _DM}
    models["latent, the same four items"] = _same_items(0.626)
    for name, model in models.items():
        for target in ("raters", "items"):
            plan = precision(
                Study(
                    "fleiss_kappa",
                    value=None if isinstance(model, LatentModel) else 0.626,
                    categories=None if isinstance(model, LatentModel) else 6,
                    model=model,
                    target=target,  # type: ignore[arg-type]
                    n_items=4,
                    n_raters=8,
                    rng=1,
                )
            )
            lines.append(
                f"| {name} | {target} | {plan.expected_half_width:.3f} "
                f"± {plan.monte_carlo_error:.3f} | {plan.expected_low:.3f} "
                f"| {plan.expected_high:.3f} | {plan.coverage:.2f} |"
            )
            print(lines[-1], flush=True)
    return lines


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


def _error_figure() -> None:
    from matplotlib.figure import Figure

    from masrel.plots._style import BLUE, VERMILLION, finished, house_style

    common = {**DESIGNS[5], "rng": 1}
    plan = sample_size(Study(**common))
    with house_style(parse_math=True):
        figure = Figure(figsize=(5.6, 3.4))
        axes = figure.subplots()
        for label, interval, colour, mark in (
            ("standard error", "t", BLUE, "o-"),
            ("interval of analyze", "auto", VERMILLION, "s--"),
        ):
            seconds, sizes = [], []
            for n in (100, 300, 1000, 3000) + (
                (10_000, 100_000) if interval == "t" else ()
            ):
                start = time.process_time()
                _, found = came_true({**common, "interval": interval}, plan, n)
                seconds.append(time.process_time() - start)
                sizes.append(found["expected_half_width"])
            axes.loglog(seconds, sizes, mark, color=colour, label=label)
        axes.set_xlabel("processor time (s)")
        axes.set_ylabel("Monte Carlo error of the half-width")
        axes.legend(frameon=False)
        axes.grid()
        FIGURE.write_bytes(finished(figure, stamp="", forms=("png",))["png"])


def main() -> None:
    """Write the page and its figure."""
    _error_figure()
    PAGE.write_text(
        "\n".join(
            [
                "# What came true of plans",
                "",
                "Made by `python -m docs.make.planning`. "
                "[Planning](../howto/planning.md) says "
                "what each thing is.",
                "",
                "## Twenty designs",
                "",
                "Planned, then simulated in 100 000 studies with another seed; the "
                "interval is estimate ± t times standard error.",
                "",
                *_designs(100_000),
                "",
                "## Sizes by formula",
                "",
                "The same widths by the Wald formula: what 100 000 studies of that "
                "size have on average, and how many reach what was wanted.",
                "",
                *_formulas(100_000),
                "",
                "## presize and kappaSize beside",
                "",
                "kappaSize's sizes are those of the goodness-of-fit formula. presize "
                "hands it the wrong alpha: its 95 % is 90 %.",
                "",
                *_packages(),
                "",
                "## The design of Park, Kim and Damiano: 4 models × 8 raters",
                "",
                "Six grades, κ .626 as in the paper: what the interval of an analysis "
                "could be expected to be. The ratings themselves give 0.320 to 0.933 "
                "for other raters, a half-width of 0.307.",
                "",
                *_paper(),
                "",
                "An interval for other raters is about the same items. Two of the "
                "models draw items anew in every study, so that with four of them it "
                "seldom holds the κ of all items; where all have the same four, it "
                "covers.",
                "",
                "## Time and error",
                "",
                "![Monte Carlo error over processor time]"
                "(../figures/planning_error.png)",
                "",
            ]
        ),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
