"""What STAT and MODE of a Puck say.

Source: Barrett WAM Arm User's Manual D1001 AH.00, p. 48.
"""

__all__ = ["ASLEEP", "BROKEN", "IDLE", "READY", "TORQUE"]

ASLEEP, BROKEN, READY = 0, 1, 2  # STAT: in its monitor, in error, or awake
IDLE, TORQUE = 0, 2  # MODE; a puck has others, which this driver does not use
