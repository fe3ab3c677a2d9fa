"""Power-on to readiness, as measured on the real one (shortened, same order)."""

NEEDS_GUIDED = "Arm: Need Position Estimate"
PREARM_BIT, POSITION_FLAG = 0x10000000, 16


def test_boot_says_the_same_things_in_the_same_order(powered):
    ground = powered()
    ground.run(3.2)

    assert ground.plain[0].startswith(b"\n\nInit ArduCopter")
    assert b"\xfd" not in b"".join(ground.plain)
    order = ["ArduPilot Ready", "AHRS: EKF3 active", "GPS 1: detected u-blox", "EKF3 IMU0 origin set"]
    order.append("EKF3 IMU0 is using GPS")
    texts = ground.texts()
    assert sorted(order, key=texts.index) == order


def test_unasked_only_heartbeats_at_1_hz_texts_home_and_a_rare_timesync(booted):
    ground = booted()
    ground.run(20.0)
    names = {frame.name for _, _, frame in ground.heard}
    assert names == {"HEARTBEAT", "STATUSTEXT", "HOME_POSITION", "GPS_GLOBAL_ORIGIN", "TIMESYNC"}
    assert 22 <= len(ground.of("HEARTBEAT")) <= 24
    assert len(ground.of("TIMESYNC")) == 2


def test_first_heartbeats_say_boot_then_standby(booted):
    ground = booted()
    first, *_, last = ground.of("HEARTBEAT")
    assert (first["system_status"], first["base_mode"]) == (1, 0x59)
    assert (last["system_status"], last["base_mode"], last["custom_mode"]) == (3, 0x51, 0)


def test_a_mode_set_before_ready_is_acknowledged_and_lost(powered):
    ground = powered()
    ground.run(0.6)
    assert ground.mode(4) == 0
    ground.run(3.0)
    assert ground.of("HEARTBEAT")[-1]["custom_mode"] == 0


def test_arming_before_ready_is_refused_with_the_texts_first(powered):
    ground = powered()
    ground.run(0.5)
    said = ground.answers(400, 1)
    assert len(said) == 7
    assert said[0] == "2 Arm: Hardware safety switch"
    assert said[-1] == "ack 4"


def test_guided_is_ready_later_than_stabilize(powered):
    ground = powered()
    ground.run(2.7)
    ground.ask("SYS_STATUS", 10)
    ground.run(0.1)
    assert ground.of("SYS_STATUS")[-1]["onboard_control_sensors_health"] & PREARM_BIT
    ground.mode(4)
    assert ground.answers(400, 1) == ["ack 4", f"2 {NEEDS_GUIDED}"]
    ground.run(0.1)
    assert ground.of("SYS_STATUS")[-1]["onboard_control_sensors_health"] & PREARM_BIT, "still that of STABILIZE"
    ground.run(0.6)
    assert ground.command(400, 1) == 0


def test_the_prearm_bit_is_up_to_a_second_old(powered):
    """Seen on 4.7: just after a change to GUIDED it is what it was in STABILIZE."""
    ground = powered(boot_s=20.0)
    ground.run(17.0)
    ground.ask("SYS_STATUS", 10)
    ground.run(1.4)
    ground.mode(4)
    said = []
    for _ in range(15):
        ground.run(0.1)
        said.append(bool(ground.of("SYS_STATUS")[-1]["onboard_control_sensors_health"] & PREARM_BIT))
    assert said[0] and not said[-1]
    assert said == sorted(said, reverse=True)


def test_position_and_gps_appear_in_the_real_order(powered):
    ground = powered()
    ground.run(1.0)
    for name in ("GPS_RAW_INT", "GLOBAL_POSITION_INT", "EKF_STATUS_REPORT", "LOCAL_POSITION_NED"):
        assert ground.ask(name, 20) == 0
    ground.run(2.2)
    fixes = [m["fix_type"] for m in ground.of("GPS_RAW_INT")]
    assert sorted(set(fixes)) == [0, 1, 6]
    assert fixes == sorted(fixes)
    places = ground.of("GLOBAL_POSITION_INT")
    assert places[0]["lat"] == 0
    assert places[-1]["lat"] == 520720000
    flags = [m["flags"] for m in ground.of("EKF_STATUS_REPORT")]
    assert list(dict.fromkeys(flags)) == [1024, 0, 167, 831]
    assert ground.times("LOCAL_POSITION_NED")[0] > 2.7


def test_reboot_forgets_rates_and_starts_the_clock_again(booted):
    ground = booted()
    ground.ask("ATTITUDE", 10)
    ground.run(1.0)
    assert ground.command(246, 1) == 0
    since = ground.fleet.now_s
    ground.run(4.0)
    assert not ground.of("ATTITUDE", since_s=since + 0.01)
    assert "ArduPilot Ready" in ground.texts(since_s=since)
    ground.ask("ATTITUDE", 10)
    ground.run(0.5)
    assert 4000 < ground.of("ATTITUDE")[-1]["time_boot_ms"] < 5000
