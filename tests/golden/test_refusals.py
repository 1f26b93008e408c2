"""What is refused is refused as before: by which error, and naming which place.

Each row of `refusals.toml` is a call and what its refusal must be and must name. How
the message puts it is free.
"""

import importlib
import re
import shlex
import shutil
import tomllib
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy
import pandas
import pytest

from masrel import plots
from masrel.scales import MODIFIED_ASHWORTH
from tests.golden.call import folder, masrel
from tests.lab.protocol.documents import changed, without, write

TABLE = tomllib.loads(Path(__file__).with_name("refusals.toml").read_text("utf-8"))
FILES: dict[str, str] = TABLE.pop("files")
DATA: dict[str, Any] = TABLE.pop("data")
STUDIES: dict[str, list[str]] = TABLE.pop("studies")
SETUP: list[str] = TABLE.pop("setup")

STATISTICS = (
    *("agreement", "intervals", "ratings", "planning", "audit", "judges", "scales"),
    "plots",
)
LABORATORY = (
    *("protocol", "schedule.presentation", "schedule._secret", "_event_log"),
    *("schedule.sheets", "run._corrections", "run._settings", "recording"),
    *("elbow", "elbow.tone", "elbow.identification"),
    *("hess", "hess.puck", "hess.moteus", "ratings"),
)
HOMES = [
    *(f"masrel.{name}" for name in STATISTICS),
    *(f"masrel.lab.{name}" for name in LABORATORY),
]


class Names(dict[str, Any]):
    """What a row's call may use: public names of the package, and a few of Python."""

    def __missing__(self, name: str) -> Any:
        for home in map(importlib.import_module, HOMES):
            if name in getattr(home, "__all__", vars(home)):
                return getattr(home, name)
        raise KeyError(name)


def protocol(where: str, *to: Any) -> Any:
    """Read a protocol of which a key, such as "models.0.id", is changed or gone."""
    keys = [int(key) if key.isdigit() else key for key in where.split(".")]
    document = changed(*keys, to=to[0]) if to else without(*keys)
    return NAMES["read_protocol"](write(document, Path()))


NAMES = Names(
    DATA,
    ashworth=MODIFIED_ASHWORTH,
    protocol=protocol,
    array=numpy.array,
    plots=plots,
    frame=pandas.DataFrame,
    path=Path,
    nan=float("nan"),
    inf=float("inf"),
)


def refusal(call: str) -> tuple[object, str]:
    """The error's class and message, or the exit code and what was on stderr."""
    if call.startswith("masrel "):
        ended = masrel(*shlex.split(call)[1:])
        return ended["code"], ended["err"]
    with warnings.catch_warnings(action="ignore"):
        try:
            eval(call, {}, NAMES)
        except Exception as error:  # noqa: BLE001 - which error it is, is the result
            return type(error).__name__, str(error)
    return None, ""


def is_named(name: str, message: str) -> bool:
    return re.search(rf"(?<!\w){re.escape(name)}(?!\w)", message) is not None


@pytest.fixture(scope="module", autouse=True)
def in_folder_of_files() -> Iterator[None]:
    with folder():
        make_files()
        yield


def make_files() -> None:
    """The files that rows name, and the studies: "p" and those that differ from it."""
    made = [masrel("init", "p")]
    for name, text in FILES.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_bytes(text.encode("latin-1"))
    made.append(masrel("schedule", "p"))
    run = ("--session", "test", "--grades", "simulated", "--quiet")
    made.append(masrel("run", "p", "--rater", "R1", *run))
    assert [call["code"] for call in made] == [0, 0, 0], made
    for study, (name, old, new) in STUDIES.items():
        shutil.copytree("p", study)
        text = Path(study, name).read_text("utf-8")
        assert old in text, study
        Path(study, name).write_text(text.replace(old, new, 1), "utf-8")
    for call in SETUP:
        assert masrel(*shlex.split(call)[1:])["code"] == 0, call


@pytest.mark.parametrize("part", TABLE)
def test_refused_as_before(part: str) -> None:
    wrong = []
    for call, (kind, *names) in TABLE[part].items():
        came, message = refusal(call)
        unnamed = [name for name in names if not is_named(name, message)]
        if came != kind or unnamed or "Traceback" in message:
            wrong.append(f"{call}\n  needs {kind}, {unnamed}; came {came}: {message}")
    assert not wrong, "\n".join(wrong)
