"""Random damage to any file of a study: a sentence, or nothing that matters changed."""

import json
import random
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.ratings import ratings_csv, ratings_from_logs
from tests.cli.process import Caller
from tests.faults import Faults

Mutation = Callable[[bytes, random.Random], bytes]


def a_byte(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + bytes([rng.randrange(256)]) + data[place + 1 :]


def a_part_gone(data: bytes, rng: random.Random) -> bytes:
    first, last = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:first] + data[rng.choice([last, len(data)]) :]  # or all to the end


def of_lines(data: bytes, rng: random.Random) -> bytes:
    # one gone, one twice, or two that change places
    lines = data.splitlines(keepends=True)
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    one, other = lines[i], lines[j]
    lines[i], lines[j] = rng.choice([(b"", other), (one + one, other), (other, one)])
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
    *[of_lines] * 3,
    another_word,
    odd_bytes,
    blanks,
]


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
        pytest.param(range(40), marks=pytest.mark.slow),
        pytest.param(range(40, 1100), marks=[pytest.mark.long, pytest.mark.faults]),
    ],
)
def test_a_damaged_study_is_refused_or_means_the_same(
    study: StudyPaths, masrel: Caller, seeds: range, faults: Faults
) -> None:
    reported = study.root
    files = sorted(path for path in reported.rglob("*") if path.is_file())
    needed = meaning(reported)
    n_accepted = 0
    for seed in seeds:
        name, before = mutant(reported, files, random.Random(seed))
        with faults("a file of a study damaged at random"):
            verified = masrel("verify", reported)
            for done in (verified, masrel("check", reported)):
                assert done.code in ((0, 1, 2) if done is verified else (0, 2)), (
                    seed,
                    name,
                )
                assert "Traceback" not in done.err
                assert (done.code == 0) == (done.err == "" or "masrel:" not in done.err)
            if verified.code == 0:
                n_accepted += 1
                assert meaning(reported) == needed, (seed, name)
        (reported / name).write_bytes(before)
    assert n_accepted < len(seeds) / 2
    assert masrel("verify", reported).code == 0
