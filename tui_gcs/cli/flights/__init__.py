"""What commands that fly a scenario share: its changes by options, and the files of its results.

Entry classes: `scenario_options.ScenarioChanges` makes the changes that `rehearse` was given, and `require_fit`
refuses gates that no planner can meet; `metric_files.write` writes metrics and single events as CSV.

What always holds: the scenario's file is never changed, and a mistake is one line that names what there is instead.

Not here: the table of results on the terminal (`cli/result_table.py`) and the flights themselves (`rehearsal`).
"""
