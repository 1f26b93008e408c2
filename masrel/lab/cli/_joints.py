"""Joints as options name them, and the angles of Tardieu of joints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from masrel._input import refuse
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    grouped,
    output_options,
    write_output,
)
from masrel.cli._paths import note_inputs
from masrel.errors import ParameterError
from masrel.lab.report._traced_scenes import tardieu_document, tardieu_text

if TYPE_CHECKING:
    from masrel.lab.elbow import JointModel


START_DEG, END_DEG = 30.0, 146.0
"""Where a stretch starts and ends unless it is said, deg."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointOptions:
    """The joints, however they are named, and what is changed of every one."""

    models: tuple[str, ...]
    study: Path | None
    kinds: tuple[str, ...]
    parameters: tuple[str, ...]  # KEY=VALUE each
    # None changes nothing
    rest: float | None  # θ_rest, deg
    post_catch: str | None  # reading of (5)
    reading: str | None  # reading of Q
    rise: float | None  # how long torque takes to its peak, s
    inertia: float | None  # m of (1) and (5), kg·m²

    def changed(self, joint: "JointModel") -> "JointModel":
        """Return a joint with the changes, which only a spastic elbow can have."""
        from masrel.lab.elbow import ElbowParameters

        options = {
            "rest_angle": None if self.rest is None else math.radians(self.rest),
            "post_catch": self.post_catch,
            "residual_reading": self.reading,
            "catch_rise": self.rise,
            "inertia": self.inertia,
        }
        changes: Any = {
            name: value for name, value in options.items() if value is not None
        }
        if not changes:
            return joint
        if not isinstance(joint, ElbowParameters):
            raise ParameterError(
                "--rest-deg, --post-catch, --q-reading, --catch-rise-s, "
                f"--inertia-kg-m2: need a spastic elbow, got {joint.kind}"
            )
        return replace(joint, **changes)


joint_options = grouped(
    "joints",
    JointOptions,
    click.option(
        "--model", "models", multiple=True,
        help="HM1 to HM4, a model of --study, or a model file (.toml); may be given "
        "again.",
    ),
    click.option(
        "--study", type=click.Path(path_type=Path),
        help="Take models from this study's protocol.",
    ),
    click.option(
        "--kind", "kinds", multiple=True,
        help="Another kind of joint with its defaults, as in a protocol; may be given "
        "again.",
    ),
    click.option(
        "--parameter", "parameters", multiple=True, metavar="KEY=VALUE",
        help="One of its numbers, as in [models.parameters]; may be given again.",
    ),
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


@click.command("tardieu", cls=GroupedHelp)
@joint_options
@click.option("--from-deg", "start", type=float, default=START_DEG, show_default=True)
@click.option(
    "--speed-deg-s", "speeds", type=(float, float, float), metavar="V1 V2 V3",
    help="Speeds of the stretches.  [default: 10 100 150]",
)  # fmt: skip
@output_options(json="Write them as JSON here; - for the screen.")
def tardieu(
    joints: JointOptions,
    start: float,
    speeds: tuple[float, float, float] | None,
    output: OutputOptions,
) -> None:
    """R2, R1 and their difference, by stretches to the end of range at three speeds."""
    documents = [
        tardieu_document(name, joint, start, speeds or ())
        for name, joint in joints_of(joints).items()
    ]
    write_output(
        output,
        document=lambda: (
            documents[0] if len(documents) == 1 else {"tardieu": documents}
        ),
        text=lambda: tardieu_text(documents),
    )


def end_within(joint: "JointModel", end_deg: float | None) -> float:
    """Return where a stretch ends, deg: at most where the range of the joint does."""
    limit = math.degrees(joint.range_end)
    if end_deg is None:
        return min(END_DEG, limit)
    if end_deg > limit + 1e-9:
        raise ParameterError(
            f"--to-deg: needs at most the end of range of every model, {limit:g} deg, "
            f"got {end_deg:g}"
        )
    return end_deg


def joints_of(names: JointOptions) -> dict[str, "JointModel"]:
    """Return joints by name."""
    from masrel.lab.elbow import STANDARD_MODELS

    if not names.models and not names.kinds:
        raise click.UsageError("Missing option '--model' or '--kind'.")
    if names.parameters and len(names.kinds) != 1:
        raise ParameterError("--parameter: goes with one --kind, whose it is")
    joints: dict[str, JointModel] = {}
    for model in dict.fromkeys(names.models):
        name = Path(model).stem if model.endswith(".toml") else model
        if name in joints:
            raise ParameterError(
                f"--model: needs models whose names differ, got two called {name}"
            )
        if names.study is None and model in STANDARD_MODELS:
            joints[name] = STANDARD_MODELS[model]
        else:
            joints[name] = _joint_of_file(model, names.study)
    for kind in dict.fromkeys(names.kinds):
        joints[kind] = _joint_of_kind(kind, names.parameters)
    return {name: names.changed(joint) for name, joint in joints.items()}


def _joint_of_file(model: str, study: Path | None) -> "JointModel":
    # a model file, or a model of a study's protocol
    from masrel.lab.elbow import STANDARD_MODELS
    from masrel.lab.protocol import (
        StudyPaths,
        joint_model,
        read_model_file,
        read_protocol,
    )

    is_file = model.endswith(".toml")
    refuse(
        (
            study is not None and is_file,
            f"--model: needs a model of --study, got the file {model}; without "
            "--study it is read with the usual constants",
        ),
        (
            study is None and not is_file,
            f"--model: needs one of {', '.join(STANDARD_MODELS)}, or a model file "
            f"(.toml), or --study to name a study's own, got {model!r}",
        ),
    )
    if study is not None:
        return joint_model(read_protocol(StudyPaths(study).protocol), model)
    note_inputs(Path(model))
    return read_model_file(Path(model))


def _joint_of_kind(kind: str, settings: Sequence[str]) -> "JointModel":
    # settings: KEY=VALUE each
    from masrel.lab.protocol._kinds import (
        DEFAULT_KIND,
        kind_problem,
        model_of_kind,
        value_problems,
    )

    refuse(
        ((problem := kind_problem(kind)) is not None, f"--kind: {problem}"),
        (
            kind == DEFAULT_KIND,
            f"--kind: needs another kind than {kind}, whose models --model names",
        ),
    )
    values: dict[str, float] = {}
    for setting in settings:
        key, _, text = setting.partition("=")
        if key in values:
            raise ParameterError(f"--parameter {key}: needs one value, got two")
        try:
            values[key] = float(text)
        except ValueError as error:
            raise ParameterError(
                f"--parameter: needs KEY=VALUE with a number, got {setting!r}"
            ) from error
    for key, problem in value_problems(kind, values):
        raise ParameterError(f"--parameter {key}: {problem}")
    return model_of_kind(kind, values)
