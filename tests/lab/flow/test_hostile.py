"""A study from somebody else: whatever its files are, a verb ends, soon and in words.

Each call is a process of its own, whose time and memory are what the system counted.
"""

import os
import re
import shutil
import signal
import subprocess
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.faults import Faults
from tests.lab.cli.test_limits import DEEP, bomb
from tests.lab.flow.cuts import masrel_command

MOST_S, MOST_MB = 5.0, 1000.0
_PATIENCE_S = 120.0  # for a process that waits for what never comes

pytestmark = [pytest.mark.long, pytest.mark.faults]


@dataclass(frozen=True, slots=True)
class Ended:
    """How a process ended, and what it took."""

    code: int
    err: str
    seconds: float
    mb: float


def measured(*arguments: object, **environment: str) -> Ended:
    """Run a verb -> how it ended; one that does not end is killed."""
    process = subprocess.Popen(
        masrel_command(*arguments),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env={**os.environ, **environment},
    )
    assert process.stderr is not None
    late = threading.Timer(_PATIENCE_S, os.kill, (process.pid, signal.SIGKILL))
    late.start()
    err = process.stderr.read().decode(errors="replace")
    _, status, used = os.wait4(process.pid, 0)
    late.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    process.stderr.close()
    seconds = used.ru_utime + used.ru_stime
    return Ended(process.returncode, err, seconds, used.ru_maxrss / 1e3)


def check_within_limits(ended: Ended) -> None:
    assert ended.code in (0, 2), ended
    assert "Traceback" not in ended.err
    assert ended.seconds < MOST_S, ended
    assert ended.mb < MOST_MB, ended


def check_refused(ended: Ended) -> None:
    check_within_limits(ended)
    assert ended.code == 2, ended
    assert 0 < len(ended.err) < 100_000


@pytest.fixture
def study(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "study"))


FILES = {
    "protocol.toml": ("check", "verify", "report", "schedule"),
    "schedules/test_R1.csv": ("check", "verify", "schedule"),
    "schedules/test_R1_sheet.csv": ("check", "schedule"),
    "sessions/test_R1.jsonl": ("check", "verify", "ratings", "report"),
    "sessions/test_R1/*.npz": ("check", "verify", "report"),
    "sessions/test_R1/*.json": ("check", "verify", "report"),
    "ratings/ratings.csv": ("check", "verify", "analyze", "report"),
    "ratings/published.csv": ("check", "report"),
    "conduct.jsonl": ("check", "verify", "report", "ratings"),
    ".key/secret.txt": ("check", "schedule"),
    "published_secret.txt": ("check", "verify"),
    "analysis.json": ("verify", "analyze"),
    "report/manifest.json": ("verify", "report"),
}


def in_place_of(study: Path, name: str, make: Callable[[Path], object]) -> None:
    path = next(iter(sorted(study.glob(name))), study / name)
    path.unlink(missing_ok=True)
    make(path)


@pytest.mark.parametrize("kind", ["a pipe", "a device", "a folder"])
@pytest.mark.parametrize("name", FILES)
def test_what_is_no_file(name: str, kind: str, study: Path, faults: Faults) -> None:
    make: dict[str, Callable[[Path], object]] = {
        "a pipe": os.mkfifo,
        "a device": lambda path: path.symlink_to("/dev/zero"),
        "a folder": Path.mkdir,
    }
    in_place_of(study, name, make[kind])
    for verb in FILES[name]:
        with faults(f"{kind} in the place of a file of a study"):
            check_within_limits(measured(verb, study))


CONTENTS = {
    "nested": b"[" * 200_000,
    "a long number": b'{"a": ' + b"9" * 5000 + b"}\n",
    "a long line": b"x," * 500_000 + b"\n",
    "many lines": b"1,2,3\n" * 200_000,
    "no text": bytes(range(256)) * 100,
    "nothing": b"",
    "large": b"a" * 200_000_000,
}


@pytest.mark.parametrize("content", CONTENTS)
@pytest.mark.parametrize("name", FILES)
def test_what_no_file_should_hold(
    name: str, content: str, study: Path, faults: Faults
) -> None:
    in_place_of(study, name, lambda path: path.write_bytes(CONTENTS[content]))
    for verb in FILES[name][:2]:
        with faults("odd contents of a file of a study: nested, long, large, no text"):
            check_within_limits(measured(verb, study))


def edited(study: Path, pattern: str, new: str) -> None:
    path = study / "protocol.toml"
    text, n_changed = re.subn(pattern, lambda _: new, path.read_text(), count=1)
    assert n_changed == 1
    path.write_text(text)


def raters(n: int) -> str:
    return "".join(f'[[raters]]\nid = "X{i}"\n\n' for i in range(n))


PROTOCOLS = {
    "a model file that is a device": (
        r"(?m)^\[\[raters\]\]$",
        '[[models]]\nid = "F1"\nrole = "dummy"\nfile = "/dev/zero"\n\n[[raters]]',
    ),
    "a hand that takes an hour": (
        r"mean_speed_deg_s = \S+",
        "mean_speed_deg_s = 0.1",
    ),
    "a long number": (r"(?m)^seed = .*$", "seed = " + "9" * 5000),
    "a rater 100 000 times": (
        r"(?m)^raters = \[.*\]$",
        f"raters = {['R1'] * 100_000}",
    ),
    "many raters": (r"(?m)^\[\[raters\]\]$", raters(20_000) + "[[raters]]"),
    "a long text": (r'(?m)^title = ".*"$', f'title = "{"t" * 900_000}"'),
    **{f"deep {name}": (r"\A", f"{text}\n") for name, text in DEEP.items()},
}


@pytest.mark.parametrize("case", PROTOCOLS)
def test_a_protocol_that_would_take_for_ever(
    case: str, study: Path, faults: Faults
) -> None:
    edited(study, *PROTOCOLS[case])
    for verb in ("check", "verify"):
        with faults("a protocol that is deep, long or slow"):
            check_within_limits(measured(verb, study))


def test_a_small_recording_of_large_columns(
    study: Path, tmp_path: Path, faults: Faults
) -> None:
    packed = tmp_path / "packed.npz"
    bomb(packed, 100_000_000)
    motion = ("--motion", "recording", "--recording", packed)
    for call in (
        ("joint", "fit", packed),
        ("joint", "trace", "--model", "HM1", *motion),
    ):
        with faults("a packed recording of 2.4 GB"):
            check_refused(measured(*call))
    in_place_of(study, "sessions/test_R1/*.npz", lambda path: packed.rename(path))
    for verb in ("check", "verify"):
        with faults("a packed recording of 2.4 GB"):
            check_refused(measured(verb, study))


def test_tables_that_are_wide_or_odd(tmp_path: Path, faults: Faults) -> None:
    table = tmp_path / "table.csv"
    texts = [
        ",".join(f"c{i}" for i in range(200_000)) + "\n",
        ",".join(["c"] * 200_000) + "\n",
        "item,A,B\n1,1," + "x" * 200_000 + "\n",
        "item,A,B\n1," + "9" * 5000 + ",1\n",
        "item,A,B\n" + '"' * 100_001,
    ]
    for text in texts:
        table.write_text(text)
        with faults("a table of ratings with wide lines or long cells"):
            check_within_limits(measured("agree", table, "--target", "items"))


@pytest.mark.parametrize("text", ["$\\\\frac{1}$", "$^$", "\\\\input{x}", "<b>&"])
def test_titles_are_no_mathematics(text: str, study: Path, faults: Faults) -> None:
    edited(study, r'(?m)^title = ".*"$', f'title = "{text}"')
    with faults("a title that would be read as TeX"):
        ended = measured("report", study, "--quiet")
        assert ended.code == 0, ended
        check_within_limits(ended)


@pytest.mark.parametrize("encoding", ["cp1252", "cp949", "ascii", "latin-1"])
@pytest.mark.parametrize("backend", ["module://matplotlib_inline.backend_inline", "x"])
def test_any_encoding_and_backend(
    encoding: str, backend: str, study: Path, faults: Faults
) -> None:
    with faults("an encoding of streams or a backend of figures that is not ours"):
        ended = measured("report", study, PYTHONIOENCODING=encoding, MPLBACKEND=backend)
        assert ended.code == 0, ended


def test_a_recording_is_not_too_large_by_itself(study: Path) -> None:
    # what limits there are let a whole session through
    for file in study.glob("sessions/*/*.npz"):
        assert np.load(file)["time_s"].size > 1000
    assert measured("verify", study).code == 0
