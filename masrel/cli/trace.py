"""``masrel trace``: the torque trace of one stretch of one model."""

import csv
import io
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow import ElbowParameters, Events, Motion

__all__ = ["command"]

TRACE_COLUMNS = ("time_s", "angle_deg", "velocity_deg_s", "torque_nm", "phase")


@click.command("trace")
@click.option("--model", required=True, help="HM1 to HM4, or a model of --study.")
@click.option(
    "--speed-deg-s", "speed", type=float, required=True, help="Mean speed, deg/s."
)
@click.option(
    "--motion",
    "kind",
    type=click.Choice(["constant", "minimum-jerk"]),
    default="constant",
    show_default=True,
)
@click.option("--from-deg", "start", type=float, default=30.0, show_default=True)
@click.option("--to-deg", "end", type=float, default=146.0, show_default=True)
@click.option(
    "--study",
    type=click.Path(path_type=Path),
    help="Take the model from this study's protocol.",
)
@click.option(
    "--rate-hz",
    type=click.FloatRange(min=0.0, min_open=True),
    default=1000.0,
    show_default=True,
    help="Samples a second of --csv.",
)
@click.option(
    "--csv", "csv_file", type=click.Path(path_type=Path), help="Write the samples here."
)
@click.option(
    "--json", "json_file", help="Write events and peak as JSON here; - for the screen."
)
def command(
    model: str,
    speed: float,
    kind: str,
    start: float,
    end: float,
    study: Path | None,
    rate_hz: float,
    csv_file: Path | None,
    json_file: str | None,
) -> None:
    """Phases, peak torque and samples of one stretch of one model.

    Events and peak are exact; the samples of --csv are what the controller commands
    at --rate-hz for that motion.
    """
    from masrel.elbow import ConstantSpeed, MinimumJerk, events, peak_torque

    parameters = _parameters(model, study)
    angles = {"start": math.radians(start), "end": math.radians(end)}
    stretch: Motion
    if kind == "constant":
        stretch = ConstantSpeed(**angles, speed=math.radians(speed))
    else:
        stretch = MinimumJerk(**angles, mean_speed=math.radians(speed))
    if csv_file is not None:
        csv_file.write_text(_samples(parameters, stretch, rate_hz), encoding="utf-8")
    found = events(parameters, stretch)
    document = {
        "model": model,
        "motion": kind,
        "speed_deg_s": speed,
        "from_deg": start,
        "to_deg": end,
        "catch_angle_deg": _degrees(found.catch_angle),
        "mean_speed_deg_s": _degrees(found.mean_speed),
        "peak_torque_nm": peak_torque(parameters, stretch),
        "phases": _phases(found),
    }
    if json_file == "-":
        click.echo(json.dumps(document, indent=1))
        return
    if json_file is not None:
        Path(json_file).write_text(json.dumps(document, indent=1) + "\n", "utf-8")
    click.echo(_table(document, found))


def _parameters(model: str, study: Path | None) -> "ElbowParameters":
    from masrel.elbow import STANDARD_MODELS

    if study is not None:
        from masrel.protocol import StudyPaths, elbow_parameters, read_protocol

        return elbow_parameters(read_protocol(StudyPaths(study).protocol), model)
    if model not in STANDARD_MODELS:
        raise ParameterError(
            f"--model: needs one of {', '.join(STANDARD_MODELS)}, or --study to name "
            f"a study's own, got {model!r}"
        )
    return STANDARD_MODELS[model]


def _degrees(value: float | None) -> float | None:
    return None if value is None else math.degrees(value)


def _phases(found: "Events") -> list[dict[str, object]]:
    return [
        {
            "name": span.name,
            "start_s": span.start,
            "end_s": span.end,
            "start_deg": math.degrees(span.start_angle),
            "end_deg": math.degrees(span.end_angle),
        }
        for span in found.phases
    ]


def _samples(parameters: "ElbowParameters", stretch: "Motion", rate_hz: float) -> str:
    import numpy as np

    from masrel.elbow import trace
    from masrel.recording import PHASES

    made = trace(parameters, stretch, rate_hz=rate_hz)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(TRACE_COLUMNS)
    columns = (
        made.time.tolist(),
        np.degrees(made.angle).tolist(),
        np.degrees(made.velocity).tolist(),
        made.torque.tolist(),
        [PHASES[code] for code in made.phase.tolist()],
    )
    writer.writerows(zip(*columns, strict=True))
    return out.getvalue()


def _table(document: dict[str, object], found: "Events") -> str:
    lines = [
        f"{document['model']}, {document['motion']} {document['speed_deg_s']:g} deg/s",
        f"{'phase':<11}{'start s':>9}{'end s':>9}{'start deg':>11}{'end deg':>9}",
    ]
    lines += [
        f"{span.name:<11}{span.start:>9.3f}{span.end:>9.3f}"
        f"{math.degrees(span.start_angle):>11.2f}{math.degrees(span.end_angle):>9.2f}"
        for span in found.phases
    ]
    lines.append(f"peak torque {document['peak_torque_nm']:.3f} N·m")
    return "\n".join(lines)
