"""What is loaded, seen by looking at the loaded modules of fresh interpreters."""

import json
import subprocess
import sys
from pathlib import Path

TABLE_V = Path(__file__).parents[2] / "studies/hess2012/ratings/published.csv"
HEAVY = {"pandas", "scipy", "statsmodels", "matplotlib", "emcee", "arviz_stats"}
PAGES = {"starlette", "uvicorn", "segno", "anyio", "jinja2"}

# Each code in a child of its own of one interpreter, which has loaded nothing but this.
SCRIPT = """
import contextlib, io, json, os, sys
for code in json.loads(sys.argv[1]):
    child = os.fork()
    if child == 0:
        with contextlib.redirect_stdout(io.StringIO()):
            try:
                exec(code, {})
            except SystemExit:
                pass
        print(json.dumps(sorted(sys.modules)), flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""


def loaded_after_each(*codes: str) -> list[set[str]]:
    """Names of the modules a fresh interpreter holds after each of these codes."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps(codes)],
        capture_output=True,
        text=True,
        check=True,
    )
    return [set(json.loads(line)) for line in done.stdout.splitlines()]


def loaded_after(code: str) -> set[str]:
    """Names of the modules a fresh interpreter holds after a code."""
    (loaded,) = loaded_after_each(code)
    return loaded


OF_GROUPS = ("joint", "record", "paper", "schedule", "status", "train")
# code, and what it loads none of
LOADS_NO: dict[str, set[str]] = {
    **{
        code: HEAVY | {"numpy"}
        for code in (
            "import masrel",
            "from masrel.cli import cli\ncli(['--help'])",
            "from masrel.cli import cli\ncli(['--version'])",
        )
    },
    # of the laboratory what comes before the ratings
    "import masrel.agreement, masrel.intervals, masrel.lab.elbow, masrel.lab.hess\n"
    "import masrel.lab.protocol, masrel.lab.schedule, masrel.lab.run.session": HEAVY,
    "import numpy, masrel.agreement as m\n"
    "for kappa in (m.fleiss_kappa, m.gwet_ac, m.cohen_kappa):\n"
    "    kappa(numpy.array([[1, 1], [1, 2], [2, 2]]), weights='quadratic')": (
        HEAVY | {"click", "msgspec", "masrel.intervals"}
    ),
    "from masrel.cli import cli\n"
    f"for group in {OF_GROUPS}:\n"
    "    cli([group, '--help'], standalone_mode=False)": HEAVY,
    "import masrel.lab.analysis, masrel.ratings": {"matplotlib", "emcee"},
    "import masrel, pandas as pd\n"
    "masrel.agree(pd.DataFrame({'item': [1, 2], 'K': [1, 2], 'L': [1, 1]}))": {
        *("matplotlib", "narwhals", "polars", "duckdb", "emcee"),
        *("masrel.intervals", "masrel.lab"),
    },
    f"from masrel.cli import cli\ncli(['agree', {str(TABLE_V)!r}])": {
        *("scipy", "emcee", "matplotlib", "statsmodels", "masrel.intervals"),
        *("masrel.lab.hess",),
    },
    # the pages load their server only when they are served
    "from masrel.lab.cli import serve\nserve.serve(['--help'])": PAGES | HEAVY,
    # beside the loop of a session nothing else runs
    "import masrel.lab.serve._session_process": PAGES,
    # a backend is imported when it is chosen
    "import masrel.lab.hess": {"masrel.lab.hess.puck"},
}


def test_nothing_is_loaded_that_is_not_needed() -> None:
    loaded = dict(zip(LOADS_NO, loaded_after_each(*LOADS_NO), strict=True))
    too_much = {code: loaded[code] & LOADS_NO[code] for code in LOADS_NO}
    assert {code: names for code, names in too_much.items() if names} == {}


def test_sub_packages_come_on_first_use() -> None:
    assert "numpy" in loaded_after("import masrel\nmasrel.lab.elbow.STANDARD_MODELS")
