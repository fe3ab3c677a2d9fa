"""Gimbals and cameras of both autopilots, as measured on real ones."""

import math

CONFIGURE, PITCH_YAW, PHOTO, OLD_PHOTO, VIDEO = 1001, 1000, 2000, 203, 2500
ATTITUDE, MANAGER, MANAGER_STATUS, CAMERA = 285, 280, 281, 259
ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
TAKE, OLD_TAKE = (0, 0, 1, 7), (0, 0, 0, 0, 1)
NORTH = 28
"""Flags that lock the yaw against north."""
US = (254, 190)


def fitted(ground, **params):
    for name, value in params.items():
        ground.param(name, value)
    ground.run(0.1)
    ground.heard.clear()
    return ground


def angles(ground):
    """Pitch, yaw and flags as it tells them."""
    ground.command(512, ATTITUDE)
    reported = ground.of("GIMBAL_DEVICE_ATTITUDE_STATUS")[-1]
    w, x, y, z = reported["q"]
    pitch = math.degrees(math.asin(2 * (w * y - z * x)))
    yaw = math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    return round(pitch), round(yaw), reported["flags"]


def test_an_arducopter_without_any_says_failed(booted):
    ground = booted()
    for command in (CONFIGURE, PITCH_YAW, PHOTO, OLD_PHOTO, VIDEO):
        assert ground.command(command) == FAILED
    for message in (ATTITUDE, MANAGER, MANAGER_STATUS):
        assert ground.command(512, message) == FAILED
    assert ground.command(512, CAMERA) == ACCEPTED and not ground.of("CAMERA_INFORMATION")


def test_an_arducopters_gimbal_is_pointed_by_anybody_and_cut_to_what_it_can(booted):
    ground = fitted(booted(), MNT1_TYPE=1)
    assert ground.command(PITCH_YAW, -30, 20, math.nan, math.nan, 12) == ACCEPTED
    assert angles(ground) == (-30, 20, 44)
    assert ground.command(PITCH_YAW, 80, 0, math.nan, math.nan, NORTH) == ACCEPTED, "accepted all the same"
    assert angles(ground) == (20, -90, 60), "told from the nose, which points east"
    assert ground.command(CONFIGURE, *US, -1, -1) == ACCEPTED
    assert ground.command(CONFIGURE, *US, -1, -1) == ACCEPTED
    assert [reported["primary_control_sysid"] for reported in ground.of("GIMBAL_MANAGER_STATUS")] == [254], (
        "once: no news"
    )


def test_owners_above_a_byte_are_cut_off_and_reported(booted):
    ground = fitted(booted(), MNT1_TYPE=1)
    assert ground.command(CONFIGURE, 510, 446, -1, -1) == ACCEPTED
    assert ground.of("GIMBAL_MANAGER_STATUS")[-1]["primary_control_sysid"] == 254
    assert ground.command(CONFIGURE, 3e9, -7, -1, -1) == ACCEPTED


def test_an_arducopters_camera_takes_one_picture_for_each_copy_of_an_order(booted):
    ground = fitted(booted(), CAM1_TYPE=1)
    assert [ground.command(PHOTO, *TAKE) for _ in range(2)] == [ACCEPTED] * 2
    assert ground.command(OLD_PHOTO, *OLD_TAKE) == ACCEPTED
    assert [reported["img_idx"] for reported in ground.of("CAMERA_FEEDBACK")] == [1, 2, 3]
    assert ground.command(VIDEO) == FAILED
    ground.command(512, CAMERA)
    assert ground.of("CAMERA_INFORMATION")[-1]["flags"] == 2


def test_a_px4_without_any_does_not_even_answer(px4):
    ground = px4()
    for command in (CONFIGURE, PITCH_YAW, OLD_PHOTO):
        assert ground.command(command) is None
    assert ground.command(PHOTO, *TAKE) == ground.command(VIDEO) == UNSUPPORTED
    assert not ground.of("GIMBAL_DEVICE_ATTITUDE_STATUS")


def test_a_px4s_gimbal_is_pointed_by_who_has_control(px4):
    ground = fitted(px4(), MNT_MODE_IN=4)
    us = (ground.encoder.system, ground.encoder.component)
    assert ground.command(PITCH_YAW, -30, 20, math.nan, math.nan, 12) == DENIED
    assert ground.command(CONFIGURE, *us, -1, -1) == ACCEPTED
    assert ground.command(PITCH_YAW, -30, 20, math.nan, math.nan, 12) == ACCEPTED
    assert angles(ground) == (-30, 20, 12)
    assert ground.command(PITCH_YAW, 80, 20, math.nan, math.nan, NORTH) == ACCEPTED
    assert angles(ground) == (45, 20, NORTH)
    assert ground.command(CONFIGURE, -3, -3, -1, -1) == ACCEPTED
    ground.run(3.0)
    assert ground.of("GIMBAL_MANAGER_STATUS")[-1]["primary_control_sysid"] == 0, "it tells that unasked"


def test_a_px4s_trigger_knows_the_old_order_only(px4):
    ground = fitted(px4(), TRIG_MODE=1)
    assert ground.command(PHOTO, *TAKE) == UNSUPPORTED
    assert ground.command(OLD_PHOTO, *OLD_TAKE) == ACCEPTED
    assert ground.of("CAMERA_IMAGE_CAPTURED")[-1]["capture_result"] == 1
