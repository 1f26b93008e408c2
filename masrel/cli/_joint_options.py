"""The joints that a command line names: options, and the joints themselves."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._options import grouped
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow import ElbowParameters, JointModel

_PATH = click.Path(path_type=Path)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointOptions:
    """The joints, however they are named."""

    models: tuple[str, ...]
    study: Path | None
    kinds: tuple[str, ...]
    parameters: tuple[str, ...]  # KEY=VALUE each

    def __post_init__(self) -> None:
        if not self.models and not self.kinds:
            raise click.UsageError("Missing option '--model' or '--kind'.")
        if self.parameters and len(self.kinds) != 1:
            raise ParameterError("--parameter: goes with one --kind, whose it is")


joint_options = grouped(
    "names",
    JointOptions,
    click.option(
        "--model", "models", multiple=True,
        help="HM1 to HM4, a model of --study, or a model file (.toml); may be given "
        "again.",
    ),
    click.option("--study", type=_PATH, help="Take models from this study's protocol."),
    click.option(
        "--kind", "kinds", multiple=True,
        help="Another kind of joint with its defaults, as in a protocol; may be given "
        "again.",
    ),
    click.option(
        "--parameter", "parameters", multiple=True, metavar="KEY=VALUE",
        help="One of its numbers, as in [models.parameters]; may be given again.",
    ),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LawOptions:
    """What the command line changes of every joint; None changes nothing."""

    rest: float | None  # θ_rest, deg
    post_catch: str | None  # reading of (5)
    reading: str | None  # reading of Q
    rise: float | None  # how long torque takes to its peak, s
    inertia: float | None  # m of (1) and (5), kg·m²

    def change(self, joint: "JointModel") -> "JointModel":
        """Return a joint with these changes, which only a spastic elbow can have."""
        from masrel.elbow import ElbowParameters

        changes: dict[str, object] = {
            "rest_angle": None if self.rest is None else math.radians(self.rest),
            "post_catch": self.post_catch,
            "residual_reading": self.reading,
            "catch_rise": self.rise,
            "inertia": self.inertia,
        }
        changes = {name: value for name, value in changes.items() if value is not None}
        if not changes:
            return joint
        if not isinstance(joint, ElbowParameters):
            raise ParameterError(
                "--rest-deg, --post-catch, --q-reading, --catch-rise-s, "
                f"--inertia-kg-m2: need a spastic elbow, got {joint.kind}"
            )
        return replace(joint, **changes)  # type: ignore[arg-type]


law_options = grouped(
    "law",
    LawOptions,
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


def joints_of(names: JointOptions, law: LawOptions) -> dict[str, "JointModel"]:
    """Return every joint that the command line names, with its changes."""
    joints: dict[str, JointModel] = {}
    for model in dict.fromkeys(names.models):
        is_file = model.endswith(".toml")
        name = Path(model).stem if is_file else model
        if name in joints:
            raise ParameterError(
                f"--model: needs models whose names differ, got two called {name}"
            )
        joints[name] = law.change(
            _joint_in_file(model, names.study)
            if is_file
            else _named_joint(model, names.study)
        )
    for kind in dict.fromkeys(names.kinds):
        joints[kind] = law.change(_joint_of_kind(kind, names.parameters))
    return joints


def _joint_of_kind(kind: str, settings: Sequence[str]) -> "JointModel":
    from masrel.protocol._kinds import (
        DEFAULT_KIND,
        kind_problem,
        model_of_kind,
        value_problems,
    )

    if (problem := kind_problem(kind)) is not None:
        raise ParameterError(f"--kind: {problem}")
    if kind == DEFAULT_KIND:
        raise ParameterError(
            f"--kind: needs another kind than {kind}, whose models --model names"
        )
    values: dict[str, float] = {}
    for setting in settings:
        key, _, text = setting.partition("=")
        try:
            values[key] = float(text)
        except ValueError as error:
            raise ParameterError(
                f"--parameter: needs KEY=VALUE with a number, got {setting!r}"
            ) from error
    for key, problem in value_problems(kind, values):
        raise ParameterError(f"--parameter {key}: {problem}")
    return model_of_kind(kind, values)


def _joint_in_file(model: str, study: Path | None) -> "ElbowParameters":
    from masrel.protocol import read_model_file

    if study is not None:
        raise ParameterError(
            f"--model: needs a model of --study, got the file {model}; without --study "
            "it is read with the usual constants"
        )
    return read_model_file(Path(model))


def _named_joint(model: str, study: Path | None) -> "JointModel":
    from masrel.elbow import STANDARD_MODELS

    if study is not None:
        from masrel.protocol import StudyPaths, joint_model, read_protocol

        return joint_model(read_protocol(StudyPaths(study).protocol), model)
    if model not in STANDARD_MODELS:
        raise ParameterError(
            f"--model: needs one of {', '.join(STANDARD_MODELS)}, or a model file "
            f"(.toml), or --study to name a study's own, got {model!r}"
        )
    return STANDARD_MODELS[model]
