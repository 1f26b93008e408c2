"""``masrel joint between``: model files at even steps between models."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

import masrel
from masrel._files import write_file
from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.cli._paths import InputFile, refuse_inputs
from masrel.errors import ParameterError
from masrel.lab._bounded_files import MAX_SMALL, parse_toml, read_regular

if TYPE_CHECKING:
    from masrel.lab.elbow import ElbowParameters
    from masrel.tables._tables import Table

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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Between:
    """A model between two others."""

    name: str  # ``D01`` and so on
    # first, second: its neighbours among the sources
    first: str
    second: str
    fraction: str  # of the way from the first to the second
    simulated: bool  # whether one of them is
    numbers: dict[str, float]  # L, H, Q and D by the key of a model file
    document: dict[str, object]  # content of its model file


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
    placed = _place_between([_read_source(model) for model in models], n_models)
    files = [] if folder is None else _write(placed, folder, overwrite=overwrite)
    write_output(
        output, document=lambda: _document(placed, files), text=lambda: _table(placed)
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


def _place_between(sources: Sequence[_Source], n_models: int) -> list[_Between]:
    from masrel.lab.elbow import intermediate_models

    joints = {source.name: source.joint for source in sources}
    if len(joints) < len(sources):
        names = [source.name for source in sources]
        twice = next(name for name in names if names.count(name) > 1)
        raise ParameterError(
            f"MODEL: needs models whose names differ, got two called {twice}"
        )
    made = intermediate_models(joints, n_models)
    each = n_models // (len(sources) - 1)
    return [
        _model_between(
            name,
            joint,
            sources[i // each : i // each + 2],
            f"{i % each + 1}/{each + 1}",
        )
        for i, (name, joint) in enumerate(made.items())
    ]


def _model_between(
    name: str, joint: "ElbowParameters", neighbours: Sequence[_Source], fraction: str
) -> _Between:
    from masrel.lab.elbow.identification import model_document
    from masrel.lab.elbow.identification._model_file import MODEL_KEYS

    first, second = neighbours
    simulated = first.simulated or second.simulated
    return _Between(
        name=name,
        first=first.name,
        second=second.name,
        fraction=fraction,
        simulated=simulated,
        numbers={
            key: getattr(joint, field) * factor
            for key, (field, factor) in MODEL_KEYS.items()
        },
        document=model_document(
            joint,
            simulated=simulated,
            made_from=(
                f"masrel joint between {masrel.__version__}: {fraction} of the way "
                f"from {first.label} to {second.label}"
            ),
        ),
    )


def _write(placed: list[_Between], folder: Path, *, overwrite: bool) -> list[Path]:
    from masrel.lab.elbow.identification import as_toml

    files = [folder / f"{model.name}.toml" for model in placed]
    refuse_inputs(*files)
    there = [path.name for path in files if path.exists()]
    if there and not overwrite:
        raise ParameterError(
            f"--output: {folder} holds {', '.join(there[:3])}"
            f"{' and more' if len(there) > 3 else ''} already; --overwrite replaces "
            "what is there"
        )
    for path, model in zip(files, placed, strict=True):
        write_file(path, as_toml(model.document))
    click.echo(f"models: {folder}, {files[0].name} to {files[-1].name}", err=True)
    return files


def _document(placed: list[_Between], files: list[Path]) -> dict[str, object]:
    named = [str(path) for path in files] if files else [None] * len(placed)
    return {
        "simulated": any(model.simulated for model in placed),
        "rule": _RULE,
        "models": [
            {
                "name": model.name,
                "from": model.first,
                "to": model.second,
                "way": model.fraction,
                "file": file,
                **model.document,
            }
            for model, file in zip(placed, named, strict=True)
        ],
    }


def _table(placed: list[_Between]) -> "Table":
    from masrel.lab.elbow.identification._model_file import MODEL_KEYS, QUANTITIES
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
                model.name,
                f"{model.fraction} from {model.first} to {model.second}",
                *(model.numbers[q.key] for q in quantities),
            )
            for model in placed
        ),
        notes=(_RULE,),
        data="simulated" if any(model.simulated for model in placed) else "foreign",
    )
