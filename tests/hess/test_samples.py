"""What the loop writes has the units and names of a recording."""

from math import degrees

import numpy as np

from masrel.hess._spool import Samples
from masrel.recording import RECORDING_COLUMNS


def test_the_columns_have_the_units_in_their_names() -> None:
    samples = Samples(3)
    assert samples.last_time_s == -np.inf
    samples.add(0.0, 0.5, 1.0, 2.0, 3.0, 0)
    samples.add(0.1, 0.6, 1.1, 2.1, 3.1, 1)
    assert samples.last_time_s == 0.1
    written = samples.columns()
    assert set(written) == set(RECORDING_COLUMNS)
    assert written["angle_deg"].tolist() == [degrees(0.5), degrees(0.6)]
    assert written["velocity_deg_s"].tolist() == [degrees(1.0), degrees(1.1)]
    assert written["model_torque_nm"].tolist() == [2.0, 2.1]
    assert written["command_torque_nm"].tolist() == [3.0, 3.1]
    assert written["phase"].tolist() == [0.0, 1.0]
