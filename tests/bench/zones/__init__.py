"""`python -m tests.bench zones`: patrols of zones that nobody chose, previewed, rehearsed and compared.

`scenarios` draws them from a seed, `baseline` is what everybody can write, `flown` measures and prints. Not here: the
zones of the shipped rounds (`tests/bench/planning`).
"""
