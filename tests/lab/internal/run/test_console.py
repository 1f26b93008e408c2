"""The next cue is shown when a stretch is over, and felt or not is decided."""

import io
import math
import time

import numpy as np
import pytest

from masrel.lab.hess import PresentationStatus
from masrel.lab.protocol import PresentationRules, Protocol, joint_model
from masrel.lab.recording import RECORDING_COLUMNS, Recording, stretches
from masrel.lab.run._present import StatusOfHand, _felt
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


def test_a_hand_that_holds_is_done_when_it_brings_the_arm_back_at_last() -> None:
    status = StatusOfHand(2, holds=True)
    for n_over in (1, 2):
        status.is_armed = True
        status.is_armed = False
        status.n_stretches = n_over
        assert not status.is_done
    status.is_armed = True
    assert status.is_done


def felt(protocol: Protocol, model: str, speed_deg_s: float, phase: float) -> str:
    # the arm goes from 30 deg for 0.2 s at a speed, and stops
    n = 400
    columns = {name: np.zeros(n) for name in RECORDING_COLUMNS}
    time_s = np.arange(n) * 1e-3
    columns["time_s"] = time_s
    columns["angle_deg"] = 30.0 + speed_deg_s * np.minimum(time_s, 0.2)
    columns["velocity_deg_s"] = np.where(time_s < 0.2, speed_deg_s, 0.0)
    columns["stretch"] = np.ones(n)
    columns["phase"][300:] = phase
    (made,) = stretches(Recording(columns=columns, facts={}))
    return _felt([made], joint_model(protocol, model), math.radians(30.0))


ELBOW = """catch_angle_constant_deg = 118.0
catch_torque_nms_rad = 2.1
residual_ratio = 0.40
catch_travel_deg = 40.0
"""


@pytest.mark.parametrize(
    ("model", "speed_deg_s", "phase", "what"),
    [
        ("HM1", 15.0, 0.0, "below-threshold"),
        ("HM1", 80.0, 0.0, "no-catch"),  # it stopped before the catch of HM1
        ("HM1", 80.0, 1.0, "felt"),
        ("D1", 80.0, 0.0, "felt"),  # without a catch there is none to miss
        ("D1", 15.0, 0.0, "below-threshold"),
    ],
)
def test_what_was_felt_follows_from_speed_and_catch(
    new_study, model: str, speed_deg_s: float, phase: float, what: str
) -> None:
    _, protocol = new_study((ELBOW, 'kind = "lead-pipe-rigidity"\n'))
    assert felt(protocol, model, speed_deg_s, phase) == what
