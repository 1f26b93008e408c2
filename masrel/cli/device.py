"""``masrel device``: bring a Puck up on its CAN bus and see what it says."""

import dataclasses
import math
import sys
from contextlib import nullcontext
from typing import TYPE_CHECKING

import click

from masrel.cli.bench import Bench
from masrel.cli.puck import for_a_puck

if TYPE_CHECKING:
    from masrel.hess.puck.friction import FrictionEstimate
    from masrel.hess.puck.survey import Found

__all__ = ["command"]

_N_NODES = 31


@click.group("device")
def command() -> None:
    """Bring a Barrett Puck up on its CAN bus.

    In this order: probe asks who is there, check looks whether a puck can be driven,
    zero tells it where the arm is, friction turns the free arm. What to make of it
    is in docs/hardware.md. To try them: --interface virtual --channel x --emulate.
    """


@command.command("probe")
@for_a_puck
def probe_command(bench: Bench) -> None:
    """Ask every node who it is; nothing is set and nobody is woken."""
    from masrel.hess.puck.survey import probe

    with bench.link(hears_all=True) as link, bench.progress(_N_NODES) as progress:
        found = probe(
            link, bench.clock, properties=bench.options.properties, progress=progress
        )
    bench.say(
        [_described(one) for one in found] or ["nobody answers"],
        {"found": [dataclasses.asdict(one) for one in found]},
    )
    if not found:
        sys.exit(1)


@command.command("check")
@for_a_puck
def check_command(bench: Bench) -> None:
    """Wake a puck and see whether it can be driven. The arm must be at rest.

    It is told its groups and torque limit, goes into torque mode for some
    milliseconds with no more than 0.007 N·m, and is idle afterwards.
    """
    from masrel.hess.puck.checks import check
    from masrel.hess.puck.connection import awake

    with bench.link() as link:
        checks = check(awake(link, bench.clock, bench.options), bench.options)
    holds = all(one.holds for one in checks)
    bench.say(
        [
            f"{'ok  ' if one.holds else 'NOT '} {one.name}: {one.found}"
            for one in checks
        ],
        {"holds": holds, "checks": [dataclasses.asdict(one) for one in checks]},
    )
    if not holds:
        sys.exit(1)


@command.command("zero")
@click.option(
    "--angle-deg",
    type=click.FloatRange(0.0, 180.0),
    required=True,
    help="Where the arm is held now, 0 at full flexion.",
)
@for_a_puck
def zero_command(bench: Bench, angle_deg: float) -> None:
    """Tell a puck where the arm is; it forgets when its supply is switched off."""
    from masrel.hess.puck.bring_up import set_position
    from masrel.hess.puck.connection import awake

    with bench.link() as link:
        puck = awake(link, bench.clock, bench.options)
        counts = set_position(
            puck.node, puck.table, puck.transmission, math.radians(angle_deg)
        )
    bench.say(
        [f"the arm is at {angle_deg:g} deg: {counts} counts"],
        {"angle_deg": angle_deg, "counts": counts},
    )


@command.command("friction")
@click.option(
    "--arm-is-free",
    is_flag=True,
    help="Say that nobody holds the arm and nothing is in its way: IT MOVES.",
)
@for_a_puck
def friction_command(bench: Bench, arm_is_free: bool) -> None:
    """Turn the free arm at steady speeds and fit B and β of equation (7).

    The arm moves by itself, between 40 and 115 deg, at up to 80 deg/s, with at most
    2 N·m, for about 20 s.
    """
    from masrel.hess._watchdog import watched
    from masrel.hess.puck.friction import fit_friction
    from masrel.hess.puck.turning import LIMITS, SPEEDS, steady_runs

    if not arm_is_free:
        raise click.UsageError(
            "the arm will move by itself; when it is free, say --arm-is-free"
        )
    with (
        bench.emergency_stop() as stop,
        bench.device() as device,
        watched(device, LIMITS.watchdog_time) or nullcontext() as watchdog,
        bench.progress(2 * len(SPEEDS)) as progress,
    ):
        runs = steady_runs(
            device, bench.clock, watchdog=watchdog, stop=stop, progress=progress
        )
        estimate = fit_friction(runs)
    bench.say(_friction_lines(estimate), dataclasses.asdict(estimate))


def _described(one: "Found") -> str:
    if one.firmware is None:
        return f"puck {one.puck}: {one.kind}"
    state = "awake" if one.is_awake else "asleep"
    support = "" if one.is_supported else ", NOT SUPPORTED"
    said = "".join(f", {name} {value}" for name, value in one.properties.items())
    return (
        f"puck {one.puck}: {one.kind}, firmware {one.firmware}, {state}{support}{said}"
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
