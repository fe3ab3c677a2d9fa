"""Simulated vehicles: physics and autopilot manners. Knows MAVLink and nothing of tui_gcs."""
