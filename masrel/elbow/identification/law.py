"""The law before a catch: b, k and m of (1).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equation (1).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.part import Part

__all__ = ["PreCatchLaw"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PreCatchLaw:
    """b, k and m of (1).

    Attributes
    ----------
    damping, stiffness, inertia : float
        N·m·s/rad, N·m/rad, kg·m².
    """

    damping: float
    stiffness: float
    inertia: float

    def torque(self, part: Part) -> Floats:
        """Torque of (1) without the constant k·θ_rest.

        Parameters
        ----------
        part : Part
            Samples.

        Returns
        -------
        ndarray, shape (n_samples,)
            N·m.
        """
        law = self.damping * part.velocity + self.stiffness * part.angle
        return np.asarray(law + self.inertia * part.acceleration)

    def at(self, catch: Catch) -> float:
        """Torque of (1) at the start of a catch, without the constant.

        Parameters
        ----------
        catch : Catch
            The catch.

        Returns
        -------
        float
            N·m.
        """
        law = self.damping * catch.speed + self.stiffness * catch.angle
        return law + self.inertia * catch.acceleration
