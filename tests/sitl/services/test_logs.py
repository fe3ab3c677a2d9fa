"""Logs as both autopilots were measured to keep and send them."""

import pytest

from tests.sitl.rigs.store_rig import Bench

WHOLE = 0xFFFFFFFF


@pytest.fixture
def copter():
    return Bench("ardupilot")


@pytest.fixture
def px4():
    bench = Bench("px4")
    bench.platform.logs.power_on(0)
    return bench


def fly(bench: Bench, seconds: float) -> None:
    bench.platform.state.armed = True
    bench.platform.logs.motors(bench.platform.clock.now_us, on=True)
    bench.run(seconds)
    bench.platform.state.armed = False
    bench.platform.logs.motors(bench.platform.clock.now_us, on=False)


def list_logs(bench: Bench) -> list[dict]:
    bench.forget()
    bench.say("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    bench.run(0.1)
    return bench.of("LOG_ENTRY")


def content(bench: Bench) -> bytes:
    data = b""
    for fields in bench.of("LOG_DATA"):
        assert fields["ofs"] == len(data)
        data += bytes(fields["data"][: fields["count"]])
    return data


def beat(bench: Bench) -> None:
    bench.platform.state.gcs_last_heard_us = bench.platform.clock.now_us


class TestArduPilot:
    def test_without_a_log_one_entry_says_so(self, copter):
        (entry,) = list_logs(copter)
        assert (entry["id"], entry["num_logs"], entry["size"]) == (0, 0, 0)

    def test_a_log_begins_with_the_first_arming_and_all_flights_go_into_it(self, copter):
        fly(copter, 2.0)
        fly(copter, 3.0)
        copter.run(2.0)
        (entry,) = list_logs(copter)
        assert (entry["id"], entry["num_logs"], entry["last_log_num"]) == (1, 1, 1)
        assert entry["size"] == pytest.approx(420_000, rel=0.01)

    def test_it_grows_a_little_after_disarming(self, copter):
        fly(copter, 5.0)
        before = list_logs(copter)[0]["size"]
        copter.run(2.0)
        assert list_logs(copter)[0]["size"] > before

    def test_data_comes_at_151_kb_per_second_and_the_last_frame_is_short(self, copter):
        fly(copter, 1.0)
        copter.run(2.0)
        size = list_logs(copter)[0]["size"]
        beat(copter)
        copter.forget()
        copter.say("LOG_REQUEST_DATA", id=1, ofs=0, count=WHOLE)
        copter.run(0.5)
        assert len(content(copter)) == pytest.approx(75_500, rel=0.02)
        copter.run(1.0)
        data = content(copter)
        assert (len(data), data[:2]) == (size, b"\xa3\x95")
        assert copter.last("LOG_DATA")["count"] == size % 90

    def test_the_same_bytes_every_time(self, copter):
        fly(copter, 1.0)
        copter.run(2.0)
        log = copter.platform.logs.files[0]
        whole = log.read(0, 100_000, copter.platform.clock.now_us)
        assert whole[4000:4090] == log.read(4000, 90, copter.platform.clock.now_us)
        assert whole[65_500:65_590] == log.read(65_500, 90, copter.platform.clock.now_us)

    def test_it_stops_for_who_does_not_beat(self, copter):
        fly(copter, 10.0)
        copter.run(2.0)
        beat(copter)
        copter.say("LOG_REQUEST_DATA", id=1, ofs=0, count=WHOLE)
        copter.run(4.0)
        stopped = len(copter.of("LOG_DATA"))
        assert stopped == pytest.approx(3.0 * 1675, rel=0.05)
        beat(copter)
        copter.run(1.0)
        assert len(copter.of("LOG_DATA")) > stopped

    def test_unknown_logs_are_met_with_silence(self, copter):
        copter.say("LOG_REQUEST_DATA", id=7, ofs=0, count=WHOLE)
        copter.run(1.0)
        assert not copter.heard

    def test_arming_waits_for_the_end_of_a_download(self, copter):
        fly(copter, 10.0)
        beat(copter)
        copter.say("LOG_REQUEST_DATA", id=1, ofs=0, count=WHOLE)
        assert copter.platform.logs.downloading
        assert not list_logs(copter)
        assert copter.texts() == ["Log download in progress"]
        copter.say("LOG_REQUEST_END")
        assert not copter.platform.logs.downloading
        assert list_logs(copter)

    def test_armed_nothing_is_given_and_that_is_said_once(self, copter):
        copter.platform.state.armed = True
        for _ in range(2):
            copter.say("LOG_REQUEST_LIST", start=0, end=0xFFFF)
            copter.say("LOG_REQUEST_DATA", id=1, ofs=0, count=WHOLE)
        copter.run(1.0)
        assert copter.texts() == ["Disarm for log download"]
        assert not copter.of("LOG_ENTRY")

    def test_erasing_is_not_acknowledged_and_takes_a_while(self, copter):
        fly(copter, 1.0)
        copter.forget()
        copter.say("LOG_ERASE")
        assert not copter.heard
        assert list_logs(copter)[0]["num_logs"] == 1
        copter.run(5.0)
        assert list_logs(copter)[0]["num_logs"] == 0


class TestPX4:
    def test_it_logs_from_the_boot_to_the_first_disarming(self, px4):
        px4.run(10.0)
        (entry,) = list_logs(px4)
        assert (entry["id"], entry["num_logs"], entry["last_log_num"]) == (0, 1, 1)
        assert entry["size"] == pytest.approx(2_290_000, rel=0.05)
        fly(px4, 1.0)
        px4.run(1.0)
        assert list_logs(px4)[0]["size"] == list_logs(px4)[0]["size"]
        fly(px4, 1.0)
        assert [entry["id"] for entry in list_logs(px4)] == [0, 1]

    def test_data_comes_fast_and_in_whole_frames(self, px4):
        px4.run(1.0)
        list_logs(px4)
        px4.forget()
        px4.say("LOG_REQUEST_DATA", id=0, ofs=1000, count=400)
        px4.run(0.1)
        assert [(f["ofs"], f["count"]) for f in px4.of("LOG_DATA")] == [(1000 + 90 * k, 90) for k in range(5)]
        px4.forget()
        px4.say("LOG_REQUEST_DATA", id=0, ofs=0, count=WHOLE)
        px4.run(0.05)
        assert len(content(px4)) == pytest.approx(100_000, rel=0.05)

    def test_silence_before_a_list_for_unknown_logs_and_after_erasing(self, px4):
        px4.run(1.0)
        for number in (0, 77):
            px4.say("LOG_REQUEST_DATA", id=number, ofs=0, count=WHOLE)
            px4.run(0.1)
            assert not px4.heard
        px4.platform.logs.motors(px4.platform.clock.now_us, on=False)
        px4.say("LOG_ERASE")
        assert not list_logs(px4)

    def test_a_new_request_takes_the_place_of_the_old_one(self, px4):
        px4.run(5.0)
        list_logs(px4)
        px4.say("LOG_REQUEST_DATA", id=0, ofs=0, count=WHOLE)
        px4.run(0.01)
        px4.forget()
        px4.say("LOG_REQUEST_DATA", id=0, ofs=900_000, count=180)
        px4.run(0.1)
        assert [f["ofs"] for f in px4.of("LOG_DATA")] == [900_000, 900_090]
