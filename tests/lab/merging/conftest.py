"""The small study of the sessions' tests."""

from tests.lab.run.conftest import new_study, small

__all__ = ["new_study", "small"]
