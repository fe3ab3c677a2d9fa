"""Messages that pymavlink's ardupilotmega does not know."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from sitl.links.dialect import NEWER
from sitl.links.wire import LAYOUTS, Encoder, cut

# Published checksum seeds of the messages that real PX4 1.17 was heard to send.
HEARD = {8: 117, 380: 232, 395: 0, 397: 182, 410: 160, 411: 106, 435: 134, 436: 193, 437: 30}


@pytest.mark.parametrize("definition", NEWER, ids=lambda d: d.msgname)
def test_checksum_seed_is_the_one_of_the_standard(definition):
    known = ardupilotmega.mavlink_map.get(definition.id)
    expected = known.crc_extra if known is not None else HEARD.get(definition.id)
    if expected is not None:
        assert definition.crc_extra == expected


def test_opaque_ids_travel():
    frame = Encoder(1).frame(
        "MISSION_ACK", {"target_system": 255, "type": 0, "mission_type": 1, "opaque_id": 0xDEADBEEF}
    )
    assert cut(frame)[0].fields["opaque_id"] == 0xDEADBEEF


def test_texts_and_arrays_travel():
    assert LAYOUTS[410].struct.size == 53
    encoder = Encoder(1)
    frame = encoder.frame("COMPONENT_METADATA", {"file_crc": 7, "uri": b"mftp://etc/x.json.xz"})
    assert cut(frame)[0].fields["uri"].rstrip(b"\0") == b"mftp://etc/x.json.xz"
    event = encoder.frame("EVENT", {"id": 1 << 24, "sequence": 3, "arguments": (1, 2, *(0,) * 38)})
    assert cut(event)[0].fields["arguments"][:3] == (1, 2, 0)
