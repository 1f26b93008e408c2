"""What one trial asks of the parameters: residuals and their analytic derivatives.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6).
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.censored import beyond
from masrel.elbow.identification.clusters import Rows, without_own
from masrel.elbow.identification.part import Part
from masrel.elbow.identification.scatter import Known, catch_rows
from masrel.elbow.identification.trials import Trial

__all__ = ["Equations"]

Floats = NDArray[np.float64]

PRE_CATCH = ("damping", "stiffness", "inertia")
"""Parameters of (1): velocity, angle and acceleration are what multiplies them."""


class Equations:
    """Residuals of one trial as a function of shared and own parameters.

    The own ones are peak and residual torque above the end of pre-catch (N·m) and
    the angle travelled in the catch (rad), as far as the trial has them. The trial's
    constant torque is eliminated.

    Parameters
    ----------
    trial : Trial
        The trial.
    known : Known
        What does not change.

    Attributes
    ----------
    n_own : int
        How many own parameters there are.
    """

    def __init__(self, trial: Trial, known: Known) -> None:
        self._known = known
        self._catch = trial.catch if trial.after is not None else None
        self._line = trial.catch if known.on_line else None
        self._own: tuple[str, ...] = ()
        pre = _motion(trial.pre_catch)
        self._n_pre = trial.pre_catch.torque.size
        self._motion, self._torque = pre, trial.pre_catch.torque
        self._in_peak = np.zeros(self._n_pre, dtype=np.bool_)
        self._since = np.zeros(self._n_pre)
        self._over: NDArray[np.bool_] | None = None
        if trial.after is not None and trial.catch is not None:
            self._add_after(trial.after, trial.catch)
        self.n_own = len(self._own)
        self._compress()

    def _add_after(self, part: Part, catch: Catch) -> None:
        constants, names = self._known.constants, self._known.names
        additive = constants.post_catch == "additive"
        fixed_end = catch.end is not None and (catch.within_peak or additive)
        end = math.inf if catch.end is None or not fixed_end else catch.end
        in_peak = part.time < min(catch.time + constants.peak_duration, end)
        over = part.time >= end
        held = np.array([[catch.speed, catch.angle, catch.acceleration]])
        motion = np.repeat(held, part.time.size, axis=0)  # τ_pre_end of (3)
        if additive:
            motion = np.where(over[:, None], _motion(part), motion)
        elif catch.end is not None:
            later = part.time >= catch.end
            motion[later, 2] += part.acceleration[later]  # m·θ̈ of (5)
        own = ["peak"] if in_peak.any() else []
        own += ["residual"] if not in_peak.all() else []
        moves = catch.end is not None and not fixed_end and "catch_travel" in names
        self._own = (*own, *(["travel"] if moves else []))
        self._over = over if fixed_end else None
        self._motion = np.concatenate([self._motion, motion])
        self._torque = np.concatenate([self._torque, part.torque])
        self._in_peak = np.concatenate([self._in_peak, in_peak])
        self._since = np.concatenate([self._since, part.angle - catch.angle])

    def _compress(self) -> None:
        # Before the residual torque everything is linear: QR leaves of the samples a
        # row for each column, and the same least squares.
        linear = np.arange(self._torque.size) < self._n_pre
        linear |= self._in_peak
        ones = np.ones(self._torque.size)
        table = np.column_stack([self._motion, self._in_peak, ones, self._torque])
        first = table[linear]
        if first.shape[0] > table.shape[1]:
            first = np.asarray(np.linalg.qr(first, mode="r"), dtype=np.float64)
        self._rows = np.concatenate([first, table[~linear]])
        self._n_first = first.shape[0]
        self._tail = self._since[~linear]
        over = None
        if self._over is not None:
            whole = np.concatenate([np.zeros(self._n_pre, np.bool_), self._over])
            over = whole[~linear]
        self._tail_over = over

    def start(self, shared: Mapping[str, float]) -> Floats:
        """Where to begin with the trial's own parameters.

        Parameters
        ----------
        shared : mapping of str to float
            The shared parameters, from the steps.

        Returns
        -------
        ndarray, shape (n_own,)
            Peak and residual by (3) with them, and the travel that was found.
        """
        catch = self._catch
        if catch is None:
            return np.empty(0)
        peak = shared["catch_torque_constant"] * catch.speed
        share = shared["residual_ratio"]
        values = {
            "peak": peak if math.isfinite(peak) else 0.0,
            "residual": peak * share if math.isfinite(peak * share) else 0.0,
            "travel": catch.travel,
        }
        return np.array([values[name] for name in self._own])

    def at(self, shared: Floats, own: Floats) -> tuple[Floats, Floats, Floats]:
        """Evaluate residuals and derivatives.

        Parameters
        ----------
        shared : ndarray, shape (n_shared,)
            Shared parameters.
        own : ndarray, shape (n_own,)
            The trial's own.

        Returns
        -------
        tuple of ndarray, shapes (n_rows,), (n_rows, n_shared), (n_rows, n_own)
            Residuals over their spreads, and their derivatives.
        """
        now = dict(zip(self._known.names, shared.tolist(), strict=True))
        mine = dict(zip(self._own, own.tolist(), strict=True))
        columns, residuals = self._torque_rows(now, mine)
        constant = self._rows[:, 4]
        size = float(constant @ constant)
        made = []
        for values in (residuals, *columns.values()):
            # the best constant of the trial is taken out: what is left is at right
            # angles to it
            share = float(constant @ values) / size if size else 0.0
            made.append((values - share * constant) / self._known.spreads.torque)
        columns = dict(zip(columns, made[1:], strict=True))
        rows = catch_rows(self._known, (self._line, self._catch), now, mine)
        residuals = np.append(made[0], [left for left, _ in rows])
        jacobian = [
            self._column(name, columns, rows)
            for name in (*self._known.names, *self._own)
        ]
        whole = np.stack(jacobian, axis=1)
        n_shared = len(self._known.names)
        return residuals, whole[:, :n_shared], whole[:, n_shared:]

    def _column(
        self,
        name: str,
        columns: Mapping[str, Floats],
        rows: list[tuple[float, dict[str, float]]],
    ) -> Floats:
        nothing = np.zeros(self._rows.shape[0])
        below = [slopes.get(name, 0.0) for _, slopes in rows]
        return np.append(columns.get(name, nothing), below)

    def _torque_rows(
        self, now: Mapping[str, float], mine: Mapping[str, float]
    ) -> tuple[dict[str, Floats], Floats]:
        # derivatives of the torque by each parameter, and law minus measured, up to
        # the trial's constant
        rows, n = self._rows, self._n_first
        columns = {name: rows[:, i] for i, name in enumerate(PRE_CATCH) if name in now}
        law = sum(
            (now[name] * column for name, column in columns.items()),
            np.zeros(rows.shape[0]),
        )
        if "peak" in mine:
            columns["peak"] = rows[:, 3]
            law = law + mine["peak"] * rows[:, 3]
        if "residual" in mine:
            climb, over = self._climb(mine)
            held = np.append(np.zeros(n), np.ones(self._tail.size))
            columns["residual"] = held
            law = law + mine["residual"] * held
            k_post = now.get("post_catch_stiffness", 0.0)
            columns["post_catch_stiffness"] = np.append(np.zeros(n), climb)
            columns["travel"] = np.append(np.zeros(n), np.where(over, -k_post, 0.0))
            law = law + k_post * columns["post_catch_stiffness"]
        return columns, law - rows[:, 5]

    def _climb(self, mine: Mapping[str, float]) -> tuple[Floats, NDArray[np.bool_]]:
        # θ - θ_post of (5) after the catch, 0 before, and where it is after
        catch = self._catch
        if catch is None or catch.end is None:
            return np.zeros_like(self._tail), np.zeros(self._tail.size, np.bool_)
        past = self._tail - mine.get("travel", catch.travel)
        over = past > 0.0 if self._tail_over is None else self._tail_over
        return np.where(over, past, 0.0), over

    def rows(self, shared: Floats, own: Floats) -> Rows:
        """Linear rows that say of the parameters what the trial does.

        Parameters
        ----------
        shared : ndarray, shape (n_shared,)
            Shared parameters.
        own : ndarray, shape (n_own,)
            The trial's own.

        Returns
        -------
        Rows
            Of the shared ones, where they are; without what the own explain.
        """
        residuals, by_shared, by_own = self.at(shared, own)
        names, horizon = self._known.names, self._known.horizon
        if horizon is not None and "catch_travel" in names:
            place = names.index("catch_travel")
            spread = self._known.spreads.travel
            _, slope, root = beyond(float(shared[place]), horizon, spread)
            # the last row: as steep as the likelihood is curved, and of equal score
            if slope != 0.0:
                residuals[-1] *= slope / -root
                by_shared[-1] *= -root / slope
        return without_own(by_own, by_shared, -residuals)

    def torque(self, shared: Floats, own: Floats) -> Floats:
        """Torque of the law at the trial's samples, with its own constant.

        Parameters
        ----------
        shared, own : ndarray
            Parameters.

        Returns
        -------
        ndarray, shape (n_samples,)
            N·m, samples of `pre_catch` and then of `after`.
        """
        now = dict(zip(self._known.names, shared.tolist(), strict=True))
        mine = dict(zip(self._own, own.tolist(), strict=True))
        slopes = np.array([now.get(name, 0.0) for name in PRE_CATCH])
        law = self._motion @ slopes + mine.get("peak", 0.0) * self._in_peak
        tail = np.arange(law.size) >= self._n_pre
        tail &= ~self._in_peak
        climb, _ = self._climb(mine)
        k_post = now.get("post_catch_stiffness", 0.0)
        law[tail] += mine.get("residual", 0.0) + k_post * climb
        return np.asarray(law + (self._torque - law).mean())


def _motion(part: Part) -> Floats:
    return np.stack([part.velocity, part.angle, part.acceleration], axis=1)
