"""A study of any number of raters, models and repeats: its protocol and ratings."""

import csv
import random
from pathlib import Path

from masrel.lab.protocol import copy_template

_GRADES = ("0", "1", "1+", "2", "3", "4")
_RETESTED = 5  # every so manyth rater comes again

_MODEL = """[[models]]
id = "HM{number}"
role = "standard"
intended_grade = "{grade}"
catch_angle_constant_deg = {angle:.1f}
catch_torque_nms_rad = {torque:.2f}
residual_ratio = {residual:.2f}
catch_travel_deg = {travel:.1f}
"""

_RETEST = """
[[analysis.estimates]]
id = "retest"
kind = "test-retest"
coefficient = "stratified_kappa"
models = "standard"
sessions = ["test", "retest"]
target = "items"
"""


def many_ratings(root: Path, n_raters: int, n_models: int, n_repeats: int) -> Path:
    """Write such a study into a folder; return its file of ratings."""
    copy_template("small", root)
    text = (root / "protocol.toml").read_text(encoding="utf-8")
    models = text.index("\n[[models]]") + 1, text.index("# One [[raters]] table")
    sessions = text.index("\n[[raters]]\n") + 1, text.index("# Orders and codes")
    raters = [f"R{number:03d}" for number in range(1, n_raters + 1)]
    new = [f'[[raters]]\nid = "{rater}"\n' for rater in raters]
    for session, group in (("test", raters), ("retest", raters[::_RETESTED])):
        names = ", ".join(f'"{rater}"' for rater in group)
        new.append(f'[[sessions]]\nid = "{session}"\nraters = [{names}]\n')
    text = (
        text[: models[0]]
        + "\n".join(_model(number, n_models) for number in range(n_models))
        + text[models[1] : sessions[0]]
        + "\n".join(new)
        + text[sessions[1] :].replace("repeats = 1 ", f"repeats = {n_repeats} ")
        + _RETEST
    )
    (root / "protocol.toml").write_text(text, encoding="utf-8")
    file = root / "ratings" / "ratings.csv"
    file.parent.mkdir(exist_ok=True)
    _write_ratings(file, raters, n_models, n_repeats)
    return file


def _model(number: int, n_models: int) -> str:
    share = number / max(n_models - 1, 1)
    return _MODEL.format(
        number=number + 1,
        grade=_GRADES[1 + int(3.99 * share)],
        angle=130.0 - 20.0 * share,
        torque=1.4 + 2.4 * share,
        residual=0.15 + 0.65 * share,
        travel=60.0 - 50.0 * share,
    )


def _write_ratings(
    path: Path, raters: list[str], n_models: int, n_repeats: int
) -> None:
    numbers = random.Random(20)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = ("session", "rater", "model", "repeat", "grade", "mean_speed_deg_s")
        writer.writerow([*names, "source"])
        for session, group in (("test", raters), ("retest", raters[::_RETESTED])):
            for rater in group:
                usual = numbers.gauss(85.0, 12.0)
                for model in range(n_models):
                    aim = 1 + int(3.99 * model / max(n_models - 1, 1))
                    for repeat in range(1, n_repeats + 1):
                        off = numbers.choices((-1, 0, 1), (0.12, 0.78, 0.10))[0]
                        speed = max(35.0, numbers.gauss(usual, 8.0))
                        where = (session, rater, f"HM{model + 1}", repeat)
                        cells = (_GRADES[aim + off], f"{speed:.1f}", "simulated")
                        writer.writerow([*where, *cells])
