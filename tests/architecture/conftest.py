"""The command line, for tests to call."""

from tests.cli.conftest import masrel

__all__ = ["masrel"]
