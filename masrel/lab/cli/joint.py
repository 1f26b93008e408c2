"""``masrel joint``: traces of joints, joints of recordings, and models between."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import masrel
from masrel._files import write_file
from masrel.cli._commands import ListedCommands
from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.cli._paths import InputFile, refuse_inputs
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_SMALL, parse_toml, read_regular

if TYPE_CHECKING:
    from masrel.lab.elbow import ElbowParameters
    from masrel.tables._tables import Table


_COMMANDS = {
    "trace": "Phases, peak torque and samples of stretches of models.",
    "tardieu": "R2, R1 and their difference, by stretches at three speeds.",
    "fit": "Identify the joint behind recordings of slow and fast stretches.",
    "friction": "Fit the friction of a device to recordings of backdriving.",
    "between": "Put models at even steps between neighbours, to hide standards.",
}
_MODULES = {"trace": "_trace", "tardieu": "_joints", "between": "joint"}


@click.group(
    "joint",
    cls=ListedCommands,
    parts={"Commands": _COMMANDS},
    place=lambda name: f"masrel.lab.cli.{_MODULES.get(name, '_fit')}",
)
def joint() -> None:
    """Traces of joints, joints of recordings, and models between models."""


_PLACES = ("name", "from", "to", "way", "file")  # what JSON says beside the content
_RULE = (
    "Of n models in a gap, the i-th is i/(n + 1) of the way, each number interpolated "
    "linearly."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    """A model that others are put next to."""

    name: str  # name of a standard model, or that of a file without its ending
    label: str  # the same with the file and the start of its checksum
    joint: "ElbowParameters"
    simulated: bool  # whether it comes from simulated recordings


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
    help="How many to make; the same number in every gap.",
)
@click.option(
    "-o",
    "--output",
    "folder",
    type=click.Path(path_type=Path),
    help="Write a model file each into this folder: D01.toml, D02.toml, ...",
)
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace model files of these names that are there.",
)
@output_options(
    json="Write everything as JSON here; - prints it, and nothing else, on stdout.",
    makes_folder=True,
)
def between(
    models: tuple[str, ...],
    n_models: int,
    folder: Path | None,
    overwrite: bool,
    output: OutputOptions,
) -> None:
    """Put models at even steps between neighbours: dummies that hide standards.

    A MODEL is HM1, HM2, HM3, HM4 or a model file (.toml), mildest first: their order
    says who is whose neighbour. Prints L, H, Q and D of each; a protocol names the
    files.
    """
    if overwrite and folder is None:
        raise ParameterError("--overwrite: needs --output: nothing is written without")
    rows = _rows([_read_source(model) for model in models], n_models)
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


def _read_source(model: str) -> _Source:
    from masrel.lab.elbow import STANDARD_MODELS
    from masrel.lab.protocol import read_model_file

    if not model.endswith(".toml"):
        if model not in STANDARD_MODELS:
            known = ", ".join(STANDARD_MODELS)
            raise ParameterError(
                f"MODEL: needs {known} or a model file (.toml), got {model!r}"
            )
        joint = STANDARD_MODELS[model]
        return _Source(name=model, label=model, joint=joint, simulated=False)
    path = Path(model)
    joint = read_model_file(path)
    content = read_regular(path, most=MAX_SMALL)
    simulated = parse_toml(content).get("simulated")
    if not isinstance(simulated, bool):
        raise ParameterError(
            f"{path}: simulated must be true or false: what is made of the model says "
            f"the same; got {'nothing' if simulated is None else repr(simulated)}"
        )
    checksum = hashlib.sha256(content).hexdigest()
    return _Source(
        name=path.stem,
        label=f"{path.stem} ({path}, sha256 {checksum[:16]})",
        joint=joint,
        simulated=simulated,
    )


def _rows(sources: Sequence[_Source], n_models: int) -> list[dict[str, Any]]:
    # for every new model its name, its neighbours, and the content of its file
    from masrel.lab.elbow import intermediate_models
    from masrel.lab.elbow._model_file import model_document

    joints = {source.name: source.joint for source in sources}
    if len(joints) < len(sources):
        names = [source.name for source in sources]
        twice = next(name for name in names if names.count(name) > 1)
        raise ParameterError(
            f"MODEL: needs models whose names differ, got two called {twice}"
        )
    made = intermediate_models(joints, n_models)
    each = n_models // (len(sources) - 1)
    rows = []
    for i, (name, joint) in enumerate(made.items()):
        first, second = sources[i // each : i // each + 2]
        fraction = f"{i % each + 1}/{each + 1}"
        document = model_document(
            joint,
            simulated=first.simulated or second.simulated,
            made_from=(
                f"masrel joint between {masrel.__version__}: {fraction} of the way "
                f"from {first.label} to {second.label}"
            ),
        )
        places = {"from": first.name, "to": second.name, "way": fraction}
        rows.append({"name": name, **places, "file": None, **document})
    return rows


def _write(rows: list[dict[str, Any]], folder: Path, *, overwrite: bool) -> None:
    from masrel.lab.elbow._model_file import as_toml

    files = [folder / f"{row['name']}.toml" for row in rows]
    refuse_inputs(*files)
    there = [path.name for path in files if path.exists()]
    if there and not overwrite:
        raise ParameterError(
            f"--output: {folder} holds {', '.join(there[:3])}"
            f"{' and more' if len(there) > 3 else ''} already; --overwrite replaces "
            "what is there"
        )
    for path, row in zip(files, rows, strict=True):
        document = {key: row[key] for key in row if key not in _PLACES}
        write_file(path, as_toml(document))
        row["file"] = str(path)
    click.echo(f"models: {folder}, {files[0].name} to {files[-1].name}", err=True)


def _table(rows: list[dict[str, Any]]) -> "Table":
    from masrel.lab.elbow._model_file import MODEL_KEYS, QUANTITIES
    from masrel.tables._tables import Column, Table

    quantities = [q for q in QUANTITIES.values() if q.key in MODEL_KEYS]
    return Table(
        name="between",
        caption="Models between models",
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
