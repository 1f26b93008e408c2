"""Warnings of masrel become notes, each once; all others stay warnings."""

import warnings

import pytest

from masrel.errors import SmallSampleWarning
from masrel.lab.cli._study_options import warnings_as_notes


def test_a_note_is_said_once_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    with warnings_as_notes():
        for _ in range(2):
            warnings.warn("few raters", SmallSampleWarning, stacklevel=1)
    assert capsys.readouterr() == ("", "note: few raters\n")


def test_notes_are_said_even_when_an_error_ends_the_work(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def work() -> None:
        with warnings_as_notes():
            warnings.warn("few raters", SmallSampleWarning, stacklevel=1)
            raise ValueError

    with pytest.raises(ValueError, match=r"^$"):
        work()
    assert capsys.readouterr().err == "note: few raters\n"


def test_a_foreign_warning_stays_a_warning(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.warns(DeprecationWarning, match="old"), warnings_as_notes():
        warnings.warn("old", DeprecationWarning, stacklevel=1)
    assert capsys.readouterr().err == ""
