"""Missions being planned, for several vehicles at once: what they are, what they cost, where they meet. No Textual."""
