"""Reference values of plans, computed without masrel."""

import json
from pathlib import Path
from typing import Any

import pytest

FILE = Path(__file__).parents[1] / "oracles" / "planning.json"
SETTINGS = json.loads(FILE.read_text("utf-8"))["settings"]

MODELS = {
    "mixture": "mixture",
    "kappa drawn from the prior": "mixture",
    "beta_binomial": "dirichlet-multinomial",
    "dirichlet_multinomial": "dirichlet-multinomial",
    "items are independent draws from joint_table (made from kappa and margins)": (
        "table"
    ),
}
COEFFICIENTS = {
    "Fleiss' kappa": "fleiss_kappa",
    "Gwet AC1": "gwet_ac",
    "Brennan-Prediger": "brennan_prediger",
    "pairwise agreement": "percent_agreement",
}


def settings(*kinds: str) -> list[Any]:
    """Every setting of some kinds, named in the list of tests."""
    chosen = [setting for setting in SETTINGS if setting["kind"] in kinds]
    assert chosen
    return [pytest.param(setting, id=setting["id"]) for setting in chosen]


def of_kappa(setting: Any) -> dict[str, Any]:
    """The arguments that every plan of a kappa has."""
    design, table = setting["design"], setting["design"].get("joint_table")
    common = {"target": "items", "level": design["level"], "sides": design["sides"]}
    if table is None:
        return {
            **common,
            "coefficient": COEFFICIENTS.get(
                setting.get("coefficient", "Fleiss' kappa")
            ),
            "model": MODELS[setting["model"]],
            "prevalences": design["prevalences"],
        }
    return {
        **common,
        "coefficient": "cohen_kappa",
        "model": "table",
        "prevalences": table,
        "weights": design["weights"],
    }
