"""The next cue is shown when a stretch is over, and felt or not is decided."""

import io
import time

import numpy as np
import pytest

from masrel.lab.hess import PresentationStatus
from masrel.lab.protocol import PresentationRules, Protocol, StudyPaths
from masrel.lab.recording import RECORDING_COLUMNS, Recording
from masrel.lab.run._present import StatusOfHand, stretch_facts
from masrel.lab.run.console import _cues_shown
from tests.lab.run.conftest import new_study, small

__all__ = ["new_study", "small"]  # fixtures of the same small study


class Keys(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_next_cue_is_shown_when_a_stretch_is_over(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rules = PresentationRules(stretches=("slow", "fast"), slow_speed_deg_s=8.0)
    status = PresentationStatus()
    shown = ""
    with _cues_shown(rules, status, Keys()):
        time.sleep(0.15)
        assert capsys.readouterr().out == ""  # the first was shown before
        status.n_stretches = 1
        until = time.monotonic() + 30.0
        while not shown and time.monotonic() < until:
            time.sleep(0.01)
            shown += capsys.readouterr().out
    assert shown == "Stretch 2: fast, at least 120 deg/s (V3)\n"


def test_a_hand_is_done_when_it_has_made_its_stretches() -> None:
    status = StatusOfHand(2)
    status.n_stretches = 1
    assert not status.is_done
    status.n_stretches = 2
    assert status.is_done


def test_a_hand_that_holds_is_done_when_it_brings_the_arm_back_at_last() -> None:
    status = StatusOfHand(2, holds=True)
    for n_over in (1, 2):
        status.is_armed = True
        status.is_armed = False
        status.n_stretches = n_over
        assert not status.is_done
    status.is_armed = True
    assert status.is_done


def recording(speed_deg_s: float, phase: float = 0.0) -> Recording:
    # the arm goes from 30 deg for 0.2 s at a speed, and stops
    n = 400
    columns = {name: np.zeros(n) for name in RECORDING_COLUMNS}
    time_s = np.arange(n) * 1e-3
    moved = np.minimum(time_s, 0.2)
    columns["time_s"] = time_s
    columns["angle_deg"] = 30.0 + speed_deg_s * moved
    columns["velocity_deg_s"] = np.where(time_s < 0.2, speed_deg_s, 0.0)
    columns["stretch"] = np.ones(n)
    columns["phase"][300:] = phase
    return Recording(columns=columns, facts={})


@pytest.mark.parametrize(
    ("speed_deg_s", "phase", "felt"),
    [
        (15.0, 0.0, "below-threshold"),
        (80.0, 0.0, "no-catch"),  # it stopped before the catch of HM1
        (80.0, 1.0, "felt"),
    ],
)
def test_what_was_felt_follows_from_speed_and_catch(
    small: tuple[StudyPaths, Protocol], speed_deg_s: float, phase: float, felt: str
) -> None:
    facts = stretch_facts(small[1], "HM1", recording(speed_deg_s, phase))
    assert facts.felt == felt
    assert len(facts.stretches) == 1


def test_a_model_without_a_catch_has_none_to_miss(new_study) -> None:
    constants = """catch_angle_constant_deg = 118.0
catch_torque_nms_rad = 2.1
residual_ratio = 0.40
catch_travel_deg = 40.0
"""
    stiff = 'kind = "lead-pipe-rigidity"\n'
    _, protocol = new_study((constants, stiff))
    assert stretch_facts(protocol, "D1", recording(80.0)).felt == "felt"
    assert stretch_facts(protocol, "D1", recording(15.0)).felt == "below-threshold"
