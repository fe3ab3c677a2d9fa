"""The guardian planner: a ring of vehicles around a zone that meets intruders outside it.

Entry: `guardian.Guardian`, found by `runtime.registry` under the name "guardian". Each step updates what no sensor has
looked at (`unseen_threats`), computes possible meetings (`intercept`), predicts what each option leads to
(`option_prediction`), chooses (`interception_choice`) and steers (`path_steering`). The circuits are in `ring`.

What always holds: every planned path can be stopped inside the flyable region, and vehicles' ids decide nothing.
Measured results are in docs/planning.md C3. Tours and transits come from `patrol`; avoidance between vehicles is not
needed, because each vehicle keeps its altitude layer.
"""
