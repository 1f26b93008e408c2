"""A model's variant of the law is what is commanded, and the recording shows it."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.recording import PHASES, Recording, read_recording
from masrel.lab.run import ScriptGrades, run_session
from masrel.lab.schedule import read_schedule

NewStudy = Callable[..., tuple[StudyPaths, Protocol]]

B, K, K_POST = 1.26, 3.15, 5.8  # N·m·s/rad, N·m/rad: the constants of [elbow]
H, Q = 2.8, 0.60  # of HM3, below with variants of its own
REST_DEG, RISE_S = 20.0, 0.04

VARIANT = f"""catch_travel_deg = 30.0
[models.constants]
rest_angle_deg = {REST_DEG}
post_catch = "additive"
residual_reading = "decrease"
catch_rise_s = {RISE_S}
"""


def recorded(study: StudyPaths, protocol: Protocol, model: str) -> Recording:
    """Run the session on the simulated device; the recording of one model."""
    grades = ScriptGrades(["1", "2", "1+"])
    run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")
    shown = read_schedule(study.schedule_file("R1", "test")).presentations
    (code,) = (one.code for one in shown if one.model == model)
    return read_recording(study.recording_file("R1", "test", code))


@pytest.fixture
def columns(new_study: NewStudy) -> dict[str, NDArray[np.float64]]:
    """Columns of the model with variants, up to the first sample that slows down."""
    study, protocol = new_study(("catch_travel_deg = 30.0\n", VARIANT))
    columns = recorded(study, protocol, "HM3").columns
    phase = columns["phase"]
    end = int((phase == PHASES.index("post-catch")).nonzero()[0][-1]) + 1
    made = {name: column[:end] for name, column in columns.items()}
    made["angle"] = np.radians(made["angle_deg"])
    made["velocity"] = np.radians(made["velocity_deg_s"])
    return made


def of_phase(columns: dict[str, NDArray[np.float64]], name: str) -> NDArray[np.bool_]:
    return columns["phase"] == PHASES.index(name)


def pre_catch(columns: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """(1) with the model's own rest angle, of every sample."""
    return B * columns["velocity"] + K * (columns["angle"] - math.radians(REST_DEG))


def test_the_spring_of_pre_catch_rests_where_the_model_says(columns) -> None:
    before = of_phase(columns, "pre-catch")
    torque = columns["model_torque_nm"][before]
    assert before.sum() > 100
    assert torque == pytest.approx(pre_catch(columns)[before], abs=1e-9)
    # 3.15 N·m/rad over the 10 deg from rest to start, where a default model has none
    assert torque[0] == pytest.approx(math.radians(3.15 * 10.0), abs=1e-3)


def test_the_catch_rises_smoothly_and_leaves_one_less_q_of_the_peak(columns) -> None:
    during = of_phase(columns, "catch").nonzero()[0]
    first = during[0]
    base = pre_catch(columns)[first]
    rise = H * columns["velocity"][first]
    since = columns["time_s"][during] - columns["time_s"][first]
    torque = columns["model_torque_nm"][during]
    x = since / RISE_S
    smooth = base + rise * (3 * x**2 - 2 * x**3)
    rising, later = since < RISE_S, since > 0.1
    assert rising.sum() >= 39
    assert torque[rising] == pytest.approx(smooth[rising], abs=1e-9)
    peak = ~rising & (since < 0.0995)
    assert torque[peak] == pytest.approx(base + rise, abs=1e-9)
    assert later.sum() > 50
    # section III.C: Q of the rise is lost, 1 - Q of it stays
    assert torque[later] == pytest.approx(base + (1 - Q) * rise, abs=1e-9)


def test_post_catch_adds_to_pre_catch(columns) -> None:
    catch = of_phase(columns, "catch").nonzero()[0][0]
    after = of_phase(columns, "post-catch").nonzero()[0]
    residual = (1 - Q) * H * columns["velocity"][catch]
    angle = columns["angle"][after]
    expected = pre_catch(columns)[after] + residual + K_POST * (angle - angle[0])
    assert after.size > 50
    assert columns["model_torque_nm"][after] == pytest.approx(expected, abs=1e-9)


def test_models_beside_it_keep_the_law_of_the_study(new_study: NewStudy) -> None:
    plain = recorded(*new_study(name="plain"), "D1")
    beside = recorded(
        *new_study(("catch_travel_deg = 30.0\n", VARIANT), name="beside"), "D1"
    )
    assert plain.columns["model_torque_nm"].tolist() == (
        beside.columns["model_torque_nm"].tolist()
    )


def test_a_law_of_the_study_is_that_of_every_model(new_study: NewStudy) -> None:
    shared = '\n[elbow]\nresidual_reading = "decrease"\nrest_angle_deg = 20.0\n'
    study, protocol = new_study(('title = "Three models"\n', 'title = "T"\n' + shared))
    columns = recorded(study, protocol, "D1").columns  # D1: H 2.1, Q 0.40
    during = (columns["phase"] == PHASES.index("catch")).nonzero()[0]
    first, last = during[0], during[-1]
    speed = math.radians(columns["velocity_deg_s"][first])
    base = B * speed + K * math.radians(columns["angle_deg"][first] - 20.0)
    assert columns["model_torque_nm"][last] == pytest.approx(
        base + 0.6 * 2.1 * speed, abs=1e-9
    )
