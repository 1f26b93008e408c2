"""A signal that comes while a model is presented is an emergency stop."""

import signal

import pytest

from masrel.errors import SessionStoppedError
from masrel.lab.hess import SimulatedClock
from masrel.lab.run import SimulatedGrades, read_log
from masrel.lab.run._presenter import CLOCKS
from tests.lab.run.test_session import Small, events, run


@pytest.mark.parametrize(
    ("number", "left"),
    [
        (signal.SIGINT, ["presented", "fault", "presented", "grade"]),
        (signal.SIGTERM, ["presented", "fault", "stopped"]),
    ],
)
def test_a_signal_is_an_emergency_stop(small: Small, number, left) -> None:
    # The signal comes while the first presentation runs, from its own clock.
    handlers = [signal.getsignal(number)]

    class Signalling(SimulatedClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            if deadline_ns == 300_000_000 and len(handlers) == 1:
                handlers.append(signal.getsignal(number))
                signal.raise_signal(number)
            super().sleep_until_ns(deadline_ns)

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(CLOCKS, "simulated", Signalling)
        if number == signal.SIGTERM:
            with pytest.raises(SessionStoppedError, match="stopped by signal SIGTERM"):
                run(small, SimulatedGrades(small[1]))
        else:
            run(small, SimulatedGrades(small[1]))
    assert events(small)[1 : 1 + len(left)] == left
    fault = read_log(small[0].log_file("R1", "test"))[2]
    assert fault.fields["kind"] == "emergency-stop"
    assert fault.fields["words"] == f"emergency stop: signal {number.name}"
    assert signal.getsignal(number) is handlers[0]  # as it was before
