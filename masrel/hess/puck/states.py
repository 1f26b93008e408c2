"""What STAT and MODE of a Puck say.

Source: Barrett WAM Arm User's Manual D1001 AH.00, p. 48.
"""

__all__ = ["ASLEEP", "IDLE", "READY", "TORQUE"]

ASLEEP, READY = 0, 2  # STAT: in its monitor, or awake; 1 is an error
IDLE, TORQUE = 0, 2  # MODE; a puck has others, which this driver does not use
