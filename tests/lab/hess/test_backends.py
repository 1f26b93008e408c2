import subprocess
import sys

import pytest

from masrel.errors import DeviceError
from masrel.lab.hess import (
    BackendOptions,
    SimulatedClock,
    SimulatedHand,
    device_names,
    open_device,
)


def test_an_unknown_name_is_answered_with_those_there_are() -> None:
    with pytest.raises(DeviceError, match=r"needs one of .*simulated.*, got 'wam'"):
        open_device("wam", clock=SimulatedClock())


def test_a_simulated_arm_needs_a_hand() -> None:
    with pytest.raises(DeviceError, match="simulated: needs a hand"):
        open_device("simulated", clock=SimulatedClock())


def test_a_simulated_arm_takes_no_options_of_another_backend() -> None:
    class Foreign(BackendOptions):
        pass

    hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    with pytest.raises(DeviceError, match=r"simulated: needs options .* got Foreign"):
        open_device("simulated", clock=SimulatedClock(), hand=hand, options=Foreign())


@pytest.mark.parametrize("name", device_names())
def test_every_name_has_a_backend_that_says_what_it_needs(name: str) -> None:
    with pytest.raises(DeviceError, match=f"^{name}: needs (a hand|options)"):
        open_device(name, clock=SimulatedClock())


def test_a_backend_is_imported_when_it_is_chosen() -> None:
    code = "import sys, masrel.lab.hess; print('masrel.lab.hess.puck' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
