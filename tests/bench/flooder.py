"""Junk from 64 addresses, as a process of its own: python -m tests.bench.flooder PORT PER_SECOND SECONDS

Noise, text, torn frames and frames with a wrong CRC. Writes "ready", begins with the next line it reads, and tells at
the end how many datagrams it sent.
"""

import contextlib
import random
import socket
import sys
import time

from tests.bench.stream import frames_of, stream

STEP_S = 0.005
KINDS, SOCKETS = 4096, 64


def junk() -> list[bytes]:
    chance = random.Random(7)
    good = [raw for sent in stream(8, 5.0) for raw in frames_of(sent.data)]
    made = []
    for number in range(KINDS):
        raw = bytearray(chance.choice(good))
        noise = chance.randbytes(chance.randrange(1, 300))
        raw[chance.randrange(10, len(raw))] ^= 1 << chance.randrange(8)
        torn = bytes(raw[: chance.randrange(1, len(raw))])
        made.append([noise, b"\xfd" + noise, b"Init ArduCopter V4.6.0\r\n", torn, bytes(raw)][number % 5])
    return made


def main(argv: list[str]) -> int:
    port, per_s, seconds = int(argv[0]), int(argv[1]), float(argv[2])
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(SOCKETS)]
    for udp in sockets:
        udp.setblocking(False)
        udp.connect(("127.0.0.1", port))
    datagrams = junk()
    print("ready", flush=True)
    sys.stdin.readline()
    began_s, sent = time.monotonic(), 0
    while (now_s := time.monotonic() - began_s) < seconds:
        for number in range(sent, int(now_s * per_s)):
            with contextlib.suppress(OSError):
                sockets[number % SOCKETS].send(datagrams[number % KINDS])
            sent = number + 1
        time.sleep(max(0.0, STEP_S - (time.monotonic() - began_s - now_s)))
    print(sent, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
