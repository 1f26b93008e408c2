"""``masrel joint``: joints as options name them, and what needs no file of its own.

The angles of Tardieu of joints, and models between models.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

import masrel
from masrel._files import write_file
from masrel._input import refuse
from masrel.cli._commands import ListedCommands
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    grouped,
    output_options,
    write_output,
)
from masrel.cli._paths import InputFile, note_inputs, refuse_inputs
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_SMALL, parse_toml, read_regular, sha256_of
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    JointModel,
    intermediate_models,
)
from masrel.lab.elbow._model_file import MODEL_KEYS, QUANTITIES, as_toml, model_document
from masrel.lab.protocol import StudyPaths, joint_model, read_model_file, read_protocol
from masrel.lab.protocol._kinds import (
    DEFAULT_KIND,
    kind_problem,
    model_of_kind,
    value_problems,
)
from masrel.lab.report._traced_scenes import tardieu_document, tardieu_text
from masrel.tables._tables import Column, Table

_COMMANDS = {
    "trace": "Compute phases, peak torque and samples of stretches of models.",
    "tardieu": "Compute R2, R1 and their difference from stretches at three speeds.",
    "fit": "Estimate a joint's parameters from recordings of stretches.",
    "friction": "Fit the friction of a device to recordings of backdriving.",
    "between": "Create models to use as dummies between the standards.",
}
_MODULES = {"trace": "_trace", "fit": "_fit", "friction": "_fit"}


@click.group(
    "joint",
    cls=ListedCommands,
    parts={"Commands": _COMMANDS},
    place=lambda name: f"masrel.lab.cli.{_MODULES.get(name, 'joint')}",
)
def joint() -> None:
    """Trace or fit joints, and create models between two others."""


START_DEG = 30.0
"""Where a stretch starts by default, deg."""


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

    def changed(self, joint: JointModel) -> JointModel:
        """Return a joint with the changes, which only a spastic elbow can have."""
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
        help="HM1 to HM4, a model of --study, or a model file (.toml). Repeatable.",
    ),
    click.option(
        "--study", type=click.Path(path_type=Path),
        help="Take models from this study's protocol.",
    ),
    click.option(
        "--kind", "kinds", multiple=True,
        help="Another kind of joint with its defaults, named as in a protocol. "
        "Repeatable.",
    ),
    click.option(
        "--parameter", "parameters", multiple=True, metavar="KEY=VALUE",
        help="Parameter of --kind, named as in [models.parameters]. Repeatable.",
    ),
    click.option(
        "--rest-deg", "rest", type=float,
        help="Resting angle, θ_rest; default: where the stretch starts.",
    ),
    click.option(
        "--post-catch", type=click.Choice(["continuous", "additive"]),
        help="Reading of equation (5), the torque after the catch.",
    ),
    click.option(
        "--q-reading", "reading", type=click.Choice(["residual", "decrease"]),
        help="What Q measures as a share of the peak.",
    ),
    click.option(
        "--catch-rise-s", "rise", type=float,
        help="Time over which the onset of the catch is smoothed.",
    ),
    click.option(
        "--inertia-kg-m2", "inertia", type=float,
        help="Inertia, m in equations (1) and (5).",
    ),
)  # fmt: skip


@click.command("tardieu", cls=GroupedHelp)
@joint_options
@click.option(
    "--from-deg", "start", type=float, default=START_DEG, show_default=True,
    help="Angle at the start.",
)  # fmt: skip
@click.option(
    "--speed-deg-s", "speeds", type=(float, float, float), metavar="V1 V2 V3",
    default=(10.0, 100.0, 150.0),
    help="Speeds of the three stretches.  [default: 10 100 150]",
)  # fmt: skip
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else."
)
def tardieu(
    joints: JointOptions,
    start: float,
    speeds: tuple[float, float, float],
    output: OutputOptions,
) -> None:
    """Compute R2, R1 and their difference from full-range stretches at three speeds."""
    documents = [
        tardieu_document(name, joint, start, speeds)
        for name, joint in joints_of(joints).items()
    ]
    write_output(
        output,
        document=lambda: (
            documents[0] if len(documents) == 1 else {"tardieu": documents}
        ),
        text=lambda: tardieu_text(documents),
    )


def joints_of(names: JointOptions) -> dict[str, JointModel]:
    """Return joints by name."""
    if not names.models and not names.kinds:
        raise click.UsageError("Missing option '--model' or '--kind'.")
    if names.parameters and len(names.kinds) != 1:
        raise ParameterError("--parameter: needs exactly one --kind")
    joints: dict[str, JointModel] = {}
    models, study = tuple(dict.fromkeys(names.models)), names.study
    more = ", or --study to name a study's own"
    for name, model in zip(_names("--model", models), models, strict=True):
        if study is None:
            joints[name] = _read_joint("--model", model, more)
        elif model.endswith(".toml"):
            raise ParameterError(
                f"--model: needs a model of --study, got the file {model}; without "
                "--study it is read with the usual constants"
            )
        else:
            joints[name] = joint_model(read_protocol(StudyPaths(study).protocol), model)
    for kind in dict.fromkeys(names.kinds):
        joints[kind] = _joint_of_kind(kind, names.parameters)
    return {name: names.changed(joint) for name, joint in joints.items()}


def _names(option: str, models: Sequence[str]) -> list[str]:
    # of standard models, and of files without their endings
    names = [Path(m).stem if m.endswith(".toml") else m for m in models]
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(
                f"{option}: needs models whose names differ, got two called {name}"
            )
    return names


def _read_joint(option: str, model: str, more: str = "") -> ElbowParameters:
    # a standard model, or that of a file
    if model.endswith(".toml"):
        note_inputs(Path(model))
        return read_model_file(Path(model))
    if model not in STANDARD_MODELS:
        raise ParameterError(
            f"{option}: needs one of {', '.join(STANDARD_MODELS)}, or a model file "
            f"(.toml){more}, got {model!r}"
        )
    return STANDARD_MODELS[model]


def _joint_of_kind(kind: str, settings: Sequence[str]) -> JointModel:
    # settings: KEY=VALUE each
    refuse(
        ((problem := kind_problem(kind)) is not None, f"--kind: {problem}"),
        (
            kind == DEFAULT_KIND,
            f"--kind: needs a kind other than {kind}, for which there is --model",
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


_PLACES = ("name", "from", "to", "way", "file")  # what JSON says beside the content
_RULE = (
    "Of n models in a gap, the i-th is i/(n + 1) of the way, each number interpolated "
    "linearly."
)


@click.command("between")
@click.argument(
    "models", nargs=-1, required=True, metavar="MODEL MODEL...", type=InputFile()
)
@click.option(
    "-n",
    "--number",
    "n_models",
    type=int,
    required=True,
    help="Number of models to create; every gap gets the same number.",
)
@click.option(
    "-o",
    "--output",
    "folder",
    type=click.Path(path_type=Path),
    help="Write the models to this folder as D01.toml, D02.toml, ...",
)
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace existing model files of the same names.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else.",
    makes_folder=True,
)
def between(
    models: tuple[str, ...],
    n_models: int,
    folder: Path | None,
    overwrite: bool,
    output: OutputOptions,
) -> None:
    """Create intermediate models to use as dummies between the standards.

    A MODEL is HM1, HM2, HM3, HM4 or a model file (.toml). List them from mildest to
    most severe: new models are put at even steps between neighbours. Prints L, H, Q and
    D of each model. To use the new models, name their files in a protocol.
    """
    if overwrite and folder is None:
        raise ParameterError(
            "--overwrite: needs --output, without which nothing is written"
        )
    rows = _rows(models, n_models)
    if folder is not None:
        _write(rows, folder, overwrite=overwrite)
    write_output(
        output,
        document=lambda: {
            "simulated": any(row["simulated"] for row in rows),
            "rule": _RULE,
            "models": rows,
        },
        text=lambda: _table(rows),
    )


def _rows(models: Sequence[str], n_models: int) -> list[dict[str, Any]]:
    # for every new model its name, its neighbours, and the content of its file
    names, rows = _names("MODEL", models), []
    joints = [_read_joint("MODEL", model) for model in models]
    sources = [_source(*of) for of in zip(names, models, strict=True)]
    made = intermediate_models(dict(zip(names, joints, strict=True)), n_models)
    each = n_models // (len(models) - 1)
    for i, (name, joint) in enumerate(made.items()):
        gap, fraction = i // each, f"{i % each + 1}/{each + 1}"
        (first, is_simulated), (second, is_other) = sources[gap : gap + 2]
        document = model_document(
            joint,
            simulated=is_simulated or is_other,
            made_from=(
                f"masrel joint between {masrel.__version__}: {fraction} of the way "
                f"from {first} to {second}"
            ),
        )
        places = {"from": names[gap], "to": names[gap + 1], "way": fraction}
        rows.append({"name": name, **places, "file": None, **document})
    return rows


def _source(name: str, model: str) -> tuple[str, bool]:
    # what a model is called, of a file with the start of its checksum, and whether it
    # comes from simulated recordings
    if name == model:
        return name, False
    content = read_regular(Path(model), most=MAX_SMALL)
    simulated = parse_toml(content).get("simulated")
    if not isinstance(simulated, bool):
        raise ParameterError(
            f"{model}: simulated must be true or false, because models made from it "
            f"inherit it; got {'nothing' if simulated is None else repr(simulated)}"
        )
    checksum = sha256_of(content)
    return f"{name} ({model}, sha256 {checksum[:16]})", simulated


def _write(rows: list[dict[str, Any]], folder: Path, *, overwrite: bool) -> None:
    files = [folder / f"{row['name']}.toml" for row in rows]
    refuse_inputs(*files)
    there = [path.name for path in files if path.exists()]
    if there and not overwrite:
        raise ParameterError(
            f"--output: {folder} already holds {', '.join(there[:3])}"
            f"{' and more' if len(there) > 3 else ''}; --overwrite replaces them"
        )
    for path, row in zip(files, rows, strict=True):
        document = {key: row[key] for key in row if key not in _PLACES}
        write_file(path, as_toml(document))
        row["file"] = str(path)
    click.echo(f"models: {folder}, {files[0].name} to {files[-1].name}", err=True)


def _table(rows: list[dict[str, Any]]) -> Table:
    quantities = [q for q in QUANTITIES.values() if q.key in MODEL_KEYS]
    return Table(
        name="between",
        caption="Intermediate models",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="way", heading="Way", align="left"),
            *(
                Column(key=q.key, heading=f"{q.symbol} ({q.unit})", digits=3)
                for q in quantities
            ),
        ),
        rows=tuple(
            (
                row["name"],
                f"{row['way']} from {row['from']} to {row['to']}",
                *(row["model"][q.key] for q in quantities),
            )
            for row in rows
        ),
        notes=(_RULE,),
        data="simulated" if any(row["simulated"] for row in rows) else "foreign",
    )
