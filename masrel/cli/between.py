"""``masrel between``: model files at even steps between models."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.output import write_json
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.cli.between_models import Between

__all__ = ["command"]

RULE = (
    "Of n models in a gap, the i-th is i/(n + 1) of the way, each number interpolated "
    "linearly."
)


@click.command("between")
@click.argument("models", nargs=-1, required=True, metavar="MODEL MODEL...")
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
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write everything as JSON here; - prints it, and nothing else, on stdout.",
)
def command(
    models: tuple[str, ...],
    n_models: int,
    folder: Path | None,
    overwrite: bool,
    json_file: Path | None,
) -> None:
    """Put models at even steps between neighbours: dummies that hide standards.

    A MODEL is HM1, HM2, HM3, HM4 or a model file (.toml), mildest first: their order
    says who is whose neighbour. Prints L, H, Q and D of each; a protocol names the
    files.
    """
    from masrel.cli.between_models import between, read_source

    if overwrite and folder is None:
        raise ParameterError("--overwrite: needs --output: nothing is written without")
    made = between([read_source(model) for model in models], n_models)
    files = [] if folder is None else _write(made, folder, overwrite=overwrite)
    if json_file is not None:
        write_json(_document(made, files), json_file)
    if json_file != Path("-"):
        click.echo(_table(made))


def _write(made: "list[Between]", folder: Path, *, overwrite: bool) -> list[Path]:
    from masrel.elbow.identification import as_toml

    files = [folder / f"{model.name}.toml" for model in made]
    there = [path.name for path in files if path.exists()]
    if there and not overwrite:
        raise ParameterError(
            f"--output: {folder} holds {', '.join(there[:3])}"
            f"{' and more' if len(there) > 3 else ''} already; --overwrite replaces "
            "what is there"
        )
    folder.mkdir(parents=True, exist_ok=True)
    for path, model in zip(files, made, strict=True):
        path.write_text(as_toml(model.document), encoding="utf-8")
    click.echo(f"models: {folder}, {files[0].name} to {files[-1].name}", err=True)
    return files


def _document(made: "list[Between]", files: list[Path]) -> dict[str, object]:
    named = [str(path) for path in files] if files else [None] * len(made)
    return {
        "simulated": any(model.simulated for model in made),
        "rule": RULE,
        "models": [
            {
                "name": model.name,
                "from": model.first,
                "to": model.second,
                "way": model.way,
                "file": file,
                **model.document,
            }
            for model, file in zip(made, named, strict=True)
        ],
    }


def _table(made: "list[Between]") -> str:
    from masrel.elbow.identification.model_file import MODEL_KEYS
    from masrel.elbow.identification.quantities import QUANTITIES
    from masrel.report._tables import Column, Table, as_text

    shown = [q for q in QUANTITIES.values() if q.key in MODEL_KEYS]
    table = Table(
        name="between",
        caption="Models between models",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="way", heading="Way", align="left"),
            *(
                Column(key=q.key, heading=f"{q.symbol} ({q.unit})", digits=3)
                for q in shown
            ),
        ),
        rows=tuple(
            (
                model.name,
                f"{model.way} from {model.first} to {model.second}",
                *(model.numbers[q.key] for q in shown),
            )
            for model in made
        ),
        notes=(RULE,),
        data="simulated" if any(model.simulated for model in made) else "foreign",
    )
    return as_text(table)
