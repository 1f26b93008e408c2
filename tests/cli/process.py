"""Call the command line as a user does, in this process."""

import sys
from dataclasses import dataclass

import pytest

from masrel.cli import main


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """How a call ended and what it printed."""

    code: object
    out: str
    err: str


class Caller:
    """Calls ``masrel`` with arguments."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        self._monkeypatch, self._capsys = monkeypatch, capsys

    def __call__(self, *arguments: object) -> Done:
        self._monkeypatch.setattr(sys, "argv", ["masrel", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = self._capsys.readouterr()
        return Done(code=ended.value.code, out=out, err=err)

    def at_a_terminal(self, *arguments: object) -> Done:
        """Call it with an stderr that says it is a terminal."""
        self._monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
        return self(*arguments)
