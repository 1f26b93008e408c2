"""Random damage to any file of a study: a sentence, or nothing that matters changed."""

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.ratings import ratings_csv, ratings_from_logs
from tests.cli.process import Caller
from tests.faults import Faults
from tests.lab.flow.conftest import run

Mutation = Callable[[bytes, random.Random], bytes]


def a_byte(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + bytes([rng.randrange(256)]) + data[place + 1 :]


def a_part_gone(data: bytes, rng: random.Random) -> bytes:
    first, last = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:first] + data[last:]


def cut_off(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def a_line_gone(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    lines.pop(rng.randrange(len(lines)))
    return b"".join(lines)


def a_line_twice(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    lines.insert(rng.randrange(len(lines)), rng.choice(lines))
    return b"".join(lines)


def lines_that_change_places(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return b"".join(lines)


def another_word(data: bytes, rng: random.Random) -> bytes:
    words = [b"null", b"-1", b"1e400", b"9" * 5000, b"true", b'""', b"[" * 5000, b"NA"]
    place = rng.randrange(len(data))
    start, end = data.rfind(b" ", 0, place) + 1, data.find(b" ", place)
    return data[:start] + rng.choice(words) + data[end if end > 0 else len(data) :]


def odd_bytes(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data) + 1)
    odd = [b"\0", b"\xff\xfe", "\u202e".encode(), b"\xef\xbb\xbf", b"\r", b'"', b"$^$"]
    return data[:place] + rng.choice(odd) + data[place:]


def blanks(data: bytes, rng: random.Random) -> bytes:
    place = rng.choice([0, len(data), data.find(b"\n") + 1])
    return data[:place] + rng.choice([b"\n", b" ", b"\t", b"# x\n"]) + data[place:]


MUTATIONS: list[Mutation] = [
    a_byte,
    a_part_gone,
    cut_off,
    a_line_gone,
    a_line_twice,
    lines_that_change_places,
    another_word,
    odd_bytes,
    blanks,
]


@pytest.fixture(scope="module")
def reported(small_demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small study with everything a study can have."""
    root = tmp_path_factory.mktemp("mutants") / "study"
    shutil.copytree(small_demo / "study", root)
    run("report", str(root), "--quiet")
    return root


def meaning(root: Path) -> tuple[str, object]:
    """The ratings of a study, and its analysis."""
    study = StudyPaths(root)
    ratings = ratings_csv(ratings_from_logs(study, read_protocol(study.protocol)))
    return ratings, json.loads(study.analysis_file.read_bytes())


def mutant(root: Path, files: list[Path], rng: random.Random) -> tuple[str, bytes]:
    """Damage one file, and return which, and what it held."""
    # As many of each kind of file as of any other, however many a study has
    kind = rng.choice(sorted({(f.parent.name, f.suffix) for f in files}))
    file = rng.choice([f for f in files if (f.parent.name, f.suffix) == kind])
    before = file.read_bytes()
    after = before
    while after == before:
        after = rng.choice(MUTATIONS)(before, rng)
    file.write_bytes(after)
    return str(file.relative_to(root)), before


@pytest.mark.parametrize(
    "seeds",
    [
        pytest.param(range(100), marks=pytest.mark.slow),
        pytest.param(range(100, 1100), marks=[pytest.mark.long, pytest.mark.faults]),
    ],
)
def test_a_damaged_study_is_refused_or_means_the_same(
    reported: Path, masrel: Caller, seeds: range, faults: Faults
) -> None:
    files = sorted(path for path in reported.rglob("*") if path.is_file())
    needed = meaning(reported)
    n_accepted = 0
    for seed in seeds:
        name, before = mutant(reported, files, random.Random(seed))
        with faults("a file of a study damaged at random"):
            verified = masrel("verify", reported)
            for done in (verified, masrel("check", reported)):
                assert done.code in (0, 2), (seed, name)
                assert "Traceback" not in done.err
                assert (done.code == 0) == (done.err == "" or "masrel:" not in done.err)
            if verified.code == 0:
                n_accepted += 1
                assert meaning(reported) == needed, (seed, name)
        (reported / name).write_bytes(before)
    assert n_accepted < len(seeds) / 2
    assert masrel("verify", reported).code == 0
