"""A device of the page on hardware, installed as a distribution of its own."""

import importlib
import re
import socket
import struct
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from masrel.lab.hess import (
    DeviceSetup,
    SimulatedClock,
    build_device,
    device_names,
    open_device,
    run_presentation,
)
from masrel.lab.hess.testing import CONTRACT, DeviceUnderTest
from tests.lab.hess.rig import LIMITS, START, ActingClock, controls

from .test_registry import declared

PAGE = Path(__file__).parents[3] / "docs/howto/laboratory/devices_in_python.md"
MODULE = re.findall(r'```python\n(""".*?)```', PAGE.read_text("utf-8"), re.DOTALL)[-1]


def amplify(server: socket.socket) -> None:
    """Be the amplifier, with an arm at rest, until a datagram says "end"."""
    drives = False
    while (asked := server.recvfrom(64))[0] != b"end":
        message, sender = asked
        if message[:1] == b"?":
            (number,) = struct.unpack("<q", message[1:])
            for answered in (number - 1, number):  # the last one comes again
                server.sendto(struct.pack("<qd?", answered, START, drives), sender)
        elif message in (b"drive", b"idle"):
            drives = message == b"drive"


@pytest.fixture
def port() -> Iterator[int]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        thread = threading.Thread(target=amplify, args=(server,))
        thread.start()
        yield server.getsockname()[1]
        server.sendto(b"end", server.getsockname())
        thread.join()


@pytest.fixture
def under_test(
    port: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> DeviceUnderTest:
    (tmp_path / "udp_arm.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    declared(tmp_path, "udp-arm", **{"udp-arm": "udp_arm"})

    def setup() -> DeviceSetup:
        from udp_arm import ArmOptions

        # nobody's machine is so busy that the emulator does not answer
        options = ArmOptions(port=port, patience_s=30.0)
        return DeviceSetup(clock=SimulatedClock(), options=options)

    return DeviceUnderTest(
        build=partial(build_device, "udp-arm"), setup=setup, controller=controls
    )


def test_the_device_of_the_page_is_complete_in_60_lines() -> None:
    assert len([line for line in MODULE.splitlines() if line.strip()]) <= 60


@pytest.mark.parametrize("rule", CONTRACT)
def test_it_holds_the_contract(rule: str, under_test: DeviceUnderTest) -> None:
    assert "udp-arm" in device_names()
    CONTRACT[rule](under_test)


def test_one_that_is_idled_from_elsewhere_stops_a_presentation(
    under_test: DeviceUnderTest, port: int
) -> None:
    options = under_test.setup().options
    idle = importlib.import_module("udp_arm").prepare(str(port))
    clock = ActingClock({0.12: lambda _: idle()})
    with open_device("udp-arm", clock=clock, options=options) as device:
        fault = run_presentation(device, controls(), clock=clock, limits=LIMITS).fault
    assert "does not drive any more" in fault.message
    assert fault.time_s == pytest.approx(0.15, abs=0.002)
