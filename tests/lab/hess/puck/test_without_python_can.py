"""What needs python-can, and what does without."""

import subprocess
import sys

import pytest


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    "code",
    [
        "import masrel.lab.hess.puck",
        "import masrel.lab.hess.puck._bus",
        "from masrel.lab.hess.puck import fit_friction, steady_runs",
        "from masrel.lab.hess.puck import PuckOptions; PuckOptions()",
        "from masrel.cli import cli\ntry: cli(['device', '-h'])\nexcept SystemExit: 0",
    ],
)
def test_names_options_codec_and_help_load_no_python_can(code: str) -> None:
    done = run(f"{code}\nimport sys\nsys.exit('can' in sys.modules)")
    assert done.returncode == 0, done.stderr


def test_without_python_can_a_puck_says_what_to_install() -> None:
    code = (
        "import sys\n"
        "sys.modules['can'] = None\n"  # as if it were not there
        "sys.argv = ['masrel', 'device', 'probe']\n"
        "from masrel.cli import main\n"
        "main()"
    )
    done = run(code)
    assert done.returncode == 1
    assert done.stderr == (
        "masrel: puck: needs python-can; install it with: pip install 'masrel[can]'\n"
    )
