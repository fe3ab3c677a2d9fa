"""What a vehicle remembers of its calibrations."""

from dataclasses import dataclass, field

REBOOT_ACCELS = "Accels calibrated requires reboot"
REBOOT_COMPASS = "Compass calibrated requires reboot"
COMPASS_RUNNING = "Compass calibration running"
GPS_UNHEALTHY = "GPS 1: not healthy"


@dataclass
class Compass:
    """One compass of a calibration."""

    number: int
    started_us: int
    lasts_us: int

    def done(self, now_us: int) -> bool:
        """Whether there is a report instead of progress."""
        return now_us - self.started_us >= self.lasts_us

    def percent(self, now_us: int) -> int:
        """Progress."""
        return min(100 * (now_us - self.started_us) // self.lasts_us, 99)


@dataclass
class Calibration:
    """Since the last boot."""

    pose: int = 0
    """ArduPilot: the position that is asked for; 0 when none is."""
    pose_stuck: bool = False
    """Set by who wants a calibration to fail: nobody turns the vehicle."""
    accels_us: int | None = None
    """ArduPilot: when accelerometers were calibrated last."""
    unhealthy_until_us: int = 0
    """ArduPilot: samples were missed meanwhile, so the GPS is not trusted for a while."""
    compasses: list[Compass] = field(default_factory=list)
    motors_until_us: int = 0
    """Motors turn for a test: heartbeats say armed."""
    driven: int = 0
    """Which output a motor test drives, from 1; 0 for a motor that is not there: nothing turns, as measured."""
    driven_us: int = 0
    """And how."""
    problems: set[str] = field(default_factory=set)
    """What refuses arming until a reboot."""
    compassmot: bool = False
    """ArduPilot: heartbeats say armed, and other calibrations are refused."""
    kind: str = ""
    """PX4: what is calibrated now."""
    ended_us: int | None = None
    """PX4: when the last one was done."""
    cancels: int = 0

    def refusals(self, now_us: int) -> list[str]:
        """ArduPilot: why it must not be armed."""
        found = sorted(self.problems)
        if any(not compass.done(now_us) for compass in self.compasses):
            found.append(COMPASS_RUNNING)
        if now_us < self.unhealthy_until_us:
            found.append(GPS_UNHEALTHY)
        return found

    def test_motor(self, output: int, throttle: float, until_us: int) -> None:
        """A motor test begins: this output is driven with 0…1 of the throttle."""
        self.driven, self.driven_us, self.motors_until_us = output, round(1000 + 1000 * throttle), until_us

    def outputs_us(self, now_us: int) -> dict[int, int]:
        """What a test drives now, in µs by output; empty outside of one."""
        return {self.driven: self.driven_us} if self.driven and now_us < self.motors_until_us else {}

    def motors_turn(self, now_us: int) -> bool:
        """Whether heartbeats say armed although it is not."""
        return self.compassmot or now_us < self.motors_until_us
