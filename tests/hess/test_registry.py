import subprocess
import sys

import pytest

from masrel.errors import DeviceError
from masrel.hess import SimulatedClock, SimulatedHand, device_names, open_device


def test_an_unknown_name_is_answered_with_those_there_are() -> None:
    with pytest.raises(DeviceError, match="needs one of simulated, got 'wam'"):
        open_device("wam", clock=SimulatedClock())


def test_a_simulated_arm_needs_a_hand() -> None:
    with pytest.raises(DeviceError, match="simulated: needs a hand"):
        open_device("simulated", clock=SimulatedClock())


def test_every_name_opens() -> None:
    for name in device_names():
        hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
        with open_device(name, clock=SimulatedClock(), hand=hand) as device:
            assert device.is_open
            assert device.name == name


def test_a_backend_is_imported_when_it_is_chosen() -> None:
    code = "import sys, masrel.hess; print('masrel.hess.simulated' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
