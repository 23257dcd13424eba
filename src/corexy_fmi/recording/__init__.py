"""Recordings: what was commanded and what was measured, over time."""

from corexy_fmi.recording.inputs import check_drive, controller, inputs, is_dc
from corexy_fmi.recording.lost import with_lost_rows
from corexy_fmi.recording.read import read_recording
from corexy_fmi.recording.record import INPUTS, MEASURED, Recording
from corexy_fmi.recording.stamps import with_even_stamps
from corexy_fmi.recording.write import write_checked, write_recording

__all__ = [
    "INPUTS",
    "MEASURED",
    "Recording",
    "check_drive",
    "controller",
    "inputs",
    "is_dc",
    "read_recording",
    "with_even_stamps",
    "with_lost_rows",
    "write_checked",
    "write_recording",
]
