"""PX4's file server, as measured, and the metadata that it serves."""

import json
import lzma
import struct

import pytest

from sitl.common.parameters import crc32
from sitl.px4.ftp import METADATA_URI
from tests.sitl.rigs.ftp_rig import (
    ACK,
    BURST,
    CRC32,
    CREATE,
    LIST,
    LIST_WITH_TIME,
    MAKE_DIRECTORY,
    NAK,
    OPEN,
    READ,
    REMOVE,
    RENAME,
    RESET,
    TERMINATE,
    WRITE,
    Client,
)
from tests.sitl.rigs.store_rig import Bench

EVENTS = b"/etc/extras/all_events.json.xz"
PARAMETERS = b"etc/extras/parameters.json.xz"


@pytest.fixture
def px4():
    return Bench("px4")


@pytest.fixture
def client(px4):
    return Client(px4)


def test_metadata_chain(client):
    general = json.loads(lzma.decompress(client.read(METADATA_URI.removeprefix(b"mftp://"))))
    crcs = {entry["type"]: entry["fileCrc"] for entry in general["metadataTypes"]}
    for kind, path, size in ((1, PARAMETERS, 69_332), (4, EVENTS, 17_328)):
        content = client.read(path)
        assert (len(content), crc32(content)) == (size, crcs[kind])
        assert client.one(CRC32, path).data == struct.pack("<I", crcs[kind])


def test_a_burst_is_168_packets_then_it_has_to_be_asked_for_again(client):
    client.one(OPEN, PARAMETERS)
    answers = client.burst(seconds=0.1)
    assert len(answers) == 168
    assert [answer.burst_complete for answer in answers] == [0] * 167 + [1]
    assert answers[-1].offset + len(answers[-1].data) == 40_152
    rest = client.burst(offset=40_152, seconds=0.1)
    assert rest[-1].refused == [6]


def test_one_session_with_the_id_0(px4, client):
    assert client.one(TERMINATE).refused == [4]
    assert client.one(OPEN, EVENTS, session=9).session == 0
    assert client.one(OPEN, EVENTS).refused == [5]
    assert Client(px4, system=250).one(OPEN, EVENTS).refused == [5]
    assert client.one(READ, size=10, session=1).refused == [4]
    assert client.one(TERMINATE).opcode == ACK
    client.one(OPEN, EVENTS)
    assert client.one(RESET).opcode == ACK
    assert client.one(READ, size=10).refused == [4]


def test_without_an_open_file_or_a_right_to_write(client):
    assert client.one(READ, size=10).refused == [4]
    assert client.one(BURST, size=239).refused == [6]
    assert client.one(WRITE, b"x").refused == [2, 0]
    client.one(OPEN, EVENTS)
    assert client.one(WRITE, b"x").refused == [2, 9]


def test_a_forgotten_session_ends_after_10_s_without_requests(px4, client):
    client.one(OPEN, EVENTS)
    for _ in range(16):  # each attempt prolongs it
        px4.run(1.0)
        assert client.one(OPEN, EVENTS).refused == [5]
    px4.run(10.1)
    assert client.one(OPEN, EVENTS).opcode == ACK


def test_the_same_number_again_brings_the_same_answer(client):
    first = client.one(OPEN, EVENTS)
    (again,) = client.send(first.seq - 1, OPEN, EVENTS)
    assert again == first


def test_reading(client):
    assert client.one(OPEN, EVENTS).data == struct.pack("<I", 17_328)
    assert client.one(READ, size=239, offset=17_300).data == client.one(READ, size=28, offset=17_300).data
    assert client.one(READ, size=239, offset=17_328).refused == [6]


def test_lists_have_nameless_entries_that_count(client):
    data = client.one(LIST, b"/").data
    assert data.startswith(b"Dlog\0S\0")
    assert b"Fdataman\t1208528\0" in data
    entries = data.split(b"\0")[:-1]
    assert client.one(LIST, b"", offset=len(entries)).refused == [6]
    extras = client.one(LIST, b"etc/extras").data
    assert b"Fparameters.json.xz\t69332\0" in extras
    assert extras.count(b"S\0") == 2


@pytest.mark.parametrize("path", [b"/fs/microsd", b"@PARAM/param.pck", b"@SYS/uarts.txt", b"../instance_1/err.log"])
def test_what_is_not_there(client, path):
    assert client.one(OPEN, path).refused == [10]
    assert client.one(LIST, path).refused == [10]


def test_a_directory_opens_but_cannot_be_read(client):
    assert client.one(OPEN, b"/etc").data == struct.pack("<I", 4096)
    assert client.one(READ, size=10).refused == [2, 21]


def test_unknown_requests(px4, client):
    assert client.one(LIST_WITH_TIME, b"/").refused == [7]
    assert not px4.texts()


def test_files_can_be_made_renamed_and_removed(client):
    assert client.one(MAKE_DIRECTORY, b"mine").opcode == ACK
    assert client.one(MAKE_DIRECTORY, b"mine").refused == [8]
    client.one(CREATE, b"mine/a")
    assert client.one(WRITE, b"hello", offset=0).data == struct.pack("<I", 5)
    client.one(TERMINATE)
    assert client.one(RENAME, b"mine/a\0mine/b").opcode == ACK
    assert client.read(b"mine/b") == b"hello"
    assert client.one(REMOVE, b"mine/b").opcode == ACK
    assert client.one(REMOVE, b"mine/b").opcode == NAK
