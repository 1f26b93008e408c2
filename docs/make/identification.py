"""What the page of identification shows: its figures, its table of coverage, its time.

python -m docs.make.identification figures
python -m docs.make.identification coverage [STUDIES]
python -m docs.make.identification wrong [STUDIES [TERM...]]
python -m docs.make.identification right [STUDIES [CASE...]]
python -m docs.make.identification time
"""

import math
import statistics
import sys
import time
from collections import Counter

from tqdm import tqdm

from docs.make.evidence import FIGURES, table, write_rows
from masrel.lab.elbow import STANDARD_MODELS, fit, fit_friction
from masrel.lab.elbow._model_file import QUANTITIES
from masrel.lab.report._fits import fit_figures
from tests.lab.elbow.identification.synthesis import NAMES, SCATTER, Scatter, study
from tests.lab.elbow.identification.test_friction import backdriven
from tests.lab.elbow.identification.test_lack_of_fit import (
    RIGHT,
    TERMS,
    WRONG,
    counts,
    quiet_fit,
    recordings,
)

HALF = Scatter(
    catch_angle=math.radians(1.0), catch_torque=0.05, catch_travel=math.radians(1.0)
)
SYMBOLS = tuple(QUANTITIES[name].symbol for name in NAMES)
CASES = (
    ("HM3", None, (60.0, 120.0)),
    ("HM3", SCATTER, (60.0, 120.0)),
    ("HM4", HALF, (40.0, 90.0)),
    ("HM2", None, (70.0, 130.0)),
    ("HM2", SCATTER, (70.0, 130.0)),
)


def figures() -> None:
    """Draw the page's figures."""
    fitted = fit(study(STANDARD_MODELS["HM3"], seed=5, n_slow=4, scatter=HALF))
    for made in (fitted, fit_friction([backdriven(1)])):
        for name, files in fit_figures(made).items():
            (FIGURES / f"{name}.png").write_bytes(files["png"])


def coverage(n_studies: int) -> None:
    """Print how often 95 % intervals hold the truth, per cent."""
    names = [name for name in QUANTITIES if name != "inertia"]
    print("| case |", " | ".join(QUANTITIES[name].symbol for name in names), "|")
    for model, scatter, speeds in CASES:
        joint, counts = STANDARD_MODELS[model], dict.fromkeys(names, 0)
        for seed in tqdm(range(1000, 1000 + n_studies), desc=model):
            made = fit(study(joint, seed=seed, scatter=scatter, fast=speeds))
            for name in names:
                counts[name] += made[name].covers(getattr(joint, name))
        shares = (f"{100.0 * counts[name] / n_studies:.1f}" for name in names)
        print(f"| {model}, {scatter} |", " | ".join(shares), "|")


def wrong(n_studies: int, *names: str) -> None:
    """Write what 95 % intervals hold without and with what an arm has.

    Of some of it alone, print that.
    """
    rows = []
    for scatter in (None, SCATTER):
        for name in tqdm(names or WRONG):
            case = {"arm": WRONG[name], "scatter": scatter}
            for options in ({}, {TERMS[name]: "fitted"}):
                total = counts(case, range(5000, 5000 + n_studies), **options)
                row = {
                    "term": name,
                    "catches": "scattered" if scatter else "exact",
                    "fitted": "yes" if options else "no",
                    "announced": total["does not fit"],
                }
                of = (total[parameter] for parameter in NAMES)
                rows.append(row | dict(zip(SYMBOLS, of, strict=True)))
    if names:
        print(table(list(rows[0]), [list(row.values()) for row in rows], n_text=3))
    else:
        write_rows("identification_terms", rows)


def right(n_studies: int, *cases: str) -> None:
    """Print how often the right law is called wrong, or left without evidence."""
    for case in cases or RIGHT:
        made = (quiet_fit(recordings(case, 7000 + i)) for i in range(n_studies))
        verdicts = Counter(each.lack_of_fit.verdict for each in made)
        alarms = verdicts["does not fit"], verdicts["no evidence either way"]
        print(f"| {case} | {alarms[0]}, {alarms[1]} of {n_studies} |", flush=True)


def seconds() -> None:
    """Print the processor time that 24 trials take."""
    movements = study(STANDARD_MODELS["HM3"], seed=1)
    recorded = sum(movement.time[-1] for movement in movements)
    taken = []
    for _ in range(7):
        begun = time.process_time()
        fit(movements)
        taken.append(time.process_time() - begun)
    print(
        f"{len(movements)} trials, {recorded:.0f} s at 1 kHz: "
        f"{statistics.median(taken):.2f} s of processor"
    )


if __name__ == "__main__":
    what = sys.argv[1:2]
    if what == ["figures"]:
        figures()
    elif what == ["coverage"]:
        coverage(int(sys.argv[2]) if len(sys.argv) > 2 else 200)
    elif what in (["wrong"], ["right"]):
        study_of = {"wrong": (wrong, 40), "right": (right, 400)}[what[0]]
        n_studies = int(sys.argv[2]) if len(sys.argv) > 2 else study_of[1]
        study_of[0](n_studies, *sys.argv[3:])
    elif what == ["time"]:
        seconds()
    else:
        sys.exit(__doc__)
