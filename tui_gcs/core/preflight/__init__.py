"""Checks before a start: what keeps vehicles on the ground, and what an operator signs.

Entry classes: `readiness.Readiness` (why one vehicle cannot start; never overridden) and
`checklist.PreflightChecklist` (the list that consoles show, grouped, with acknowledgements and signature). Request
handlers and the status call them.

What always holds: looking changes nothing and sends nothing; a check that refuses names what to do about it; LIVE
vehicles need an operator's signature, SIM ones do not.

Not here: the autopilots' own checks (`core/services/vehicle`, `core/firmware/health.py`).
"""
