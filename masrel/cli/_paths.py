"""Paths that a call names: no output overwrites an input or a record."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from masrel._files import refuse_record
from masrel._input import refuse

_INPUTS, _OUTPUTS = "masrel.inputs", "masrel.outputs"


class InputFile(click.Path):
    """An option's or argument's file that is read."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """Return the path, which no output may have."""
        path = super().convert(value, param, ctx)
        note_inputs(Path(os.fsdecode(path)))
        return path


class OutputFile(click.Path):
    """An option's file that is written."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """Return the path, which no input has."""
        path = super().convert(value, param, ctx)
        if str(file := Path(os.fsdecode(path))) != "-":
            refuse_record(file)
            refuse_inputs(file)
        return path


class FileInFolder(OutputFile):
    """A file that is written to a folder that is there."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """Return the path, refused before anything is computed for it."""
        path = super().convert(value, param, ctx)
        folder = Path(os.fsdecode(path)).parent
        option = "" if param is None else f"{param.opts[0]}: "
        refuse(
            (
                not folder.is_dir(),
                f"{option}needs a folder that exists, got {os.fsdecode(path)}: there "
                f"is no folder {folder}",
            )
        )
        return path


def note_inputs(*paths: Path) -> None:
    """Refuse outputs of the call that would take the place of these files."""
    # the facts of a recording are read with it
    facts = [path.with_suffix(".json") for path in paths if path.suffix == ".npz"]
    _compare(_INPUTS, [*paths, *facts])


def refuse_inputs(*paths: Path) -> None:
    """Refuse to write these files if the call reads one of them."""
    _compare(_OUTPUTS, paths)


def _compare(key: str, more: Sequence[Path]) -> None:
    # with all of this call: options are converted in the order in which they were typed
    ctx = click.get_current_context(silent=True)
    paths: dict[str, list[Path]] = {} if ctx is None else ctx.meta
    paths.setdefault(key, []).extend(more)
    inputs = {path.resolve() for path in paths.get(_INPUTS, ())}
    refuse(
        *(
            (
                path.parent.resolve() / path.name in inputs or path.resolve() in inputs,
                f"{path}: needs a different output file, because this one is an input",
            )
            for path in paths.get(_OUTPUTS, ())
        )
    )
