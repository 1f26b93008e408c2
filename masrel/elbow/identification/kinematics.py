"""Speed and acceleration from an encoder's angle, by a zero-phase filter."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from masrel.errors import ParameterError

__all__ = [
    "bandwidth",
    "differentiate",
    "filter_alike",
    "state_at_break",
    "window_length",
]

Floats = NDArray[np.float64]

ORDER = 3
"""Degree of the polynomials that are fitted in the window."""

BEFORE, AFTER = 0.1, 0.1
"""Reach of the fit of speed at a catch, s."""


def window_length(window: float, period: float) -> int:
    """Count the samples of a window of the filter: odd, enough for its polynomial.

    Parameters
    ----------
    window, period : float
        Length of the window and time between samples, s.

    Returns
    -------
    int
        Its length in samples.

    Raises
    ------
    ParameterError
        If the window is shorter than seven samples.

    Examples
    --------
    >>> window_length(0.06, 0.001)
    61
    """
    length = 2 * round(0.5 * window / period) + 1
    if length < 7:
        raise ParameterError(
            f"window: needs 7 samples, {7 * period:g} s at this rate, got {window:g} s"
        )
    return length


def differentiate(
    angle: Floats, period: float, window: float
) -> tuple[Floats, Floats, Floats]:
    """Smooth an angle and its two derivatives, without any delay.

    Parameters
    ----------
    angle : ndarray, shape (n_samples,)
        Angle at even times, rad.
    period : float
        Time between samples, s.
    window : float
        Length of the filter's window, s.

    Returns
    -------
    tuple of three ndarray, shape (n_samples,)
        Angle (rad), velocity (rad/s) and acceleration (rad/s²): those of the cubic
        fitted to each window (Savitzky and Golay), and of the first and last window
        at the ends. Fewer samples than a window are fitted as one.

    Raises
    ------
    ParameterError
        If the window is shorter than seven samples.

    References
    ----------
    .. [1] Savitzky, A., Golay, M. J. E. (1964). Smoothing and differentiation of
       data by simplified least squares procedures. Analytical Chemistry, 36(8),
       1627-1639. https://doi.org/10.1021/ac60214a047

    Examples
    --------
    A parabola is its own best cubic:

    >>> t = np.arange(200) / 1000.0
    >>> angle, velocity, acceleration = differentiate(t**2, 0.001, 0.06)
    >>> bool(np.allclose(velocity, 2 * t)), bool(np.allclose(acceleration, 2.0))
    (True, True)
    """
    length = min(window_length(window, period), angle.size - 1 + angle.size % 2)
    order = min(ORDER, length - 1)
    made = [
        savgol_filter(angle, length, order, deriv=deriv, delta=period)
        if deriv <= order
        else np.zeros_like(angle)
        for deriv in range(3)
    ]
    return made[0], made[1], made[2]


def filter_alike(
    angle: Floats, torque: Floats, period: float, window: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Smooth angle and torque by one filter, under which a linear law stays as it is.

    Parameters
    ----------
    angle, torque : ndarray, shape (n_samples,)
        At even times, rad and N·m.
    period : float
        Time between samples, s.
    window : float
        Length of the window, s.

    Returns
    -------
    tuple of four ndarray, shape (n_samples - length - 1,)
        Angle (rad), velocity (rad/s), acceleration (rad/s²) and torque (N·m) at the
        inner samples: those with a whole window, but for the first and last of them.

    Notes
    -----
    A weighted mean over a symmetric window (Hann's) commutes with d/dt. Whatever the
    hand does, τ = b·θ̇ + k·θ + c holds for the means as for the values, so that the
    window can be as long as an encoder's steps at a slow speed ask for: noise in a
    regressor would pull b towards 0.

    Examples
    --------
    >>> t = np.arange(1000) / 1000.0
    >>> angle = np.sin(9.0 * t)
    >>> law = 2.0 * 9.0 * np.cos(9.0 * t) + 3.0 * angle
    >>> x, v, _, torque = filter_alike(angle, law, 0.001, 0.25)
    >>> bool(np.allclose(torque, 2.0 * v + 3.0 * x, atol=1e-3))
    True
    """
    length = window_length(window, period)
    weights = np.hanning(length + 2)[1:-1]
    weights /= weights.sum()
    means = np.convolve(angle, weights, mode="valid")
    resistance = np.convolve(torque, weights, mode="valid")
    velocity = (means[2:] - means[:-2]) / (2.0 * period)
    acceleration = (means[2:] - 2.0 * means[1:-1] + means[:-2]) / period**2
    return means[1:-1], velocity, acceleration, resistance[1:-1]


def bandwidth(window: float, period: float) -> float:
    """Frequency at which the filter passes 1/√2 of a speed.

    Parameters
    ----------
    window, period : float
        Length of the window and time between samples, s.

    Returns
    -------
    float
        The first such frequency, Hz.

    Examples
    --------
    >>> round(bandwidth(0.06, 0.001), 1)
    20.5
    """
    length = window_length(window, period)
    weights = savgol_coeffs(length, ORDER, deriv=1, delta=period, use="dot")
    places = (np.arange(length) - length // 2) * period
    frequencies = np.linspace(0.0, 0.5 / period, 20_001)[1:]
    for part in np.array_split(frequencies, 200):
        turn = 2.0 * math.pi * part
        # response to e^(iωt) over that of d/dt, iω; the weights are odd
        gain = (weights @ np.sin(np.outer(places, turn))) / turn
        low = gain < math.sqrt(0.5)
        if low.any():
            return float(part[np.argmax(low)])
    return float(frequencies[-1])


def state_at_break(
    time: Floats, angle: Floats, at: float
) -> tuple[float, float, float]:
    """Angle, velocity and acceleration at an instant when a hand meets resistance.

    Parameters
    ----------
    time : ndarray, shape (n_samples,)
        Times around it, s.
    angle : ndarray, shape (n_samples,)
        Angle as the encoder reads it, rad.
    at : float
        The instant, s.

    Returns
    -------
    tuple of three float
        Angle (rad), velocity (rad/s), and the acceleration just before (rad/s²).

    Notes
    -----
    At a catch torque steps: angle and velocity are continuous, acceleration is not,
    and a filter that knows nothing of it would put part of the later slowing before
    it. Two cubics that share angle and velocity at the instant are fitted to the
    0.1 s before and the 0.1 s after.

    Examples
    --------
    >>> t = np.arange(0.0, 0.4, 0.001)
    >>> angle = t - 2.0 * np.maximum(t - 0.2, 0.0) ** 2
    >>> [round(x, 9) + 0.0 for x in state_at_break(t, angle, 0.2)]
    [0.2, 1.0, 0.0]
    """
    near = (time >= at - BEFORE) & (time <= at + AFTER)
    since = (time[near] - at) / BEFORE
    early, late = np.minimum(since, 0.0), np.maximum(since, 0.0)
    columns = [np.ones_like(since), since, early**2, late**2, early**3, late**3]
    design = np.stack(columns, axis=1)
    values = np.linalg.lstsq(design, angle[near], rcond=None)[0]
    return (
        float(values[0]),
        float(values[1]) / BEFORE,
        2.0 * float(values[2]) / BEFORE**2,
    )
