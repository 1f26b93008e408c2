"""The schedules of a study: who meets which model when, drawn once and kept.

Goes in: a protocol. Comes out: for each rater and session a schedule file that
names the models, and a blinded sheet that does not.
"""

from masrel.lab.schedule._secret import copy_for_site, site_of_copy
from masrel.lab.schedule.presentation import (
    Presentation,
    Schedule,
    check_schedule,
    draw_schedule,
    read_schedule,
)
from masrel.lab.schedule.sheets import (
    concealment_notes,
    schedule_problems,
    write_schedules,
)

__all__ = [
    "Presentation",
    "Schedule",
    "check_schedule",
    "concealment_notes",
    "copy_for_site",
    "draw_schedule",
    "read_schedule",
    "schedule_problems",
    "site_of_copy",
    "write_schedules",
]
