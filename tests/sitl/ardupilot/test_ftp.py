"""ArduPilot's file server, as measured."""

import hashlib
import struct

import pytest

from sitl.ardupilot import mission_files, param_pack
from sitl.common.missions import FENCE, MISSION, Item
from tests.sitl.ardupilot.test_mission_protocol import mission, square
from tests.sitl.rigs.ftp_rig import (
    ACK,
    BURST,
    CRC32,
    CREATE,
    LIST,
    LIST_WITH_TIME,
    NAK,
    OPEN,
    READ,
    REMOVE,
    RESET,
    TERMINATE,
    WRITE,
    Client,
)
from tests.sitl.rigs.store_rig import Bench

PACK = b"@PARAM/param.pck"
REAL_PACK = "58adefcc94ded55fdca130086b044e667e803d80fda0982152a570b16fbb15ce"
REAL_PACK_WITH_DEFAULTS = "4862bac0f91bdc36864af9211b2fe0157034cd3895987e03c5828b9b9a829fe0"
"""SHA-256 of what a real ArduCopter gave with 239 bytes a packet."""


@pytest.fixture
def copter():
    return Bench("ardupilot")


@pytest.fixture
def client(copter):
    return Client(copter)


def as_recorded(copter: Bench) -> None:
    """The parameters that the simulation has otherwise."""
    for name, value in (("BATT_CAPACITY", 3300), ("MIS_TOTAL", 1), ("STAT_RUNTIME", 30)):
        copter.platform.params.set(name, value)


class TestParameterFile:
    @pytest.mark.parametrize(("block", "size", "packets"), [(239, 14605, 62), (110, 14624, 133), (80, 14650, 184)])
    def test_its_length_depends_on_the_block_size(self, copter, client, block, size, packets):
        assert client.one(OPEN, PACK).data == struct.pack("<I", 15924)  # announced: always wrong
        *answers, end = client.burst(block)
        assert (len(answers), sum(len(answer.data) for answer in answers)) == (packets, size)
        assert (end.refused, end.offset) == ([6], size)
        assert not any(answer.burst_complete for answer in answers)

    @pytest.mark.parametrize(("block", "size"), [(239, 14770), (110, 14800), (80, 14815)])
    def test_with_defaults(self, copter, client, block, size):
        as_recorded(copter)
        content = client.read(PACK + b"?withdefaults=1", block)
        assert (len(content), content[:2]) == (size, b"\x1c\x67")

    def test_it_is_byte_for_byte_the_one_of_the_real_vehicle(self, copter, client):
        as_recorded(copter)
        assert hashlib.sha256(client.read(PACK)).hexdigest() == REAL_PACK
        assert hashlib.sha256(client.read(PACK + b"?withdefaults=1")).hexdigest() == REAL_PACK_WITH_DEFAULTS

    def test_pace_and_banner(self, copter, client):
        client.one(OPEN, PACK)
        assert len(copter.texts()) == 3
        client.ask(BURST, size=239)
        copter.run(0.3)
        assert len(client.answers()) < 60
        copter.run(0.05)
        assert client.answers()[-1].refused == [6]

    def test_a_part_of_it(self, copter, client):
        content = client.read(PACK + b"?start=100&count=20")
        assert struct.unpack_from("<HHH", content) == (0x671B, 20, 1327)
        assert client.one(OPEN, PACK + b"?start=65535").refused == [2, 22]

    def test_another_block_size_on_the_same_handle_is_refused(self, client):
        client.one(OPEN, PACK)
        assert len(client.one(READ, size=110).data) == 110
        assert client.one(READ, size=80).refused == [2, 22]
        assert len(client.one(READ, size=110, offset=333).data) == 110

    def test_crc(self, copter, client):
        assert client.one(CRC32, PACK).opcode == ACK

    def test_upload(self, copter, client):
        body = bytes([4, 9 << 4 | 0]) + b"RTL_LOIT_X"  # unknown: skipped
        body += struct.pack("<f", 1.0)
        body += bytes([3, 6 << 4]) + b"RTL_ALT" + struct.pack("<i", 2500)
        good = struct.pack("<HHH", 0x671B, 2, 6 + len(body)) + body
        assert client.write(PACK, good).opcode == ACK
        assert copter.platform.params["RTL_ALT"] == 2500
        bad = struct.pack("<HHH", 0x671B, 2, 5 + len(body)) + body.replace(b"\xc4\x09", b"\xc5\x09")
        assert client.write(PACK, bad).opcode == ACK  # refused all the same
        assert copter.platform.params["RTL_ALT"] == 2500

    @pytest.mark.parametrize("cut", range(6, 40, 3))
    def test_damaged_uploads_are_refused(self, copter, cut):
        data = param_pack.pack(copter.platform.params, 239, count=5)
        with pytest.raises(ValueError, match=r"\w"):
            param_pack.unpack(struct.pack("<HHH", 0x671B, 5, cut) + data[6:cut])


class TestMissionFile:
    def test_it_reads_as_the_list(self, copter, client):
        copter.upload(MISSION, mission(300))
        announced = client.one(OPEN, b"@MISSION/mission.dat").data
        assert announced == struct.pack("<I", 1 << 20)
        client.ask(TERMINATE)
        content = client.read(b"@MISSION/mission.dat")
        assert len(content) == 10 + 300 * 38
        assert struct.unpack_from("<HHHHH", content) == (0x763D, 0, 0, 0, 300)
        assert content[10:] == b"".join(item.packed(seq, MISSION) for seq, item in enumerate(copter.download(MISSION)))

    def test_upload_of_all_three_kinds(self, copter, client):
        copter.upload(MISSION, mission(5))
        copter.upload(FENCE, square())
        files = {name: client.read(b"@MISSION/" + name) for name in (b"mission.dat", b"fence.dat")}
        for kind in (MISSION, FENCE):
            copter.say("MISSION_CLEAR_ALL", mission_type=kind)
        copter.forget()
        for name, content in files.items():
            assert client.write(b"@MISSION/" + name, content).opcode == ACK
        assert (len(copter.platform.plans.mission), len(copter.platform.plans.fence)) == (5, 4)
        assert "Fence Indexed OK" in copter.texts()

    @pytest.mark.parametrize(
        "spoil",
        [
            lambda data: b"\0\0" + data[2:],
            lambda data: data[:-38],
            lambda data: data[: 10 + 38] + bytes(38) + data[10 + 76 :],
        ],
        ids=["magic", "cut short", "gap"],
    )
    def test_a_refused_upload_is_acknowledged_and_the_old_plan_stays(self, copter, client, spoil):
        copter.upload(MISSION, mission(7))
        good = client.read(b"@MISSION/mission.dat")
        copter.upload(MISSION, mission(4))
        assert client.write(b"@MISSION/mission.dat", spoil(good)).opcode == ACK
        assert len(copter.platform.plans.mission) == 4

    def test_a_bad_item_leaves_those_before_it(self, copter, client):
        items = mission(7)
        items[3] = Item(9999)
        body = b"".join(item.packed(seq, 0) for seq, item in enumerate(items))
        assert client.write(b"@MISSION/mission.dat", mission_files.HEADER.pack(0x763D, 0, 0, 0, 7) + body).opcode == ACK
        assert len(copter.platform.plans.mission) == 3

    def test_a_bad_fence_is_told_in_texts_only(self, copter, client):
        copter.upload(FENCE, square())
        items = [*square()[:3], Item(5001, 0, p1=7.0)]
        body = b"".join(item.packed(seq, 1) for seq, item in enumerate(items))
        copter.forget()
        assert client.write(b"@MISSION/fence.dat", mission_files.HEADER.pack(0x763D, 1, 0, 0, 4) + body).opcode == ACK
        assert copter.texts()[-1] == "Fence validation failed"
        assert copter.platform.plans.fence[3].p1 == 4.0

    def test_it_cannot_be_read_while_it_is_written(self, client):
        client.one(CREATE, b"@MISSION/mission.dat")
        assert client.one(READ, size=10).refused == [1]


class TestLists:
    def test_root(self, client):
        assert client.one(LIST, b"/").data == b"D.\0\0D..\0\0Dterrain\0\0D@ROMFS\0\0D@SYS\0\0"
        assert client.one(LIST, b"/", offset=5).refused == [6]

    def test_read_only_files(self, client):
        assert b"Dmodels\0\0" in client.one(LIST, b"@ROMFS").data

    def test_system_files(self, client):
        data = client.one(LIST, b"@SYS/").data
        assert data.count(b"\0\0") == 8
        assert b"Fthreads.txt\t100000\0\0" in data
        assert b"Fstorage.bin\t16384\0\0" in data
        for name in (b"threads", b"dma", b"memory", b"timers"):
            assert client.one(OPEN, b"@SYS/%s.txt" % name).refused == [10], "listed only"
        assert client.one(OPEN, b"@SYS/tasks.txt").data == struct.pack("<I", 100_000)
        assert client.one(READ, size=239).data == b"TasksV2\n"
        assert client.one(READ, size=239, offset=8).refused == [6]

    def test_the_list_of_ports_is_that_of_a_real_one(self, client):
        """729 bytes in four blocks, as recorded."""
        client.one(OPEN, b"@SYS/uarts.txt")
        text = b"".join(client.one(READ, size=239, offset=at).data for at in (0, 239, 478, 717))
        assert len(text) == 729 and text.startswith(b"UARTV1\nSERIAL0 TX=")
        assert client.one(READ, size=239, offset=729).refused == [6]

    @pytest.mark.parametrize("path", [b"@PARAM", b"@MISSION", b"/logs", b"/nosuch", b"../x"])
    def test_what_cannot_be_listed(self, client, path):
        assert client.one(LIST, path).refused == [10]

    def test_unknown_requests_are_told(self, copter, client):
        assert client.one(LIST_WITH_TIME, b"/").refused == [1]
        assert copter.texts() == ["Unsupported FTP: 16"]

    def test_long_lists_go_on_at_an_offset(self, client):
        for number in range(40):
            client.write(f"file-number-{number}".encode(), b"x")
        names, offset = [], 0
        while not (answer := client.one(LIST, b"/", offset=offset)).refused:
            entries = answer.data.split(b"\0\0")[:-1]
            names += entries
            offset += len(entries)
        assert sum(name.startswith(b"Ffile-number-") for name in names) == 40
        assert len(names) == len(set(names))

    def test_logs_are_files_once_there_are_any(self, copter, client):
        copter.platform.logs.motors(0, on=True)
        copter.run(1.0)
        copter.platform.logs.motors(copter.platform.clock.now_us, on=False)
        copter.run(2.0)
        assert b"F00000001.BIN\t140000\0\0" in client.one(LIST, b"/logs").data
        client.one(OPEN, b"/logs/00000001.BIN")
        answers = client.burst(seconds=3.0)
        assert (len(answers), answers[-1].burst_complete) == (500, 1)


class TestFiles:
    def test_round_trip(self, client):
        client.write(b"note.txt", b"hello" * 100)
        assert client.read(b"note.txt") == b"hello" * 100
        assert client.one(REMOVE, b"note.txt").opcode == ACK
        assert client.one(OPEN, b"note.txt").refused == [10]

    def test_a_station_cannot_fill_the_memory(self, client):
        client.one(CREATE, b"big")
        assert client.one(WRITE, b"x", offset=1 << 30).refused == [2, 28]


class TestSessions:
    def test_only_one_for_everybody(self, copter, client):
        client.one(OPEN, PACK)
        assert client.one(OPEN, PACK).refused == [1]
        other = Client(copter, system=250, session=7)
        assert other.one(OPEN, b"@SYS/tasks.txt").refused == [4]
        assert other.one(TERMINATE).opcode == ACK  # without effect
        assert client.one(READ, size=239).opcode == ACK

    def test_after_3_s_somebody_else_takes_over(self, copter, client):
        client.one(OPEN, PACK)
        other = Client(copter, system=250, session=7)
        copter.run(2.0)
        assert other.one(OPEN, b"@SYS/tasks.txt").refused == [4]  # and this counted, too
        copter.run(2.0)
        assert other.one(OPEN, b"@SYS/tasks.txt").refused == [4]
        copter.run(3.1)
        assert other.one(OPEN, b"@SYS/tasks.txt").opcode == ACK
        assert client.one(READ, size=239).refused == [4]

    def test_there_is_no_timeout_for_its_owner(self, copter, client):
        client.one(OPEN, PACK)
        copter.run(12.0)
        assert client.one(READ, size=239).opcode == ACK

    def test_the_same_session_id_from_another_station_resets_ours(self, copter, client):
        client.one(OPEN, PACK)
        Client(copter, system=250).one(RESET)
        assert client.one(READ, size=239).refused == [10]

    def test_the_trap_of_numbers_after_a_burst(self, copter, client):
        client.one(OPEN, PACK)
        asked = client.seq + 1
        end = client.burst()[-1]
        (again,) = client.send(end.seq - 1, TERMINATE)  # taken for a repetition
        assert (again.opcode, again.request, again.refused) == (NAK, BURST, [6])
        assert client.one(OPEN, PACK).refused == [1]  # the session is still open
        assert client.send(end.seq + 5, TERMINATE)[0].opcode == ACK
        assert end.seq == asked + 63

    def test_requests_wait_for_the_end_of_a_burst(self, copter, client):
        client.one(OPEN, PACK)
        client.ask(BURST, size=239)
        client.seq += 1000
        assert client.ask(TERMINATE) == []
        copter.run(0.5)
        assert client.answers()[-1].request == TERMINATE
