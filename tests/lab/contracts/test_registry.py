"""Devices that other distributions declare as entry points."""

import sys
from pathlib import Path

import pytest

from masrel.errors import DeviceError
from masrel.lab.hess import SimulatedClock, device_names, open_device

MODULE = """
from masrel.lab.hess import Device, Reading


class Still(Device):
    name = "still"
    simulated = True

    def __init__(self, clock):
        self.clock = clock

    def _start(self): ...
    def _read(self):
        return Reading(self.clock.now_ns(), 0.5)
    def _send(self, torque_nm): ...
    def _stop(self): ...


def build(setup):
    return Still(setup.clock)
"""


def declared(folder: Path, distribution: str, **devices: str) -> None:
    """An installed distribution with these devices by name, each a module."""
    info = folder / f"{distribution}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Name: {distribution}\nVersion: 1.0\n")
    lines = [f"{name} = {module}" for name, module in devices.items()]
    (info / "entry_points.txt").write_text("\n".join(["[masrel.devices]", *lines]))


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "still_device.py").write_text(MODULE)
    (tmp_path / "broken_device.py").write_text("import no_such_vendor_library\n")
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_a_device_of_another_distribution_opens_by_name(installed: Path) -> None:
    declared(installed, "stills", still="still_device", broken="broken_device")
    assert {"still", "broken", "simulated"} <= {*device_names()}
    assert "still_device" not in sys.modules  # a list imports none
    clock = SimulatedClock()
    with open_device("still", clock=clock) as device:
        assert device.read().angle == 0.5
    with pytest.raises(DeviceError, match=r"'broken' of stills .*no_such_vendor_lib"):
        open_device("broken", clock=clock)


def test_a_name_is_of_one_distribution_and_none_takes_one_of_ours(
    installed: Path,
) -> None:
    for name in ("first", "second"):
        declared(installed, name, still="still_device", replay="still_device")
    clock = SimulatedClock()
    with pytest.raises(DeviceError, match=r"got first .*second"):
        open_device("still", clock=clock)
    with pytest.raises(DeviceError, match="replay: "):
        open_device("replay", clock=clock)
