"""Settings of property tests and of signals, and what all tests may ask for."""

import gc
import signal
from collections.abc import Callable, Iterator

import pytest
from hypothesis import settings

from tests.cli.process import Caller
from tests.faults import Faults

# derandomize: a failure repeats; 30 examples a property; a slow machine is no failure.
settings.register_profile("masrel", derandomize=True, deadline=None, max_examples=30)
settings.load_profile("masrel")

# What a shell starts in the background ignores Ctrl-C, which tests send.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# A full garbage collection walks through all tests that were collected: .4 s each time.
gc.disable()  # until all are


def pytest_collection_finish() -> None:
    """Let the garbage collector leave out what has been made so far."""
    gc.freeze()
    gc.enable()


@pytest.fixture
def masrel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Caller:
    """The command line in this process: verb and arguments to how the call ended."""
    return Caller(monkeypatch, capsys)


@pytest.fixture
def faults(
    request: pytest.FixtureRequest, record_property: Callable[[str, object], None]
) -> Iterator[Faults]:
    """Counts of injected faults; whole ones go into docs/evidence/long_tests.md."""
    counts = Faults()
    yield counts
    if request.node.get_closest_marker("faults"):
        for row in counts.rows():
            record_property("faults", row)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Give each worker neighbours, so that what a module shares is made once."""
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log)
