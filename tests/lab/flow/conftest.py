"""A small complete study, run once through the command line for all flow tests."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from tests.cli.process import Caller


def run(*arguments: str, code: int = 0) -> str:
    """Run the command line in this process; its output, when it ends with `code`."""
    result = CliRunner().invoke(cli, list(arguments), catch_exceptions=True)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture
def masrel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Caller:
    """The command line in this process, with the sentences it ends with."""
    return Caller(monkeypatch, capsys)


@pytest.fixture(scope="session")
def small_demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that ``masrel demo --study small`` left."""
    out = tmp_path_factory.mktemp("demo") / "out"
    run("demo", str(out), "--study", "small", "--quiet")
    return out
