"""The next cue is shown when a stretch is over, and felt or not is decided."""

import io
import time

import pytest

from masrel.lab.hess import PresentationStatus
from masrel.lab.protocol import PresentationRules
from masrel.lab.run._present import StatusOfHand
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
