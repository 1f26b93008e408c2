"""Reference values of plans, computed without masrel."""

import json
from pathlib import Path
from statistics import NormalDist
from typing import Any

import pytest

from masrel.planning import LatentModel, Study

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
