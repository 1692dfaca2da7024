# Feeds a file of bytes, in pieces of changing size, to a Link, answers PARAM_GET, and prints the trace of what came out.
#   arguments: FILE BOOT_ID
# The trace is a rolling hash over every message and counter, so that it fits without allocation.

import sys
from array import array

from protocol.frame_reader import COUNTERS, DUPLICATES
from protocol.link import Link
from protocol.tables import PARAM_GET, PARAM_VALUE

state = array("i", [0, 0, 0])  # hash, messages, answers


def boot(arguments):
    global link, stream, rx
    with open(arguments[0], "rb") as file:
        stream = file.read()
    link = Link(int(arguments[1]))
    rx = bytearray(97)


def mix(value):
    # two 16-bit halves would do; 29 bits keep every intermediate below 2**30
    state[0] = (state[0] << 3 & 0xFFFFFF8 ^ state[0] >> 21 ^ value & 0xFFFFFF ^ value >> 24 & 63) & 0xFFFFFFF


def locked():
    at = 0
    end = len(stream)
    piece = 1
    while at < end:
        size = 0
        while size < piece and at < end:
            rx[size] = stream[at]
            size += 1
            at += 1
        piece = piece % 97 + 1
        used = 0
        while used < size:
            used = link.feed(rx, used, size)
            if link.message_id:
                state[1] += 1
                mix(link.message_id)
                for k in range(link.count):
                    mix(link.values[k])
                if link.message_id == PARAM_GET:
                    link.out[2] = link.out[3] = 0
                    link.send(PARAM_VALUE)  # retained where the question was reliable
            if link.tx_len:
                state[2] += 1
                for k in range(link.tx_len):
                    mix(link.tx[k])


def report():
    print("hash", state[0], "messages", state[1], "answers", state[2], "epoch", link.epoch, "again", link.counters[DUPLICATES])
    print([link.counters[k] for k in range(COUNTERS)])


if sys.implementation.name != "micropython" and __name__ == "__main__":
    boot(sys.argv[1:])
    locked()
    report()
