"""The widgets of the rehearsals screen: rehearsals, their gates, what was changed in the scenario since, and a panel.

Always: text of files is drawn as text, never as markup. Not here: keys and processes (`screens/rehearsals`), reading of
files (`core/records/rehearsal_files.py`).
"""
