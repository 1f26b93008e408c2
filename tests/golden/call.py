"""Call the package as a user does, and keep all it says as plain values."""

import contextlib
import dataclasses
import io
import json
import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np

from masrel.cli import main

STUDIES = Path(__file__).parents[2] / "studies"


@dataclass(frozen=True, slots=True)
class Case:
    """What is computed, and under which name its result is stored."""

    group: str
    name: str
    make: Callable[[], object]
    slow: bool = False


class Stream:
    """Numbers at random that no version of anything changes."""

    def __init__(self, seed: str) -> None:
        self._random = Random(seed).random  # the one method Python keeps as it is

    def below(self, n: int) -> int:
        return int(self._random() * n)

    def uniform(self, low: float, high: float) -> float:
        return low + (high - low) * self._random()

    def one_of(self, values: list) -> object:
        return values[self.below(len(values))]

    def chance(self, share: float) -> bool:
        return self._random() < share

    def normal(self) -> float:
        return sum(self._random() for _ in range(12)) - 6.0


NOT_STORED = {
    *("distribution", "is_one_sided", "units_are", "raters_differ", "prior"),
}
"""Fields of an interval that its JSON has not either: its method says them in words."""


def plain(value: object) -> object:
    """Dataclasses, arrays and tuples as what JSON has."""
    if dataclasses.is_dataclass(value):
        return {
            of.name: plain(getattr(value, of.name))
            for of in dataclasses.fields(value)
            if of.name not in NOT_STORED
        }
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return value


def outcome(
    function: Callable[..., object], *arguments: object, **options: object
) -> dict:
    """The result of a call or its error, and the warnings it gave."""
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        try:
            made = {"result": plain(function(*arguments, **options))}
        except Exception as error:  # noqa: BLE001 - which error it is, is the result
            made = {"error": f"{type(error).__name__}: {error}"}
    if noted:
        made["warnings"] = _texts(noted)
    return made


def _texts(noted: list[warnings.WarningMessage]) -> list[str]:
    return [f"{of.category.__name__}: {of.message}" for of in noted]


@contextlib.contextmanager
def folder(**files: str) -> Iterator[Path]:
    """Work in a new folder that holds these files, `__` in a name being a dot."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        for file, text in files.items():
            (Path(name) / file.replace("__", ".")).write_text(text, encoding="utf-8")
        os.chdir(name)
        try:
            yield Path(name)
        finally:
            os.chdir(before)


def masrel(*arguments: object) -> dict:
    """How a call of the command line ended, and what it printed; JSON parsed."""
    out, err, argv = io.StringIO(), io.StringIO(), sys.argv
    code: object = 0
    sys.argv = ["masrel", *map(str, arguments)]
    try:
        with (
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            warnings.catch_warnings(record=True) as noted,
        ):
            warnings.simplefilter("always")
            main()
    except SystemExit as ended:
        code = ended.code
    finally:
        sys.argv = argv
    made = {"code": code, "err": without_paths(err.getvalue())}
    text = without_paths(out.getvalue())
    if noted:
        made["warnings"] = _texts(noted)
    is_json = text.startswith(("{", "["))
    return made | ({"json": json.loads(text)} if is_json else {"out": text})


def without_paths(text: str) -> str:
    """A text in which the folders of this machine have names."""
    for path, name in ((str(STUDIES), "STUDIES"), (str(Path.cwd()), "FOLDER")):
        latex = path.replace("_", r"\_")
        # as it is, and as LaTeX has it and may break it
        for shown in (path, latex, latex.replace("/", r"/\allowbreak{}")):
            text = text.replace(shown, name)
    return text
