"""Setting vehicles up on the ground: calibrations, transmitters, airframes, gains, motor tests.

`CalibrationService` leads sensor calibrations as jobs, `RcCalibrationService` the pilot's transmitter,
`AirframeService` and `TuningService` change parameters, `MotorTestService` turns one motor. `Services` makes them; the
station's setup requests call them, and consoles show their prompts.

What always holds: nothing that moves a motor or changes how the vehicle flies starts while it is armed, except gains; a
calibration is ordered once, and copies are sent only where they do no harm; former parameter values are kept. What an
autopilot can calibrate, and its parameter names, are in `core/firmware`.
"""
