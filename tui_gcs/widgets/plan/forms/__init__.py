"""The forms of the plan screen, each beside the module that gives its texts a meaning.

`ZoneForm`, `TeamForm` (with `ParamForm` for a planner's parameters) and `SettingsForm` post texts; `zone_text`,
`team_text` and `settings_text` convert them to parts of a scenario, and back; `SettingsDraft` notes problems.

Always: the text modules are independent of Textual and raise `FieldError` with what is allowed.

Not here: taking the parts into the scenario (`widgets/plan`).
"""
