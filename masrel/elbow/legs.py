"""The law of torque from event to event: (1), (3) and (5) with their constants.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

from masrel.elbow.course import rest_angle
from masrel.elbow.moments import Course, Moment, Stretch
from masrel.elbow.motion import Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import ONE, ZERO, Polynomial, added, product, scaled

__all__ = ["Leg", "Section", "catch_levels", "legs", "sections"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A time in which one law of torque holds.

    The torque is level + stiffness (θ - origin) + damping ω + inertia θ̈, and in a
    smoothed onset of the catch also rise (3y² - 2y³), y being the share of the leg.

    Attributes
    ----------
    start, end : Decimal
        s.
    level : Decimal
        N·m.
    stiffness : Decimal
        N·m/rad.
    origin : Decimal
        rad.
    damping : Decimal
        N·m·s/rad.
    inertia : Decimal
        kg·m².
    rise : Decimal
        N·m.
    rise_time : Decimal
        Time in which the whole of `rise` would be reached, s.
    """

    start: Decimal
    end: Decimal
    level: Decimal = ZERO
    stiffness: Decimal = ZERO
    origin: Decimal = ZERO
    damping: Decimal = ZERO
    inertia: Decimal = ZERO
    rise: Decimal = ZERO
    rise_time: Decimal = ONE


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """What a leg and a piece of the motion have in common.

    Attributes
    ----------
    piece : Piece
        The motion, as a part of its piece.
    torque : tuple of Decimal
        Coefficients of the torque, N·m, in the share of that part.
    """

    piece: Piece
    torque: Polynomial


def catch_levels(
    parameters: ElbowParameters, motion: Motion, catch: Moment
) -> tuple[Decimal, Decimal]:
    """Return τ_pre_end and H·v_c of (3).

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion.
    catch : Moment
        The beginning of a catch.

    Returns
    -------
    tuple of two Decimal
        Both, N·m.
    """
    pre_end = (
        Decimal(parameters.damping) * catch.velocity
        + Decimal(parameters.stiffness)
        * (catch.angle - Decimal(rest_angle(parameters, motion)))
        + Decimal(parameters.inertia) * catch.acceleration
    )  # (1)
    return pre_end, Decimal(parameters.catch_torque_constant) * catch.velocity


def legs(parameters: ElbowParameters, motion: Motion, found: Course) -> list[Leg]:
    """Return the laws of a motion in order.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion.
    found : Course
        Its course.

    Returns
    -------
    list of Leg
        The laws, without those that hold for no time.
    """
    ends = [change.moment.time for change in found.changes[1:]] + [found.end.time]
    laid = []
    for change, end in zip(found.changes, ends, strict=True):
        start = change.moment.time
        if change.stretch is None:
            laid.append(_pre_catch(parameters, motion, start, end))
        elif change.phase == "catch":
            laid += _catch(parameters, motion, change.stretch, end)
        else:
            laid.append(_post_catch(parameters, motion, change.stretch, end))
    return [leg for leg in laid if leg.end > leg.start]


def _pre_catch(
    parameters: ElbowParameters, motion: Motion, start: Decimal, end: Decimal
) -> Leg:
    return Leg(
        start=start,
        end=end,
        stiffness=Decimal(parameters.stiffness),  # (1)
        origin=Decimal(rest_angle(parameters, motion)),
        damping=Decimal(parameters.damping),
        inertia=Decimal(parameters.inertia),
    )


def _catch(
    parameters: ElbowParameters, motion: Motion, stretch: Stretch, end: Decimal
) -> list[Leg]:
    if stretch.catch is None:
        return []
    start = stretch.catch.time
    pre_end, rise = catch_levels(parameters, motion, stretch.catch)
    rise_time = Decimal(parameters.catch_rise)
    risen = min(start + rise_time, end)
    fallen = min(start + Decimal(parameters.peak_duration), end)
    residual = pre_end + Decimal(parameters.residual_share) * rise
    return [
        Leg(start=start, end=risen, level=pre_end, rise=rise, rise_time=rise_time),
        Leg(start=risen, end=fallen, level=pre_end + rise),  # (3), first line
        Leg(start=fallen, end=end, level=residual),  # (3), second line
    ]


def _post_catch(
    parameters: ElbowParameters, motion: Motion, stretch: Stretch, end: Decimal
) -> Leg:
    start = stretch.post_catch
    if stretch.catch is None or start is None:
        return Leg(start=end, end=end)
    pre_end, rise = catch_levels(parameters, motion, stretch.catch)
    residual = Decimal(parameters.residual_share) * rise
    climb, stiffness = Decimal(parameters.post_catch_stiffness), parameters.stiffness
    inertia = Decimal(parameters.inertia)
    if parameters.post_catch == "continuous":  # (5)
        return Leg(
            start=start.time,
            end=end,
            level=pre_end + residual,
            stiffness=climb,
            origin=start.angle,
            inertia=inertia,
        )
    rest = Decimal(rest_angle(parameters, motion))
    return Leg(  # (5) as Table III's footnote reads it
        start=start.time,
        end=end,
        level=residual + Decimal(stiffness) * (start.angle - rest),
        stiffness=climb + Decimal(stiffness),
        origin=start.angle,
        damping=Decimal(parameters.damping),
        inertia=inertia,
    )


def sections(laid: list[Leg], motion: Motion) -> Iterator[Section]:
    """Cut a motion where its law or its polynomial changes.

    Parameters
    ----------
    laid : list of Leg
        The laws in order.
    motion : Motion
        The motion.

    Yields
    ------
    Section
        The next of them in time.
    """
    waiting = iter(laid)
    leg = next(waiting, None)
    since = ZERO
    for piece in motion.pieces():
        until = since + piece.length
        while leg is not None and leg.start < until:
            low = max(leg.start - since, ZERO) / piece.length
            high = min(leg.end - since, piece.length) / piece.length
            if low < high:
                part = piece.part(low, high)
                begin = since + low * piece.length
                yield Section(piece=part, torque=_torque(leg, part, begin))
            if leg.end > until:
                break
            leg = next(waiting, None)
        if leg is None:
            return
        since = until


def _torque(leg: Leg, part: Piece, begin: Decimal) -> Polynomial:
    terms = added(
        scaled(part.angle, leg.stiffness),
        added(
            scaled(part.velocity, leg.damping), scaled(part.acceleration, leg.inertia)
        ),
    )
    torque = added((leg.level - leg.stiffness * leg.origin,), terms)
    if not leg.rise:
        return torque
    share = ((begin - leg.start) / leg.rise_time, part.length / leg.rise_time)
    curve = product(
        product(share, share), added((Decimal(3),), scaled(share, -2 * ONE))
    )
    return added(torque, scaled(curve, leg.rise))  # 3y² - 2y³
