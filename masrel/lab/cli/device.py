"""``masrel device``: bring a Puck up on its CAN bus and see what it says."""

import dataclasses
import math
import sys
from contextlib import nullcontext
from typing import TYPE_CHECKING

import click

from masrel.lab.cli._puck_session import PuckSession, puck_command

if TYPE_CHECKING:
    from masrel.lab.hess.puck import FrictionEstimate, NodeReport

_N_NODES = 31


@click.group("device")
def device() -> None:
    """Bring a Barrett Puck up on its CAN bus.

    In this order: probe asks who is there, check looks whether a puck can be driven,
    zero tells it where the arm is, friction turns the free arm. What to make of it
    is in docs/hardware.md. To try them: --emulate.
    """


@device.command("probe")
@puck_command
def _probe(session: PuckSession) -> None:
    """Ask every node who it is; nothing is set and nobody is woken."""
    from masrel.lab.hess.puck import probe

    with session.link(all_nodes=True) as link, session.progress(_N_NODES) as progress:
        reports = probe(
            link,
            session.clock,
            properties=session.options.properties,
            progress=progress,
        )
    session.write_output(
        [_report_line(report) for report in reports] or ["nobody answers"],
        {"found": [dataclasses.asdict(report) for report in reports]},
    )
    if not reports:
        sys.exit(1)


@device.command("check")
@puck_command
def _check(session: PuckSession) -> None:
    """Wake a puck and see whether it can be driven. The arm must be at rest.

    It is told its groups and torque limit, goes into torque mode for some
    milliseconds with no more than 0.007 N·m, and is idle afterwards.
    """
    from masrel.lab.hess.puck import check

    with session.link() as link:
        checks = check(link, session.clock, session.options)
    holds = all(one.holds for one in checks)
    session.write_output(
        [
            f"{'ok  ' if one.holds else 'NOT '} {one.name}: {one.result}"
            for one in checks
        ],
        {
            "holds": holds,
            "checks": [
                {"name": one.name, "holds": one.holds, "found": one.result}
                for one in checks
            ],
        },
    )
    if not holds:
        sys.exit(1)


@device.command("zero")
@click.option(
    "--angle-deg",
    type=click.FloatRange(0.0, 180.0),
    required=True,
    help="Where the arm is held now, 0 at full flexion.",
)
@puck_command
def _zero(session: PuckSession, angle_deg: float) -> None:
    """Tell a puck where the arm is; it forgets when its supply is switched off."""
    from masrel.lab.hess.puck import zero

    with session.link() as link:
        counts = zero(
            link, session.clock, session.options, angle=math.radians(angle_deg)
        )
    session.write_output(
        [f"the arm is at {angle_deg:g} deg: {counts} counts"],
        {"angle_deg": angle_deg, "counts": counts},
    )


@device.command("friction")
@click.option(
    "--arm-is-free",
    is_flag=True,
    help="Say that nobody holds the arm and nothing is in its way: IT MOVES.",
)
@puck_command
def _friction(session: PuckSession, arm_is_free: bool) -> None:
    """Turn the free arm at steady speeds and fit B and β of equation (7).

    The arm moves by itself, between 40 and 115 deg, at up to 80 deg/s, with at most
    2 N·m, for about 20 s.
    """
    from masrel.lab.hess._watchdog import watched
    from masrel.lab.hess.puck import fit_friction, steady_runs
    from masrel.lab.hess.puck._commissioning import LIMITS, SPEEDS

    if not arm_is_free:
        raise click.UsageError(
            "the arm will move by itself; when it is free, say --arm-is-free"
        )
    with (
        session.emergency_stop() as stop,
        session.device() as device,
        watched(device, LIMITS.watchdog_time) or nullcontext() as watchdog,
        session.progress(2 * len(SPEEDS)) as progress,
    ):
        runs = steady_runs(
            device, session.clock, watchdog=watchdog, stop=stop, progress=progress
        )
        estimate = fit_friction(runs)
    session.write_output(_friction_lines(estimate), dataclasses.asdict(estimate))


def _report_line(report: "NodeReport") -> str:
    if report.firmware is None:
        return f"puck {report.puck}: {report.kind}"
    state = "awake" if report.is_awake else "asleep"
    support = "" if report.is_supported else ", NOT SUPPORTED"
    values = "".join(f", {name} {value}" for name, value in report.properties.items())
    return (
        f"puck {report.puck}: {report.kind}, firmware {report.firmware}, "
        f"{state}{support}{values}"
    )


def _friction_lines(estimate: "FrictionEstimate") -> list[str]:
    runs = [
        f"{math.degrees(run.speed):7.1f} deg/s {run.torque:8.4f} N·m"
        for run in estimate.runs
    ]
    return [
        *runs,
        f"B = {estimate.viscous:.4f} ± {estimate.viscous_error:.4f} N·m·s/rad",
        f"β = {estimate.coulomb:.4f} ± {estimate.coulomb_error:.4f} N·m",
        f"offset = {estimate.offset:.4f} ± {estimate.offset_error:.4f} N·m",
    ]
