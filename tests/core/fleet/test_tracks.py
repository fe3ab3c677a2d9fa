"""Targets that vehicles' sensors detect become tracks: through the whole station, from MAVLink bytes."""

import math
import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.fleet.detections import Detection
from tui_gcs.core.fleet.tracks import TargetTracker
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.protocol.bus import FLEET
from tui_gcs.core.protocol.common import FleetFrame, Track, decode

NAN = math.nan
CAMERA = 100
SIGMA_M = 2.0


class Watch:
    """A station with vehicles that detect what a test says."""

    def __init__(self, folder: Path, vehicles: int = 2) -> None:
        self.rig = ServiceRig(folder, *(Peer(i + 1) for i in range(vehicles)))
        self.rig.heard()
        self.station = self.rig.station
        self.random = random.Random(7)
        x, y, _ = self.rig.vehicle(1).telemetry.position_m
        self.base_m = (x, y)
        """The tests' places are metres east and north of vehicle 1."""
        self.ground_m = self.station.picture.fleet.frame.origin.ground_amsl_m
        self.frames: list[FleetFrame] = []
        self.rig.bus.subscribe(FLEET, lambda _, data: self.frames.append(decode(data, FleetFrame)))

    def see(self, vehicle: int, east_m: float, north_m: float, *, noise_m: float = SIGMA_M, **fields: float) -> None:
        """`vehicle` detects something there, 40 m above the ground."""
        frame = self.station.picture.fleet.frame
        x = self.base_m[0] + east_m + self.random.gauss(0.0, noise_m)
        y = self.base_m[1] + north_m + self.random.gauss(0.0, noise_m)
        lat, lon = frame.to_geodetic(x, y)
        said = {
            "tracking_status": 1,
            "lat": round(lat * 1e7),
            "lon": round(lon * 1e7),
            "alt": self.ground_m + 40.0,
            "h_acc": SIGMA_M,
            "v_acc": 3.0,
            "vel_n": NAN,
            "vel_e": NAN,
            "vel_d": NAN,
            "vel_acc": NAN,
            "dist": NAN,
            "hdg": NAN,
            "hdg_acc": NAN,
        }
        peer = self.rig.peers[vehicle]
        peer.out.append(Encoder(peer.system, CAMERA).encode("CAMERA_TRACKING_GEO_STATUS", **(said | fields)))

    def tracks(self) -> tuple[Track, ...]:
        return self.station.picture.tracks.tracks(self.station.records.clock.now())

    def place(self, track: Track) -> tuple[float, float]:
        return track.position_m[0] - self.base_m[0], track.position_m[1] - self.base_m[1]

    def run(self, seconds: float) -> None:
        self.rig.run(seconds)


@pytest.fixture
def watch(tmp_path: Path) -> Watch:
    return Watch(tmp_path)


def test_three_detections_make_a_target_with_place_speed_and_who_saw_it(watch: Watch) -> None:
    for step in range(50):
        watch.see(1 + step % 2, 300.0 - 5.0 * 0.2 * step, 150.0)
        watch.run(0.2)
        if step == 1:
            assert [t.confirmed for t in watch.tracks()] == [False]
    (track,) = watch.tracks()
    assert track.confirmed
    assert track.seen_by == (1, 2)
    assert watch.place(track) == pytest.approx((300.0 - 5.0 * 9.8, 150.0), abs=3.0)
    assert track.position_m[2] == pytest.approx(40.0, abs=1.0)
    assert track.velocity_m_s[0] == pytest.approx(-5.0, abs=1.5)
    assert 0.0 < track.covariance_m2[0] < SIGMA_M**2, "surer than one detection"


def test_the_fleet_frame_carries_tracks_and_its_covariance_grows_unseen(watch: Watch) -> None:
    for _ in range(5):
        watch.see(1, 300.0, 150.0)
        watch.run(0.2)
    assert watch.frames[-1].tracks[0].confirmed
    watch.run(10.0)
    (track,) = watch.frames[-1].tracks
    assert watch.station.records.clock.now() - track.seen_s > 9.0
    assert track.seen_by == ()
    watch.run(6.0)
    assert watch.frames[-1].tracks == ()
    assert any("forgotten" in text for text in watch.rig.texts())


def test_a_false_alarm_is_never_a_target(watch: Watch) -> None:
    for k in range(20):
        watch.see(1, 100.0 + 20.0 * k, 350.0 - 15.0 * k)
        watch.run(0.5)
    assert not any(track.confirmed for track in watch.tracks())
    watch.run(2.0)
    assert watch.tracks() == ()


def test_two_targets_side_by_side_stay_two(watch: Watch) -> None:
    for step in range(60):
        x = 300.0 - 1.0 * step
        watch.see(1, x, 150.0, noise_m=1.0)
        watch.see(1, x, 162.0, noise_m=1.0)
        watch.run(0.2)
    assert [round(watch.place(t)[1]) for t in watch.tracks() if t.confirmed] == [
        pytest.approx(150, abs=3),
        pytest.approx(162, abs=3),
    ]


def test_two_that_cross_keep_their_names(watch: Watch) -> None:
    """Their velocities tell them apart."""
    for step in range(60):
        t = 0.2 * step
        watch.see(1, 250.0 + 8.0 * t, 150.0, noise_m=0.5, vel_n=0.0, vel_e=8.0, vel_d=0.0, vel_acc=1.0)
        watch.see(2, 346.0 - 8.0 * t, 156.0, noise_m=0.5, vel_n=0.0, vel_e=-8.0, vel_d=0.0, vel_acc=1.0)
        watch.run(0.2)
    first, second = (track for track in watch.tracks() if track.confirmed)
    assert (first.id, second.id) == (1, 2)
    assert first.velocity_m_s[0] > 5.0
    assert second.velocity_m_s[0] < -5.0


def test_a_fast_camera_makes_one_track_of_one_target(watch: Watch) -> None:
    for _ in range(100):
        watch.see(1, 300.0, 150.0, noise_m=1.0)
        watch.run(0.02)
    assert len(watch.tracks()) == 1


def test_our_own_vehicles_are_no_targets(watch: Watch) -> None:
    x, y, up_m = watch.station.picture.fleet.vehicles[2].telemetry.position_m
    for _ in range(10):
        watch.see(1, x - watch.base_m[0], y - watch.base_m[1], alt=watch.ground_m + up_m)
        watch.run(0.2)
    assert watch.tracks() == ()
    assert watch.station.picture.tracks.dropped["detection of our own vehicle"] == 10


@pytest.mark.parametrize(
    ("said", "counted"),
    [
        ({"tracking_status": 0}, None),
        ({"lat": 0, "lon": 0}, "detection that makes no sense"),
        ({"lat": 10**9}, "detection that makes no sense"),
        ({"alt": 9e9}, "detection that makes no sense"),
        ({"lat": 481000000, "lon": 90000000}, "detection that makes no sense"),
        ({"vel_n": 9e9, "vel_e": 0.0, "vel_d": 0.0}, "detection that makes no sense"),
    ],
)
def test_nonsense_is_counted_and_not_followed(watch: Watch, said: dict[str, float], counted: str | None) -> None:
    watch.see(1, 300.0, 150.0, **said)
    watch.run(0.1)
    assert watch.tracks() == ()
    assert watch.station.picture.detections.dropped == ({counted: 1} if counted else {})


def test_a_flood_of_detections_is_cut_off(watch: Watch) -> None:
    for k in range(500):
        watch.see(1, 3000.0 * math.cos(k), 3000.0 * math.sin(k))
    watch.run(0.1)
    assert len(watch.tracks()) <= 64
    assert watch.station.picture.detections.dropped["detections too fast"] == 400
    assert watch.station.picture.tracks.dropped["track table full"] > 0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-5e3, 5e3)] * 2, st.floats(0.5, 100.0), st.integers(1, 4)), max_size=60))
def test_whatever_is_seen_the_filter_stays_finite(seen: list[tuple[float, float, float, int]]) -> None:
    tracker = TargetTracker(_NoFleet(), _Silent())  # type: ignore[arg-type]
    for k, (x, y, sigma, vehicle) in enumerate(seen):
        tracker.take(Detection(0.1 * k, vehicle, (x, y, 40.0), sigma, 3.0, None, 3.0))
    for track in tracker.tracks(0.1 * len(seen)):
        assert all(map(math.isfinite, (*track.position_m, *track.velocity_m_s, *track.covariance_m2)))
        assert track.covariance_m2[0] > 0.0 < track.covariance_m2[2]


class _NoFleet:
    vehicles: dict[int, object] = {}


class _Silent:
    def report(self, *_: object, **__: object) -> None:
        """Nothing."""
