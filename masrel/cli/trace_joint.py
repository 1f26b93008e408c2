"""Which joints ``masrel trace`` is asked for, and by which law."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.options import grouped
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow import ElbowParameters

__all__ = ["Law", "joints_of", "law_options"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """What the command line changes of every joint; None changes nothing."""

    rest: float | None  # θ_rest, deg
    post_catch: str | None  # reading of (5)
    reading: str | None  # reading of Q
    rise: float | None  # how long torque takes to its peak, s
    inertia: float | None  # m of (1) and (5), kg·m²

    def of(self, joint: "ElbowParameters") -> "ElbowParameters":
        """Return a joint with these changes."""
        changes: dict[str, object] = {
            "rest_angle": None if self.rest is None else math.radians(self.rest),
            "post_catch": self.post_catch,
            "residual_reading": self.reading,
            "catch_rise": self.rise,
            "inertia": self.inertia,
        }
        asked = {name: value for name, value in changes.items() if value is not None}
        return replace(joint, **asked)  # type: ignore[arg-type]


law_options = grouped(
    "law",
    Law,
    click.option("--rest-deg", "rest", type=float, help="θ_rest; default: the start."),
    click.option(
        "--post-catch", type=click.Choice(["continuous", "additive"]),
        help="How (5) is read.",
    ),
    click.option(
        "--q-reading", "reading", type=click.Choice(["residual", "decrease"]),
        help="What Q is a share of the peak for.",
    ),
    click.option(
        "--catch-rise-s", "rise", type=float, help="Smooth the catch's onset."
    ),
    click.option("--inertia-kg-m2", "inertia", type=float, help="m of (1) and (5)."),
)  # fmt: skip
"""The options of a law, given to a command as one argument `law`."""


def joints_of(
    models: Sequence[str], study: Path | None, law: Law
) -> dict[str, "ElbowParameters"]:
    """Find models by name."""
    joints: dict[str, ElbowParameters] = {}
    for model in dict.fromkeys(models):
        is_file = model.endswith(".toml")
        name = Path(model).stem if is_file else model
        if name in joints:
            raise ParameterError(
                f"--model: needs models whose names differ, got two called {name}"
            )
        joints[name] = law.of(_file(model, study) if is_file else _named(model, study))
    return joints


def _file(model: str, study: Path | None) -> "ElbowParameters":
    from masrel.protocol import read_model_file

    if study is not None:
        raise ParameterError(
            f"--model: needs a model of --study, got the file {model}; without --study "
            "it is read with the usual constants"
        )
    return read_model_file(Path(model))


def _named(model: str, study: Path | None) -> "ElbowParameters":
    from masrel.elbow import STANDARD_MODELS

    if study is not None:
        from masrel.protocol import StudyPaths, elbow_parameters, read_protocol

        return elbow_parameters(read_protocol(StudyPaths(study).protocol), model)
    if model not in STANDARD_MODELS:
        raise ParameterError(
            f"--model: needs one of {', '.join(STANDARD_MODELS)}, or a model file "
            f"(.toml), or --study to name a study's own, got {model!r}"
        )
    return STANDARD_MODELS[model]
