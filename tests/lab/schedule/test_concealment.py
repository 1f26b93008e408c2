"""Who has a sheet, the protocol and this program learns nothing of an order."""

import hashlib
import hmac
import itertools
import os
import stat
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from masrel.errors import ScheduleError
from masrel.lab.protocol import StudyPaths
from masrel.lab.schedule.presentation import Schedule, draw_schedule, read_schedule
from masrel.lab.schedule.sheets import (
    concealment_notes,
    schedule_problems,
    write_schedules,
)
from tests.lab.schedule.studies import (
    SECRET,
    protocol_of,
    with_secret,
    words_from,
    words_of,
)

MODELS = ("HM1", "HM2", "HM3", "HM4", "D01", "D02", "D03", "D04")
LETTERS = "ABCDFGHJKMNPTUVWXY"
POSIX = pytest.mark.skipif(os.name != "posix", reason="needs permissions of POSIX")


def codes(schedule: Schedule) -> list[str]:
    return [shown.code for shown in schedule.presentations]


def order(schedule: Schedule) -> list[str]:
    return [shown.model for shown in schedule.presentations]


def sheet_codes(study: StudyPaths, rater: str) -> list[str]:
    """What a rater holds in the hand."""
    rows = study.sheet_file(rater, "test").read_text(encoding="utf-8").splitlines()
    return [row.split(",")[1] for row in rows[1:]]


def shuffled(words: Iterator[int]) -> list[str]:
    """The order that a stream makes, from the documented rule."""
    models = list(MODELS)
    for i in range(len(models) - 1, 0, -1):
        j = next(words) % (i + 1)
        models[i], models[j] = models[j], models[i]
    return models


def coded(words: Iterator[int]) -> Iterator[str]:
    for word in words:
        yield f"{word % 1800 // 18:02d}{LETTERS[word % 1800 % 18]}"


def attack(sheet: list[str], rater: str, seeds: range) -> list[str] | None:
    """The order behind a sheet, by trying seeds; None when no seed gives the codes."""
    for seed in seeds:
        tried = coded(words_of(f'["masrel",{seed},"codes","test","{rater}"]'))
        if all(code == next(tried) for code in sheet):
            return shuffled(words_of(f'["masrel",{seed},"schedule","test","{rater}"]'))
    return None


def test_the_attack_recovers_the_order_of_a_draw_from_the_seed_alone() -> None:
    drawn = draw_schedule(protocol_of(models=MODELS, seed=20240), "R1", "test")
    assert attack(codes(drawn), "R1", range(30_000)) == order(drawn)


def test_the_attack_recovers_nothing_of_a_draw_from_a_secret(tmp_path: Path) -> None:
    # The seed is among those that are tried: it stands in the protocol.
    study, protocol = StudyPaths(tmp_path), protocol_of(models=MODELS, seed=20240)
    write_schedules(protocol, study)
    sheet = sheet_codes(study, "R1")
    assert attack(sheet, "R1", range(30_000)) is None


def test_codes_say_nothing_about_the_order_over_secrets() -> None:
    # Over 1800 secrets the order of 3 models and the rank order of their codes are a
    # table of 6 by 6 with 50 expected in each cell: chi-square with 35 degrees of
    # freedom is above 85.6 with probability 5e-6. Secrets are fixed.
    protocol, counts = protocol_of(models=("A", "B", "C")), Counter()
    for number in range(1800):
        secret = hashlib.sha256(str(number).encode()).digest()[:16]
        drawn = draw_schedule(protocol, "R1", "test", secret=secret)
        ranks = tuple(sorted(range(3), key=codes(drawn).__getitem__))
        counts[tuple(order(drawn)), ranks] += 1
    expected = 1800 / 36
    chi_square = sum(
        (counts[cell] - expected) ** 2 / expected
        for cell in itertools.product(
            itertools.permutations("ABC"), itertools.permutations(range(3))
        )
    )
    assert chi_square < 85.6


# The test vector of docs/reference/protocol.md, from HMAC-SHA256 and PCG64 in Python
# integers.
VECTOR_ORDER = "HM3 HM1 D04 D02 HM2 D03 D01 HM4"
VECTOR_CODES = "75M 36H 28M 66B 85Y 36U 94K 46A"
VECTOR_COMMITMENT = "8d4a74f771e01cd6b33c693f781aad74a7ee13ea8497dcd88dc68c30d35ceed6"


def test_the_draw_from_a_published_secret_is_what_the_rule_gives_by_hand() -> None:
    drawn = draw_schedule(
        protocol_of(models=MODELS, seed=2012), "R1", "test", secret=SECRET
    )

    def words(purpose: str) -> Iterator[int]:
        name = f'["masrel",2012,"{purpose}","test","R1"]'
        return words_from(hmac.new(SECRET, name.encode(), "sha256").hexdigest())

    assert shuffled(words("schedule")) == order(drawn) == VECTOR_ORDER.split()
    by_hand = list(itertools.islice(coded(words("codes")), len(MODELS)))
    assert by_hand == codes(drawn) == VECTOR_CODES.split()
    name = f'["masrel","commitment","{SECRET.hex()}"]'
    commitment = hashlib.sha256(name.encode()).hexdigest()
    assert drawn.commitment == commitment == VECTOR_COMMITMENT


def test_the_secret_is_drawn_once_and_is_in_no_other_file(tmp_path: Path) -> None:
    study = StudyPaths(tmp_path)
    write_schedules(protocol_of(raters=("R1",)), study)
    kept = study.secret_file.read_bytes()
    write_schedules(protocol_of(), study)
    assert study.secret_file.read_bytes() == kept
    secret = kept.split()[-1]
    assert len(secret) == 32
    others = {f for f in tmp_path.rglob("*") if f.is_file()} - {study.secret_file}
    assert len(others) == 5
    assert not [file for file in others if secret in file.read_bytes()]


@POSIX
def test_what_names_models_is_its_owners_alone(tmp_path: Path) -> None:
    study = StudyPaths(tmp_path)
    write_schedules(protocol_of(), study)
    modes = {
        path: stat.S_IMODE(path.stat().st_mode)
        for path in (study.secret_file.parent, study.secret_file, study.schedules)
    }
    assert list(modes.values()) == [0o700, 0o600, 0o700]
    assert concealment_notes(protocol_of(), study) == ()
    study.schedules.chmod(0o755)
    (note,) = concealment_notes(protocol_of(), study)
    assert "other users of this computer can read" in note


def test_a_published_secret_conceals_nothing_and_draws_the_same(
    tmp_path: Path,
) -> None:
    study, protocol = StudyPaths(tmp_path), protocol_of()
    write_schedules(protocol, study)
    study.published_secret_file.write_bytes(study.secret_file.read_bytes())
    (note,) = concealment_notes(protocol, study)
    assert "concealed no longer" in note
    assert schedule_problems(protocol, study) == ()


def test_another_order_than_the_secret_draws_is_a_problem(tmp_path: Path) -> None:
    study, protocol = with_secret(StudyPaths(tmp_path)), protocol_of()
    write_schedules(protocol, study)
    file = study.schedule_file("R1", "test")
    lines = file.read_text(encoding="utf-8").splitlines()
    (first, code_a, *shown_a), (second, code_b, *shown_b) = (
        line.split(",") for line in lines[-2:]
    )
    lines[-2:] = [
        ",".join([first, code_a, *shown_b]),
        ",".join([second, code_b, *shown_a]),
    ]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    (problem,) = schedule_problems(protocol, study)
    assert "needed the order and codes that the study's secret draws" in problem


def test_a_lost_secret_loses_only_the_second_draw(tmp_path: Path) -> None:
    study, protocol = StudyPaths(tmp_path), protocol_of(raters=("R1",))
    write_schedules(protocol, study)
    before = read_schedule(study.schedule_file("R1", "test"))
    study.secret_file.unlink()
    write_schedules(protocol_of(), study)
    assert read_schedule(study.schedule_file("R1", "test")) == before
    assert schedule_problems(protocol_of(), study) == ()
    (note,) = concealment_notes(protocol_of(), study)
    assert "1 of 2 schedules were drawn from a secret that is not in the study" in note


@pytest.mark.parametrize("text", ["", "format: 2\nsecret: 00\n", "secret: " + "0" * 32])
def test_a_damaged_secret_is_refused_before_anything_is_drawn(
    tmp_path: Path, text: str
) -> None:
    study = StudyPaths(tmp_path)
    study.published_secret_file.write_text(text, encoding="utf-8")
    with pytest.raises(ScheduleError, match="needed a line 'format: 1'"):
        write_schedules(protocol_of(), study)
    assert not study.schedules.exists()
    (problem,) = schedule_problems(protocol_of(), study)
    assert "published_secret.txt: needed a line" in problem


def test_two_secrets_in_one_study_are_refused(tmp_path: Path) -> None:
    study = StudyPaths(tmp_path)
    write_schedules(protocol_of(), study)
    with_secret(study)
    with pytest.raises(ScheduleError, match=r"needed the secret of .*secret.txt"):
        write_schedules(protocol_of(raters=("R1", "R2", "R3")), study)
    study.published_secret_file.replace(study.secret_file)
    with pytest.raises(ScheduleError, match=r"secret of test_R1.csv, whose commitment"):
        write_schedules(protocol_of(raters=("R1", "R2", "R3")), study)
