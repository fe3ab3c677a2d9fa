"""MANUAL_CONTROL's numbers."""

RELEASE = 32767
"""Not for this vehicle: its receiver's stick counts."""
RELEASED = (RELEASE, RELEASE, RELEASE, RELEASE)
