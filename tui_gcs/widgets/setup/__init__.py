"""Draws the setup screen: its sections, the lines of one section, and the panel of prompts and reports.

Not here: what needs attention (`core/requests/setup_overview.py`), keys (`screens/setup`).
"""
