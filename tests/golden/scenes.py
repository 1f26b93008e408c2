"""Cases of the elbow model: traces of drawn scenes, and fits of their recordings."""

import csv
import hashlib
import io
import math
from functools import partial
from pathlib import Path

from tests.golden.call import STUDIES, Case, Stream, folder, masrel

N_SCENES = 200

MODEL_FILE = """format = "masrel joint model 1"
made_from = "numbers at random"
simulated = true

[model]
catch_angle_constant_deg = {length!r}
catch_torque_nms_rad = {torque!r}
residual_ratio = {ratio!r}
catch_travel_deg = {travel!r}

[constants]
damping_nms_rad = {damping!r}
stiffness_nm_rad = {stiffness!r}
"""


def cases() -> list[Case]:
    """Scenes, several scenes of one call, and fits."""
    made = [
        Case("trace", f"scene-{seed:03}", partial(_scene, seed))
        for seed in range(N_SCENES)
    ]
    made += [
        Case("trace", "text", _text),
        Case("trace", "several-speeds", _several),
    ]
    return made + [
        Case("fit", name, partial(_fit, model, *options), slow=name != "HM3")
        for name, model, options in (
            ("HM3", "HM3", ()),
            ("HM2-additive", "HM2", ("--post-catch", "additive")),
            ("HM4-inertia", "HM4", ("--inertia", "fitted", "--level", 0.9)),
            ("HM3-slow-below", "HM3", ("--slow-below", 15)),
        )
    ]


def _scene(seed: int) -> dict:
    stream = Stream(f"scene {seed}")
    with folder(model__toml=_model_file(stream), arm__csv=_arm(stream)) as here:
        call = ["trace", *_model(stream, seed), *_motion(stream, seed), *_law(stream)]
        call += ["--json", "-", "--quiet", *_outputs(stream)]
        sampled = ["--csv", "samples.csv", "--rate-hz", stream.one_of([50, 200, 333])]
        made = masrel("joint", *call, *(sampled if seed % 4 == 0 else ()))
        made["call"] = " ".join(map(str, call)).replace(str(STUDIES), "STUDIES")
        if (here / "samples.csv").is_file():
            made |= _samples((here / "samples.csv").read_text("utf-8"))
    return made


def _model_file(stream: Stream) -> str:
    return MODEL_FILE.format(
        length=stream.uniform(90.0, 140.0),
        torque=stream.uniform(0.0, 6.0),
        ratio=stream.uniform(0.0, 0.99),
        travel=stream.uniform(2.0, 70.0),
        damping=stream.uniform(0.0, 3.0),
        stiffness=stream.uniform(0.0, 8.0),
    )


def _arm(stream: Stream) -> str:
    # an arm that is moved unevenly, once halting, at 200 Hz
    speed, halt = stream.uniform(40.0, 160.0), stream.uniform(0.2, 0.5)
    angle, lines = 30.0, ["# simulated: true", "time_s,angle_deg"]
    for k in range(201):
        lines.append(f"{k / 200},{angle:.6f}")
        wave = 1.0 + 0.5 * math.sin(k / 9.0)
        angle += 0.0 if halt < k / 200 < halt + 0.1 else speed * wave / 200
    return "\n".join(lines) + "\n"


def _model(stream: Stream, seed: int) -> list[object]:
    if seed % 3 == 0:
        return ["--model", "model.toml"]
    if seed % 3 == 1:
        return ["--model", f"HM{1 + stream.below(4)}"]
    model = stream.one_of(["HM1", "HM4", "D01", "D05", "D12"])
    return ["--model", model, "--study", STUDIES / "hess2012"]


def _motion(stream: Stream, seed: int) -> list[object]:
    kind = ("constant", "minimum-jerk", "trapezoid", "recording")[seed // 2 % 4]
    made: list[object] = ["--motion", kind]
    if kind == "recording":
        made += ["--recording", "arm.csv"]
        made += ["--interpolation", "linear"] if stream.chance(0.4) else []
    else:
        made += ["--speed-deg-s", round(10.0 ** stream.uniform(0.9, 2.6), 3)]
        if stream.chance(0.5):
            made += ["--from-deg", round(stream.uniform(5.0, 60.0), 2)]
            made += ["--to-deg", round(stream.uniform(100.0, 146.0), 2)]
    if kind == "trapezoid":
        made += ["--acceleration-deg-s2", round(stream.uniform(500.0, 4000.0), 1)]
    if stream.chance(0.2):
        made += ["--stop-at-s", round(stream.uniform(0.05, 0.4), 3), "--pause-s", 0.25]
    return made + (["--repeat", 2 + stream.below(2)] if stream.chance(0.2) else [])


def _law(stream: Stream) -> list[object]:
    made: list[object] = []
    for share, option, value in (
        (0.3, "--post-catch", stream.one_of(["continuous", "additive"])),
        (0.3, "--q-reading", stream.one_of(["residual", "decrease"])),
        (0.25, "--catch-rise-s", round(stream.uniform(0.0, 0.1), 4)),
        (0.25, "--inertia-kg-m2", round(stream.uniform(0.0, 0.2), 4)),
        (0.2, "--rest-deg", round(stream.uniform(20.0, 90.0), 2)),
    ):
        made += [option, value] if stream.chance(share) else []
    return made


def _outputs(stream: Stream) -> list[object]:
    made: list[object] = []
    for name in ("residual-torque", "work", "impulse"):
        made += ["--output", name]
    for _ in range(4):
        made += ["--at-s", round(stream.uniform(0.0, 0.2), 4)]
    if stream.chance(0.5):
        made += ["--at-deg", round(stream.uniform(62.0, 98.0), 2)]
    return made


def _samples(text: str) -> dict:
    # every eighth row as numbers, and all bytes as one hash
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(io.StringIO("\n".join(lines))))[::8]
    columns = {
        key: [row[key] if key == "phase" else float(row[key]) for row in rows]
        for key in rows[0]
    }
    return {"samples": columns, "sha256": hashlib.sha256(text.encode()).hexdigest()}


def _text() -> dict:
    call = ("joint", "trace", "--model", "HM3", "--speed-deg-s", 92)
    return {
        "one": masrel(*call),
        "fast": masrel(*call, "--speed-deg-s", 240, "--model", "HM1"),
        "refused": masrel(*call, "--motion", "trapezoid"),
    }


def _several() -> dict:
    models = [part for k in range(1, 5) for part in ("--model", f"HM{k}")]
    call = ("trace", *models, "--speeds-deg-s", 15, 300, 12, "--output", "work")
    return masrel("joint", *call, "--json", "-", "--quiet")


def _fit(model: str, *options: object) -> dict:
    stream = Stream(f"fit {model}")
    with folder() as here:
        files = [_recording(here, model, stream, k) for k in range(10)]
        with_file = ("-o", "model.toml", "--json", "fit.json", "--quiet")
        made = masrel("joint", "fit", *files, *options, *with_file)
        if (here / "model.toml").is_file():
            made["model"] = (here / "model.toml").read_text("utf-8")
        printed = ("--json", "-", "--quiet")
        made["printed"] = masrel("joint", "fit", *files, *options, *printed)
    return made


def _recording(here: Path, model: str, stream: Stream, k: int) -> str:
    # four slow stretches and six fast ones; rounded, so that a last bit changes none
    slow = k < 4
    speed = stream.uniform(5.0, 8.5) if slow else stream.uniform(60.0, 120.0)
    start = stream.uniform(25.0, 100.0) if slow else 30.0
    end = start + 18.0 if slow else 146.0
    masrel(
        "joint", "trace", "--model", model, "--motion", "minimum-jerk",
        "--speed-deg-s", speed, "--from-deg", start, "--to-deg", end,
        "--csv", "trace.csv", "--rate-hz", 500, "--quiet",
    )  # fmt: skip
    lines = (here / "trace.csv").read_text("utf-8").splitlines()[1:]
    rows = list(csv.DictReader(lines))
    rows = rows[:1] * 100 + rows + rows[-1:] * 100
    name = f"trial_{k}.csv"
    with (here / name).open("w", encoding="utf-8") as out:
        out.write("# simulated: true\ntime_s,angle_deg,torque_nm\n")
        for i, row in enumerate(rows):
            torque = float(row["torque_nm"]) + 0.1 * stream.normal()
            out.write(f"{i / 500},{float(row['angle_deg']):.4f},{torque:.6f}\n")
    return name
