"""Plans agree with reference values that were computed without masrel."""

import json
import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from masrel.agreement import icc
from masrel.planning import LatentModel, Plan, Study, precision, sample_size

FILE = Path(__file__).parents[1] / "oracles" / "planning.json"
SETTINGS = json.loads(FILE.read_text("utf-8"))["settings"]

MODELS = {
    "mixture": "mixture",
    "kappa drawn from the prior": "mixture",
    "beta_binomial": "dirichlet-multinomial",
    "dirichlet_multinomial": "dirichlet-multinomial",
}
COEFFICIENTS = {
    "Fleiss' kappa": "fleiss_kappa",
    "Gwet AC1": "gwet_ac",
    "Brennan-Prediger": "brennan_prediger",
    "pairwise agreement": "percent_agreement",
    "fleiss": "fleiss_kappa",
    "ac1": "gwet_ac",
}
# parameters of a `Study`, by what the settings call them
PARAMETERS = {
    **{name: name for name in ("n_items", "n_raters", "level", "sides", "weights")},
    **{name: name for name in ("half_width", "assurance", "power", "prevalences")},
    **{"kappa_lower": "lower", "icc_lower": "lower", "kappa_upper": "upper"},
    **{"kappa_null": "null", "icc_null": "null", "coefficient_null": "null"},
    **{"kappa": "value", "kappa_alternative": "value", "icc_true": "value"},
    **{"coefficient_alternative": "value", "icc": "value", "icc_alternative": "value"},
}
INTERVALS = {"normal": "normal", "t(n-1)": "t"}


def settings(*kinds: str, needs: str = "") -> list[Any]:
    """Every setting of some kinds, named in the list of tests."""
    return [
        pytest.param(setting, id=setting["id"])
        for setting in SETTINGS
        if setting["kind"] in kinds and (not needs or needs in setting["reference"])
    ]


def study_of(setting: Any, **options: Any) -> Study:
    """The study that a setting is about."""
    design, reference = setting["design"], setting["reference"]
    named = {"target": "items", "rng": 20261122}
    named |= {PARAMETERS[key]: design[key] for key in design if key in PARAMETERS}
    if setting["kind"] == "raters_target":
        named |= {"target": "raters", "interval": "t", **of_raters(design)}
        return Study("fleiss_kappa", **named)  # type: ignore[arg-type]
    if setting["kind"].startswith("icc"):
        agreement = setting["kind"] == "icc_agreement_width"
        named |= {"coefficient": "icc_a1" if agreement else "icc_1", "target": "both"}
    elif table := design.get("joint_table", design.get("joint_alternative")):
        named |= {"coefficient": "cohen_kappa", "model": "table", "value": None}
        named["prevalences"] = table
    else:
        name = setting.get("coefficient", design.get("coefficient", "Fleiss' kappa"))
        named |= {"coefficient": COEFFICIENTS[name], "model": MODELS[setting["model"]]}
    if "true_value" in reference:
        named["value"] = reference["true_value"]
    if "critical" in design:
        named["interval"] = INTERVALS[design["critical"]]
    if "width" in design:
        named["half_width"] = design["width"] / 2
    return Study(**{**named, **options})


def of_raters(design: Any) -> dict[str, Any]:
    """The model of a setting whose raters are drawn anew."""
    if "item_probabilities" in design:
        # one threshold, and noise of 1: a rater names the second grade with these
        positions = tuple(map(NormalDist().inv_cdf, design["item_probabilities"]))
        return {"model": LatentModel(thresholds=(0,), noise_sd=1, positions=positions)}
    if design["type"] == "latent":
        return {
            "model": LatentModel(
                thresholds=tuple(design["thresholds"]),
                noise_sd=design["sd_noise"],
                rater_sd=design["sd_rater_bias"],
                positions=tuple(design.get("item_positions", ())),
            )
        }
    a, b = design["beta_a"], design["beta_b"]
    shares = [b / (a + b), a / (a + b)]
    return {
        "model": "dirichlet-multinomial",
        "value": 1.0 / (1.0 + a + b),
        "prevalences": shares,
    }


WIDTHS = ("half_width", "half_width_cohen")
# method, and the number of items that it gives
FORMULAS = {
    "gof_n": ("goodness-of-fit", "n"),
    "half_width": ("wald", "n_formula"),
    "half_width_cohen": ("wald", "n_formula"),
    "power_gof": ("goodness-of-fit", "n_normal"),
    "power_cohen": ("wald", "n"),
    "icc_width": ("wald", "n_bonett"),
    "icc_width_assurance": ("wald", "n_zou"),
    "icc_lower_assurance": ("wald", "n_zou"),
    "icc_power": ("wald", "n_formula"),
}


@pytest.mark.parametrize("setting", settings(*FORMULAS))
def test_items_by_formula(setting: Any) -> None:
    (method, name), reference = FORMULAS[setting["kind"]], setting["reference"]
    plan = sample_size(study_of(setting, method=method))
    assert plan.n_items == reference[name]
    if "exact_power_at_n_normal" in reference:
        exact = reference["exact_power_at_n_normal"]
        assert plan.power == pytest.approx(exact, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    "setting", settings(*WIDTHS, needs="n_expected_half_width_exact")
)
def test_the_smallest_expected_width_over_all_studies(setting: Any) -> None:
    reference = setting["reference"]
    n = reference["n_expected_half_width_exact"]
    plan, fewer = (
        precision(study_of(setting, n_items=size, method="exact"))
        for size in (n, n - 1)
    )
    assert plan.monte_carlo_error == 0.0
    numbers = (plan.expected_half_width, plan.assurance, fewer.expected_half_width)
    names = (
        *("expected_half_width_at_that_n", "assurance_at_n_expected"),
        "expected_half_width_one_less",
    )
    assert numbers == pytest.approx([reference[name] for name in names], rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("assurance", ["80", "90"])
@pytest.mark.parametrize("setting", settings("half_width", needs="n_assurance_80"))
def test_the_size_from_which_on_an_assurance_holds(
    setting: Any, assurance: str
) -> None:
    reference = setting["reference"][f"n_assurance_{assurance}"]
    study = study_of(setting, assurance=int(assurance) / 100, method="exact")
    plan = sample_size(study)
    assert plan.n_items == reference["stable"]
    assert plan.assurance == pytest.approx(reference["p_at_stable"], rel=1e-8)
    first = f"{reference['first']} items reach the aim first"
    assert any(first in note for note in plan.notes) == (
        reference["first"] < reference["stable"]
    )


@pytest.mark.slow
@pytest.mark.parametrize("setting", settings("power_cohen"))
def test_power_of_a_wald_test_over_all_studies(setting: Any) -> None:
    n = setting["reference"]["n"]
    study = study_of(setting, n_items=n, interval="normal", method="exact")
    exact = setting["validation"]["exact_power_wald"]
    assert precision(study).power == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("setting", settings("assurance_prior"))
def test_power_over_a_prior(setting: Any) -> None:
    prior = tuple(setting["design"]["prior_parameters"])
    study = study_of(setting, value=0.5, prior=prior, method="goodness-of-fit")
    exact = setting["reference"]["assurance"]
    assert precision(study).power == pytest.approx(exact, rel=1e-8)


ICC = {
    "icc_width": "n_exact_expected_width",
    "icc_width_assurance": "n_exact_F_interval",
    "icc_lower_assurance": "n_exact",
    "icc_power": "n_exact",
}


@pytest.mark.parametrize("setting", settings(*ICC))
def test_items_of_an_intraclass_correlation(setting: Any) -> None:
    reference = setting["reference"]
    plan = sample_size(study_of(setting))
    assert (plan.method, plan.n_items) == ("exact", reference[ICC[setting["kind"]]])
    numbers = {
        "expected_width_at_n_exact": 2.0 * plan.expected_half_width,
        "assurance_F_interval_at_n_exact": plan.assurance,
        "assurance_exact_at_n_exact": plan.assurance,
        "power_exact_at_n_formula": plan.power,
    }
    for name in numbers.keys() & reference.keys():
        assert numbers[name] == pytest.approx(reference[name], rel=1e-8)


def is_near(plan: Plan, half_width: float, error: float, coverage: Any) -> None:
    """Compare within four Monte Carlo errors of both sides."""
    both = math.hypot(plan.errors["expected_half_width"], error)
    assert plan.expected_half_width == pytest.approx(half_width, abs=4.0 * both)
    both = math.hypot(plan.errors["coverage"], coverage[1])
    assert plan.coverage == pytest.approx(coverage[0], abs=4.0 * both)


@pytest.mark.parametrize("setting", settings(*WIDTHS))
def test_simulated_studies_of_a_wald_interval(setting: Any) -> None:
    simulated = setting["validation"]["simulation_at_n_formula"]
    errors = simulated["mcse"]
    n = setting["reference"]["n_formula"]
    plan = precision(study_of(setting, n_items=n, method="simulation"))
    coverage = simulated["coverage"], errors["coverage"]
    is_near(plan, simulated["mean_half_width"], errors["mean_half_width"], coverage)


@pytest.mark.parametrize("setting", settings("icc_agreement_width"))
def test_simulated_studies_of_absolute_agreement(setting: Any) -> None:
    # The plan's intervals against those of 60 studies whose ratings are drawn, and
    # these by F against the reference, each within four Monte Carlo errors.
    design, reference = setting["design"], setting["reference"]
    sd = [design[f"variance_{of}"] ** 0.5 for of in ("items", "raters", "residual")]
    share = sd[1] ** 2 / (sd[1] ** 2 + sd[2] ** 2)
    plan = precision(study_of(setting, rater_share=share))
    rng, (n, k) = np.random.default_rng(1), (plan.n_items, plan.n_raters)
    ends = []
    for _ in range(60):
        ratings = sd[0] * rng.normal(size=(n, 1)) + sd[1] * rng.normal(size=k)
        ratings += sd[2] * rng.normal(size=(n, k))
        of_study = [icc(ratings, interval=of).interval for of in ("auto", "F")]  # type: ignore[arg-type]
        ends.append([(of.low, of.high) for of in of_study if of is not None])
    low, high = np.moveaxis(np.array(ends), -1, 0)  # (n_studies, 2) each
    half_width = (high - low).mean(axis=0) / 2.0
    error, by_f = (high - low).std(axis=0) / 2.0 / math.sqrt(len(low))
    covers = ((low <= plan.value) & (plan.value <= high))[:, 0].mean()
    is_near(plan, half_width[0], error, (covers, 0.028))
    assert half_width[1] == pytest.approx(reference["mean_width"] / 2, abs=4 * by_f)


def test_the_interval_of_agreement_covers_where_raters_differ_in_level() -> None:
    # McGraw and Wong's by F hold in 83 %; 10 000 studies, whose coverage of 93.4 % has
    # a standard error of 0.25 %, of which four are allowed
    study = Study("icc_a1", n_items=50, n_raters=3, value=1 / 1.7, target="both")
    plan = precision(replace(study, rater_share=0.5 / 0.7))
    assert plan.coverage == pytest.approx(0.934, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("setting", settings("raters_target"))
def test_simulated_studies_of_other_raters(setting: Any) -> None:
    reference, errors = setting["reference"], setting["validation"]
    plan = precision(study_of(setting))
    truth = reference["kappa_of_the_rater_population"]
    assert plan.value == pytest.approx(truth, abs=1e-8)
    coverage = reference["coverage"], errors["mcse_coverage"]
    error = errors["mcse_mean_half_width"]
    is_near(plan, reference["mean_half_width"], error, coverage)


@pytest.mark.parametrize("setting", settings("power_wald"))
def test_power_of_a_wald_interval_by_formula(setting: Any) -> None:
    # Phi(|difference| / se - z), with the standard error at the alternative
    reference, study = setting["reference"], study_of(setting, method="wald")
    half_width = precision(replace(study, null=None)).expected_half_width
    z = NormalDist().inv_cdf(1.0 - (1.0 - study.level) / study.sides)
    error = half_width / z
    sd = error * math.sqrt(setting["design"]["n_items"])
    assert sd == pytest.approx(reference["sd_per_item"], rel=1e-8)
    power = NormalDist().cdf((study.value - study.null) / error - z)
    assert power == pytest.approx(reference["power_formula"], rel=1e-8)


def test_every_kind_of_setting_is_held_against() -> None:
    text = Path(__file__).read_text("utf-8")
    assert all(f'"{setting["kind"]}"' in text for setting in SETTINGS)
