"""Checks that every planner must pass before it flies. Vehicles here only follow intents: no simulator, no station."""
