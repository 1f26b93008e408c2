"""Numbers of fits as they were found once, by another implementation; all simulated.

``python -m tests.lab.elbow.identification.oracles`` writes those of the code as it is.
The file came from Gauss and Newton's method with step halving, each trial's parameters
eliminated by hand, and CR2 trial by trial; what reads it now is scipy's least squares.
"""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from masrel.lab.elbow import STANDARD_MODELS, fit
from masrel.lab.elbow.identification import ElbowFit, FittedParameter
from tests.lab.elbow.identification.synthesis import Arm, Scatter, study

FILE = Path(__file__).parents[3] / "oracles" / "identification.json"

HM2, HM3, HM4 = (STANDARD_MODELS[name] for name in ("HM2", "HM3", "HM4"))
SCATTER = Scatter(
    catch_angle=math.radians(2.0), catch_torque=0.1, catch_travel=math.radians(2.0)
)
ARM = Arm(gravity=0.5, inertia=0.05, drift=0.3, lag=0.008, rise=0.05)
ADDITIVE = replace(HM3, post_catch="additive")

# What is studied, and how it is fitted.
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "scattered": ({"joint": HM3, "seed": 11, "scatter": SCATTER}, {}),
    "exact": ({"joint": HM3, "seed": 5000}, {"level": 0.9}),
    "within the peak": ({"joint": HM4, "seed": 1001, "fast": (40.0, 90.0)}, {}),
    "outlasting": (
        {"joint": HM2, "seed": 3, "scatter": SCATTER, "fast": (70.0, 130.0)},
        {},
    ),
    "inertia": (
        {"joint": replace(HM3, inertia=0.07), "seed": 3, "noise": 0.05},
        {"inertia": "fitted"},
    ),
    "additive": (
        {"joint": ADDITIVE, "seed": 3, "noise": 0.05},
        {"constants": ADDITIVE},
    ),
    "slow": ({"joint": HM3, "seed": 11, "n_fast": 0}, {}),
    "wrong law": ({"joint": HM3, "seed": 5000, "arm": Arm(gravity=0.5)}, {}),
    "weight": (
        {"joint": HM3, "seed": 5000, "arm": Arm(gravity=0.5)},
        {"gravity": "fitted"},
    ),
    "drift": (
        {"joint": HM3, "seed": 5000, "arm": Arm(drift=0.3)},
        {"drift": "fitted"},
    ),
    "lag": (
        {"joint": HM3, "seed": 5000, "arm": Arm(lag=0.008)},
        {"lag": "fitted"},
    ),
    "all of an arm": (
        {"joint": HM3, "seed": 5001, "arm": ARM},
        dict.fromkeys(("gravity", "arm_inertia", "drift", "lag", "rise"), "fitted"),
    ),
}
NUMBERS = ("value", "standard_error", "df", "low", "high")


def fitted(case: str) -> ElbowFit:
    """Fit one case anew."""
    recorded, options = CASES[case]
    return fit(study(**recorded), **options)


def numbers(found: ElbowFit) -> dict[str, Any]:
    """Return what is compared of a fit."""
    alone = [e for step in found.steps for e in step.estimates]
    return {
        "estimates": {e.name: _numbers(e) for e in found.estimates},
        "steps": {e.name: _numbers(e) for e in alone},
        "torque_sd": found.torque_sd,
        "relative_error": found.relative_error,
        "cross_validation": found.cross_validation.tolist(),
        "verdict": found.lack_of_fit.verdict,
        "p_values": {t.name: t.p_value for t in found.lack_of_fit.tests},
        "remarks": list(found.remarks),
    }


def _numbers(estimate: FittedParameter) -> list[float | None]:
    values = [getattr(estimate, name) for name in NUMBERS]
    return [value if math.isfinite(value) else None for value in values]


if __name__ == "__main__":
    made = {case: numbers(fitted(case)) for case in CASES}
    lines = ",\n".join(f" {json.dumps(k)}: {json.dumps(v)}" for k, v in made.items())
    FILE.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
