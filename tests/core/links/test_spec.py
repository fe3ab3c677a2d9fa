"""The grammar of links: every form, every mistake one line that names the forms."""

from string import printable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.links.spec import FORMS, LinkError, LinkSpec, parse_link


@pytest.mark.parametrize(
    ("text", "spec"),
    [
        (
            "udpin:0.0.0.0:14550",
            LinkSpec("udpin:0.0.0.0:14550", "udpin", "0.0.0.0:14550", host="0.0.0.0", port=14550),
        ),
        (
            "udpout:relay.example.org:14550,network=north,secure",
            LinkSpec(
                "udpout:relay.example.org:14550",
                "udpout",
                "relay.example.org:14550",
                host="relay.example.org",
                port=14550,
                network="north",
                secure=True,
            ),
        ),
        ("tcp:[::1]:5760", LinkSpec("tcp:[::1]:5760", "tcp", "[::1]:5760", host="::1", port=5760)),
        (
            "tcpin:[fe80::1%eth0]:5760, highlatency, rate=50",
            LinkSpec(
                "tcpin:[fe80::1%eth0]:5760",
                "tcpin",
                "[fe80::1%eth0]:5760",
                host="fe80::1%eth0",
                port=5760,
                high_latency=True,
                bytes_per_s=50,
            ),
        ),
        (
            "serial:/dev/ttyUSB0",
            LinkSpec("serial:/dev/ttyUSB0", "serial", "/dev/ttyUSB0", device="/dev/ttyUSB0", bytes_per_s=4032),
        ),
        (
            "serial:/dev/ttyACM0:921600,secure",
            LinkSpec(
                "serial:/dev/ttyACM0:921600",
                "serial",
                "/dev/ttyACM0:921600",
                device="/dev/ttyACM0",
                baud=921600,
                secure=True,
                bytes_per_s=64512,
            ),
        ),
        (
            "replay:logs/flight 3.tlog,network=old",
            LinkSpec("replay:logs/flight 3.tlog", "replay", "logs/flight 3.tlog", network="old"),
        ),
    ],
)
def test_every_form(text: str, spec: LinkSpec) -> None:
    assert parse_link(text) == spec


def test_a_device_named_by_its_path_has_colons_of_its_own() -> None:
    device = "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0"
    assert parse_link(f"serial:{device}").device == device
    spec = parse_link(f"serial:{device}-port0:115200")
    assert (spec.device, spec.baud) == (f"{device}-port0", 115200)


def test_the_rate_of_a_serial_line_can_be_set() -> None:
    assert parse_link("serial:/dev/ttyUSB0:57600,rate=1000").bytes_per_s == 1000


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "unknown kind ''"),
        ("com3", "unknown kind 'com3'"),
        ("udp:0.0.0.0:14550", "unknown kind 'udp', which is udpin here"),
        ("UDPIN:127.0.0.1:14550", "unknown kind 'UDPIN'"),
        ("udpin", "not HOST:PORT"),
        ("udpin:14550", "not HOST:PORT"),
        ("udpin::14550", "not HOST:PORT"),
        ("udpin:127.0.0.1:", "not HOST:PORT"),
        ("udpin:127.0.0.1:http", "not HOST:PORT"),
        ("udpin:127.0.0.1:１４５５０", "not HOST:PORT"),
        ("udpin:127.0.0.1:-1", "not HOST:PORT"),
        ("udpin:127.0.0.1:0", "port 0 is not within 1…65535"),
        ("tcp:127.0.0.1:70000", "port 70000 is not within 1…65535"),
        ("tcp:::1:5760", "an IPv6 address goes in brackets"),
        ("tcp:[::1:5760", "an IPv6 address goes in brackets"),
        ("tcp:[::g]:5760", "'[::g]' is no IPv6 address"),
        ("tcp:[127.0.0.1]:5760", "is no IPv6 address"),
        ("udpin:" + "x" * 300 + ":14550", "is no host name"),
        ("udpin:a b:14550", "'a b' is no host name"),
        ("udpin:-x:14550", "'-x' is no host name"),
        ("udpin:127.0.0.1:14550\n", "a character in it cannot be printed"),
        ("udpin:\x1b]0;x\x07:14550", "a character in it cannot be printed"),
        ("udpin:127.0.0.1:14550" + ",secure" * 200, "too long"),
        ("udpin:127.0.0.1:14550,", "unknown option ''"),
        ("udpin:127.0.0.1:14550,fast", "unknown option 'fast'"),
        ("udpin:127.0.0.1:14550,secure=1", "unknown option 'secure=1'"),
        ("udpin:127.0.0.1:14550,secure,secure", "option 'secure': given twice"),
        ("udpin:127.0.0.1:14550,rate=1,rate=2", "option 'rate=2': given twice"),
        ("udpin:127.0.0.1:14550,network=", "network '' is not 1 to 16 of a-z, 0-9 and -"),
        ("udpin:127.0.0.1:14550,network=North", "network 'North' is not"),
        ("udpin:127.0.0.1:14550,network=" + "n" * 17, "is not 1 to 16 of"),
        ("udpin:127.0.0.1:14550,rate=0", "rate '0' is not a number of bytes per second"),
        ("udpin:127.0.0.1:14550,rate=1e3", "rate '1e3' is not a number of bytes per second"),
        ("udpin:127.0.0.1:14550,rate=9999999999", "is not a number of bytes per second"),
        ("serial:", "not DEVICE or DEVICE:BAUD"),
        ("serial::57600", "not DEVICE or DEVICE:BAUD"),
        ("serial:/dev/:57600", "not DEVICE or DEVICE:BAUD"),
        ("serial:/dev/ttyUSB0:", "baud '' is not a number"),
        ("serial:/dev/ttyUSB0:fast", "baud 'fast' is not a number"),
        ("serial:/dev/ttyUSB0:0", "baud '0' is not a number within"),
        ("serial:/dev/ttyUSB0:99999999", "baud '99999999' is not a number within"),
        ("replay:", "not a FILE.tlog"),
        ("replay:.tlog", "not a FILE.tlog"),
        ("replay:flight.bin", "not a FILE.tlog"),
        ("memory", "unknown kind 'memory'"),
    ],
)
def test_every_mistake_is_one_line_that_names_the_forms(text: str, why: str) -> None:
    with pytest.raises(LinkError) as caught:
        parse_link(text)
    line = str(caught.value)
    assert why in line
    assert line.endswith(f"; allowed: {FORMS}")
    assert line.isprintable()
    assert len(line) < 600


WORDS = """udpin udpout tcp tcpin serial replay : :: , = [ ] ::1 127.0.0.1 localhost /dev/ttyUSB0 .tlog 0 14550 65536
57600 network north secure highlatency rate % / . - \x00 \ud800 é"""
PIECES = st.sampled_from([" ", *WORDS.split()])
NEARLY = st.lists(PIECES, max_size=14).map("".join)


@given(st.one_of(st.text(max_size=60), st.text(printable, max_size=60), NEARLY))
def test_nothing_but_a_link_or_a_link_error(text: str) -> None:
    try:
        spec = parse_link(text)
    except LinkError as error:
        assert str(error).isprintable()
        assert FORMS in str(error)
        return
    assert spec.name == f"{spec.scheme}:{spec.place}"
    assert parse_link(spec.name).name == spec.name
    assert spec.scheme in ("serial", "replay") or (spec.host and 1 <= spec.port <= 65535)
    assert spec.name.isprintable()


@given(
    scheme=st.sampled_from(["udpin", "udpout", "tcp", "tcpin"]),
    host=st.one_of(st.ip_addresses(v=4).map(str), st.ip_addresses(v=6).map(lambda ip: f"[{ip}]")),
    port=st.integers(1, 65535),
    network=st.from_regex(r"[a-z0-9-]{1,16}", fullmatch=True),
    rate=st.integers(1, 10**9),
)
def test_what_is_written_is_what_is_meant(scheme: str, host: str, port: int, network: str, rate: int) -> None:
    spec = parse_link(f"{scheme}:{host}:{port},rate={rate},network={network}")
    assert (spec.scheme, spec.host, spec.port) == (scheme, host.strip("[]"), port)
    assert (spec.network, spec.bytes_per_s, spec.secure, spec.high_latency) == (network, rate, False, False)
