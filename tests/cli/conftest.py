"""The command line, for tests to call."""

import pytest

from tests.cli.process import Caller


@pytest.fixture
def masrel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Caller:
    """The command line in this process: verb and arguments to how the call ended."""
    return Caller(monkeypatch, capsys)
