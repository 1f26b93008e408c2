"""Plans agree with reference values that were computed without masrel."""

import math
from pathlib import Path
from statistics import NormalDist
from typing import Any

import pytest

from masrel.planning import LatentModel, Study, precision, sample_size
from tests.planning.oracles import MODELS, SETTINGS, of_kappa, settings

INTERVALS = {"normal": "normal", "t(n-1)": "t"}


@pytest.mark.parametrize("setting", settings("gof_n"))
def test_items_by_goodness_of_fit(setting: Any) -> None:
    design = setting["design"]
    plan = sample_size(
        Study(
            **of_kappa(setting),
            value=design["kappa"],
            n_raters=design["n_raters"],
            lower=design["kappa_lower"],
            upper=design["kappa_upper"],
            method="goodness-of-fit",
        )
    )
    assert plan.n_items == setting["reference"]["n"]


def width(setting: Any) -> dict[str, Any]:
    design = setting["design"]
    return {
        **of_kappa(setting),
        "value": setting["reference"]["true_value"],
        "n_raters": design["n_raters"],
        "half_width": design["half_width"],
        "interval": INTERVALS[design["critical"]],
    }


@pytest.mark.parametrize("setting", settings("half_width", "half_width_cohen"))
def test_items_by_the_formula_of_a_wald_interval(setting: Any) -> None:
    plan = sample_size(Study(**width(setting), method="wald"))
    assert plan.n_items == setting["reference"]["n_formula"]


def is_exact(setting: Any) -> bool:
    return "n_expected_half_width_exact" in setting["reference"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "setting",
    [
        setting
        for setting in settings("half_width", "half_width_cohen")
        if is_exact(setting.values[0])
    ],
)
def test_the_smallest_expected_width_over_all_studies(setting: Any) -> None:
    reference = setting["reference"]
    n = reference["n_expected_half_width_exact"]
    plan = precision(Study(**width(setting), n_items=n, method="exact"))
    fewer = precision(Study(**width(setting), n_items=n - 1, method="exact"))
    assert plan.monte_carlo_error == 0.0
    assert plan.expected_half_width == pytest.approx(
        reference["expected_half_width_at_that_n"], rel=1e-8
    )
    assert plan.assurance == pytest.approx(
        reference["assurance_at_n_expected"], rel=1e-8
    )
    assert fewer.expected_half_width == pytest.approx(
        reference["expected_half_width_one_less"], rel=1e-8
    )


@pytest.mark.slow
@pytest.mark.parametrize("assurance", ["80", "90"])
@pytest.mark.parametrize(
    "setting",
    [
        setting
        for setting in settings("half_width")
        if "n_assurance_80" in setting.values[0]["reference"]
    ],
)
def test_the_size_from_which_on_an_assurance_holds(
    setting: Any, assurance: str
) -> None:
    reference = setting["reference"][f"n_assurance_{assurance}"]
    plan = sample_size(
        Study(**width(setting), assurance=int(assurance) / 100, method="exact")
    )
    assert plan.n_items == reference["stable"]
    assert plan.assurance == pytest.approx(reference["p_at_stable"], rel=1e-8)
    first = f"{reference['first']} items reach it first"
    assert any(first in note for note in plan.notes) == (
        reference["first"] < reference["stable"]
    )


@pytest.mark.parametrize("setting", settings("half_width", "half_width_cohen"))
def test_simulated_studies_of_a_wald_interval(setting: Any) -> None:
    simulated = setting["validation"]["simulation_at_n_formula"]
    n = setting["reference"]["n_formula"]
    plan = precision(
        Study(**width(setting), n_items=n, method="simulation", rng=20261122)
    )
    error = plan.errors["expected_half_width"]
    both = math.hypot(error, simulated["mcse"]["mean_half_width"])
    assert plan.expected_half_width == pytest.approx(
        simulated["mean_half_width"], abs=4.0 * both
    )
    both = math.hypot(plan.errors["coverage"], simulated["mcse"]["coverage"])
    assert plan.coverage == pytest.approx(simulated["coverage"], abs=4.0 * both)


@pytest.mark.parametrize("setting", settings("power_gof"))
def test_power_of_a_goodness_of_fit_test(setting: Any) -> None:
    design, reference = setting["design"], setting["reference"]
    plan = sample_size(
        Study(
            **of_kappa(setting),
            n_raters=2,
            value=design["kappa_alternative"],
            null=design["kappa_null"],
            power=design["power"],
            method="goodness-of-fit",
        )
    )
    assert plan.n_items == reference["n_normal"]
    exact = reference["exact_power_at_n_normal"]
    assert plan.power == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("setting", settings("power_cohen"))
def test_power_of_a_test_of_cohens_kappa(setting: Any) -> None:
    design = setting["design"]
    common = {
        "value": None,
        "n_raters": 2,
        "prevalences": design["joint_alternative"],
        "model": "table",
        "target": "items",
        "level": design["level"],
        "sides": design["sides"],
        "null": design["kappa_null"],
    }
    plan = sample_size(
        Study("cohen_kappa", **common, power=design["power"], method="wald")
    )
    assert plan.n_items == setting["reference"]["n"]


@pytest.mark.slow
@pytest.mark.parametrize("setting", settings("power_cohen"))
def test_power_of_a_wald_test_over_all_studies(setting: Any) -> None:
    design = setting["design"]
    plan = precision(
        Study(
            "cohen_kappa",
            value=None,
            n_items=setting["reference"]["n"],
            n_raters=2,
            prevalences=design["joint_alternative"],
            model="table",
            target="items",
            level=design["level"],
            sides=design["sides"],
            null=design["kappa_null"],
            interval="normal",
            method="exact",
        )
    )
    exact = setting["validation"]["exact_power_wald"]
    assert plan.power == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("setting", settings("assurance_prior"))
def test_power_over_a_prior(setting: Any) -> None:
    design = setting["design"]
    plan = precision(
        Study(
            **of_kappa(setting),
            value=0.5,
            n_items=design["n_items"],
            n_raters=2,
            null=design["kappa_null"],
            prior=tuple(design["prior_parameters"]),
            method="goodness-of-fit",
        )
    )
    assert plan.power == pytest.approx(setting["reference"]["assurance"], rel=1e-8)


ICC = {
    "icc_width": ("n_bonett", "n_exact_expected_width"),
    "icc_width_assurance": ("n_zou", "n_exact_F_interval"),
    "icc_lower_assurance": ("n_zou", "n_exact"),
    "icc_power": ("n_formula", "n_exact"),
}


@pytest.mark.parametrize("setting", settings(*ICC))
def test_items_of_an_intraclass_correlation(setting: Any) -> None:
    design, reference = setting["design"], setting["reference"]
    half_width = design.get("half_width")
    if "width" in design:
        half_width = design["width"] / 2
    common = {
        "value": design.get("icc", design.get("icc_alternative")),
        "n_raters": design["n_raters"],
        "target": "both",
        "level": design["level"],
        "sides": design.get("sides", 2),
        "half_width": half_width,
        "lower": design.get("icc_lower"),
        "null": design.get("icc_null"),
        "power": design.get("power"),
        "assurance": design.get("assurance"),
    }
    by_formula, exact = ICC[setting["kind"]]
    assert (
        sample_size(Study("icc_1", **common, method="wald")).n_items
        == reference[by_formula]
    )
    plan = sample_size(Study("icc_1", **common))
    assert plan.method == "exact"
    assert plan.n_items == reference[exact]
    numbers = {
        "expected_width_at_n_exact": 2.0 * plan.expected_half_width,
        "assurance_F_interval_at_n_exact": plan.assurance,
        "assurance_exact_at_n_exact": plan.assurance,
        "power_exact_at_n_formula": plan.power,
    }
    for name, number in numbers.items():
        if name in reference:
            assert number == pytest.approx(reference[name], rel=1e-8)


@pytest.mark.parametrize("setting", settings("icc_agreement_width"))
def test_simulated_studies_of_absolute_agreement(setting: Any) -> None:
    design, reference = setting["design"], setting["reference"]
    raters, residual = design["variance_raters"], design["variance_residual"]
    plan = precision(
        Study(
            "icc_a1",
            value=design["icc_true"],
            n_items=design["n_items"],
            n_raters=design["n_raters"],
            target="both",
            level=design["level"],
            rater_share=raters / (raters + residual),
            rng=20261122,
        )
    )
    error = math.hypot(
        2.0 * plan.errors["expected_half_width"],
        setting["validation"]["mcse_mean_width"],
    )
    width = 2.0 * plan.expected_half_width
    assert width == pytest.approx(reference["mean_width"], abs=4.0 * error)
    error = math.hypot(plan.errors["coverage"], setting["validation"]["mcse_coverage"])
    assert plan.coverage == pytest.approx(reference["coverage"], abs=4.0 * error)


@pytest.mark.parametrize("setting", settings("power_wald"))
def test_power_of_a_wald_interval_by_formula(setting: Any) -> None:
    # Phi(|difference| / se - z), with the standard error at the alternative
    design, reference = setting["design"], setting["reference"]
    names = {"fleiss": "fleiss_kappa", "ac1": "gwet_ac"}
    plan = precision(
        Study(
            names[design["coefficient"]],
            value=design["coefficient_alternative"],
            prevalences=design["prevalences"],
            model=MODELS[setting["model"]],
            n_items=design["n_items"],
            n_raters=design["n_raters"],
            target="items",
            level=design["level"],
            sides=design["sides"],
            method="wald",
        )
    )
    z = NormalDist().inv_cdf(1.0 - (1.0 - design["level"]) / design["sides"])
    error = plan.expected_half_width / z
    sd = error * math.sqrt(design["n_items"])
    assert sd == pytest.approx(reference["sd_per_item"], rel=1e-8)
    difference = design["coefficient_alternative"] - design["coefficient_null"]
    power = NormalDist().cdf(difference / error - z)
    assert power == pytest.approx(reference["power_formula"], rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("setting", settings("raters_target"))
def test_simulated_studies_of_other_raters(setting: Any) -> None:
    design, reference = setting["design"], setting["reference"]
    value, prevalences = None, None
    model: Any = "dirichlet-multinomial"
    if "item_probabilities" in design:
        # one threshold, and noise of 1: a rater names the second grade with these
        inverse = NormalDist().inv_cdf
        positions = tuple(map(inverse, design["item_probabilities"]))
        model = LatentModel(thresholds=(0.0,), noise_sd=1.0, positions=positions)
    elif design["type"] == "latent":
        model = LatentModel(
            thresholds=tuple(design["thresholds"]),
            noise_sd=design["sd_noise"],
            rater_sd=design["sd_rater_bias"],
            positions=tuple(design.get("item_positions", ())),
        )
    else:
        a, b = design["beta_a"], design["beta_b"]
        value, prevalences = 1.0 / (1.0 + a + b), [b / (a + b), a / (a + b)]
    plan = precision(
        Study(
            "fleiss_kappa",
            value=value,
            prevalences=prevalences,
            n_items=design["n_items"],
            n_raters=design["n_raters"],
            model=model,
            target="raters",
            weights=design["weights"],
            level=design["level"],
            interval="t",
            rng=20261122,
        )
    )
    truth = reference["kappa_of_the_rater_population"]
    assert plan.value == pytest.approx(truth, abs=1e-8)
    error = math.hypot(
        plan.errors["expected_half_width"],
        setting["validation"]["mcse_mean_half_width"],
    )
    assert plan.expected_half_width == pytest.approx(
        reference["mean_half_width"], abs=4.0 * error
    )
    error = math.hypot(plan.errors["coverage"], setting["validation"]["mcse_coverage"])
    assert plan.coverage == pytest.approx(reference["coverage"], abs=4.0 * error)


def test_every_kind_of_setting_is_held_against() -> None:
    text = Path(__file__).read_text("utf-8")
    assert all(f'"{setting["kind"]}"' in text for setting in SETTINGS)
