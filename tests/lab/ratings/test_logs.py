"""Ratings from logs: corrected, checked against recordings, missing where missing."""

import stat
from collections.abc import Callable

import pytest

from masrel.errors import RatingsError, SessionLogError
from masrel.lab._event_log import SessionLog
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import rating_matrix, ratings_from_logs, write_ratings
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from tests.lab.run.conftest import new_study, small
from tests.lab.script import ScriptGrades

__all__ = ["new_study", "small"]  # fixtures of the same small study

Small = tuple[StudyPaths, Protocol]


def graded(
    study: Small, *grades: str, rater: str = "R1", session: str = "test"
) -> None:
    run_session(*study, rater, session, grades=ScriptGrades(grades), clock="simulated")


def test_a_session_that_has_begun_has_a_row_for_every_model(small: Small) -> None:
    with pytest.raises(ValueError, match="position 2"):
        graded(small, "1+")
    ratings = ratings_from_logs(*small)
    assert ratings.table["grade"].tolist() == ["1+", None, None]
    assert ratings.table["mean_speed_deg_s"].isna().tolist() == [False, False, True]
    assert rating_matrix(ratings, session="test").n_missing == 2


def test_a_table_with_codes_is_its_owners_alone(small: Small) -> None:
    graded(small, "1", "1+", "2")
    ratings, file = ratings_from_logs(*small), small[0].ratings_file
    write_ratings(ratings, file)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert {row.graded_at for row in ratings.rows} == {None}  # of simulated grades


def test_the_speed_is_that_of_the_presentation_before_the_grade(
    small: Small,
) -> None:
    study = small[0]
    with pytest.raises(ValueError, match="position 1"):
        graded(small)
    path = study.log_file("R1", "test")
    with SessionLog.open(path) as log:
        # an event of format 1, when every presentation was one stretch
        later = "facts_sha256 stretches ended n_stretches felt r1_deg r2_deg grip_lost"
        presented = dict(log.events[-1].fields)
        for name in later.split():
            del presented[name]
        presented |= {"attempt": 2, "mean_speed_deg_s": 12.5}
        log.append("presented", presented)
        code = presented["code"]
        log.append("grade", {"code": code, "position": 1, "grade": "1"})
    first = ratings_from_logs(*small).table.iloc[0]
    assert (first["grade"], first["mean_speed_deg_s"]) == ("1", 12.5)
    assert (first["n_stretches"], first["speeds_deg_s"]) == (1, (12.5,))
    assert first["felt"] is None
    assert first["n_attempts"] == 2


def test_repeats_of_a_model_are_kept_apart(new_study: Callable[..., Small]) -> None:
    study = new_study(("seed = 11", "seed = 11\nrepeats = 2"))
    graded(study, "0", "1", "1+", "2", "3", "4")
    ratings = ratings_from_logs(*study)
    matrix = rating_matrix(ratings, session="test", models=["HM1"])
    assert matrix.items == ("HM1", "HM1#2")
    assert sorted(ratings.table["grade"]) == ["0", "1", "1+", "2", "3", "4"]


def test_a_changed_recording_is_named_with_its_line(small: Small) -> None:
    graded(small, "1", "1", "1")
    code = read_schedule(small[0].schedule_file("R1", "test")).presentations[1].code
    file = small[0].log_file("R1", "test").with_suffix("") / f"{code}.npz"
    file.write_bytes(file.read_bytes()[:-1] + b"x")
    with pytest.raises(RatingsError, match=rf"line 4: .*{code}\.npz is not the record"):
        ratings_from_logs(*small)
    file.unlink()
    assert len(ratings_from_logs(*small).table) == 3


def test_a_changed_log_is_refused(small: Small) -> None:
    graded(small, "1", "1", "1")
    log = small[0].log_file("R1", "test")
    log.write_bytes(log.read_bytes().replace(b'"grade": "1"', b'"grade": "2"', 1))
    with pytest.raises(SessionLogError, match="line 4: needed previous"):
        ratings_from_logs(*small)


def test_a_log_belongs_to_its_rater_and_schedule(small: Small) -> None:
    study = small[0]
    graded(small, "1", "1", "1")
    log = study.log_file("R1", "test")
    study.log_file("R2", "test").write_bytes(log.read_bytes())
    with pytest.raises(RatingsError, match="is the log of rater R1 in session test"):
        ratings_from_logs(*small)
    study.log_file("R2", "test").unlink()
    path = study.schedule_file("R1", "test")
    path.write_bytes(path.read_bytes().replace(b"seed: 11", b"seed: 12"))
    with pytest.raises(RatingsError, match="recorded with another schedule"):
        ratings_from_logs(*small)
