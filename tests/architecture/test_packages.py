"""The six packages that masrel stands on: who imports each, and what comes of it."""

import ast
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

import masrel

ROOT = Path(masrel.__file__).parent
GRADES = [["1", "1", "1+"], ["1+", "2", "1+"], ["0", "0", "0"], ["3", "2", "3"]] * 3
IN_PYTHON = f"ratings = {GRADES}\nscale = ['0', '1', '1+', '2', '3']\n"
COMMAND = "import sys\nfrom masrel.cli import main\nsys.argv = 'masrel {}'.split()\n"

# package: the module that imports it, a question, and part of its answer
USES = {
    "numpy": (
        "agreement/_engine.py",
        IN_PYTHON
        + "from masrel.agreement import fleiss_kappa\n"
        + "print(round(fleiss_kappa(ratings, categories=scale).value, 4))",
        # P̄ = 1/2, p = (3, 2, 3, 2, 2)/12, P̄_e = 30/144: (72 - 30)/(144 - 30)
        "0.3684",
    ),
    "pandas": (
        "ratings/_exports.py",
        COMMAND.format("agree ratings.parquet") + "main()",
        "0.368",
    ),
    "scipy": (
        "agreement/_engine.py",
        IN_PYTHON
        + "from masrel.intervals import jackknife\n"
        + "print(jackknife('fleiss_kappa', ratings, target='raters',\n"
        + "                categories=scale))",
        "95 % confidence interval: ",
    ),
    "statsmodels": (
        "lab/analysis/_grading.py",
        COMMAND.format("grading study --on H,speed") + "main()",
        "Odds ratio",
    ),
    "matplotlib": (
        "plots/_forest.py",
        COMMAND.format("agree ratings.csv --target items --figure forest.svg")
        + "main()",
        "forest.svg",
    ),
    "emcee": (
        "intervals/latent/_sampler.py",
        "from masrel.intervals import latent_trait\n"
        + "ratings = [['0', '0', '0'], ['0', '1', '0'], ['1', '1', '1'],\n"
        + "           ['1', '0', '1'], ['0', '0', '1'], ['1', '1', '1']]\n"
        + "found = latent_trait(ratings, items='fixed', categories=['0', '1'],\n"
        + "                     rng=1, compare=False, n_steps=100)\n"
        + "print('converged at R-hat', found.r_hat)",
        "converged at R-hat 1.0",
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of ratings, the same as Parquet, and a study."""
    folder = tmp_path_factory.mktemp("packages")
    frame = pd.DataFrame(GRADES, columns=["Kim", "Lee", "Ann"])
    frame.insert(0, "patient", [f"P{place}" for place in range(len(frame))])
    frame.to_csv(folder / "ratings.csv", index=False)
    frame.to_parquet(folder / "ratings.parquet")
    (folder / "study").symlink_to(ROOT.parent / "studies" / "hess2012")
    return folder


def answer(question: str, folder: Path) -> str:
    """What a fresh interpreter says to a question, errors included."""
    asked = [sys.executable, "-c", question]
    done = subprocess.run(asked, cwd=folder, capture_output=True, text=True)
    return done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("package", USES)
def test_a_result_comes_from_the_package(package: str, folder: Path) -> None:
    module, question, part = USES[package]
    nodes = list(ast.walk(ast.parse((ROOT / module).read_text("utf-8"))))
    found = {n.module for n in nodes if isinstance(n, ast.ImportFrom)}
    found |= {a.name for n in nodes if isinstance(n, ast.Import) for a in n.names}
    assert package in {str(name).split(".")[0] for name in found}
    assert part in answer(question, folder)
    # without the package there is no such result
    without = answer(f"import sys\nsys.modules['{package}'] = None\n{question}", folder)
    assert part not in without
    assert package in without
