"""What can be typed after `:`: names of actions, lines with arguments, and the operator's own commands.

Entry points: `entries.entries_of` and `entries.found`; `own_commands.OwnCommands`, which the palette searches and which
takes lines apart. The app and the palette dialog call them.

What always holds: a line gives at most one order, and nothing here carries anything out (`console.command_line` does).
"""
