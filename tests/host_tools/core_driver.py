"""A small core for the tools' tests: the real core-side Link, two parameters, two stores, on a pty of its own.

It can be told to misbehave: silent, garbage, another schema, locked, or gone after the first answer.
"""

import contextlib
import os
import threading
import time
import tty

from protocol import schema, tables
from protocol.link import Link
from protocol.messages import BY_NAME

PARAMETERS = (      # name, unit, count, minimum, maximum, default
    ("speed_max", "mm/s", 1, 50, 1000, 300),
    ("ir_bearing", "BAM", 8, -32768, 32767, 0),
)
STORES = (("vectors", 5, 768, 6), ("hits", 0, 64, 8))


class CoreDriver:
    def __init__(self, kind="good"):
        self.kind = kind
        self.values = [[row[5]] * row[2] for row in PARAMETERS]
        self.link = Link(boot_id=77)
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave = slave
        self._over = threading.Event()
        os.set_blocking(self.master, False)
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join(5)
        self._close()

    def _close(self):
        for name in ("master", "_slave"):
            if getattr(self, name) >= 0:
                os.close(getattr(self, name))
                setattr(self, name, -1)

    def _run(self):
        hello_at = 0.0
        while not self._over.is_set():
            if self.kind == "garbage":
                self._write(b"no frame at all\0")
            elif self.kind != "silent" and self.link.epoch == 0 and time.monotonic() > hello_at:
                hello_at = time.monotonic() + 0.5
                self._hello()
            data = bytearray(self._read())
            at = 0
            while at < len(data):
                at = self.link.feed(data, at, len(data))
                if self.link.message_id and self.kind not in ("silent", "garbage"):
                    self._answer()
                if self.link.message_id == tables.PARAM_LIST and self.kind == "gone":
                    return self._close()
                if self.link.tx_len:
                    self._write(bytes(self.link.tx[:self.link.tx_len]))
            time.sleep(0.002)

    def _read(self):
        with contextlib.suppress(BlockingIOError):
            return os.read(self.master, 4096)
        return b""

    def _write(self, data):
        with contextlib.suppress(BlockingIOError):
            os.write(self.master, data)

    def _hello(self):
        self.link.send_hello(1, 2, 0, len(STORES), len(PARAMETERS), 196608, 61000, 40000)
        if self.kind == "old":
            other = BY_NAME["HELLO"](1, 1, 0x1234, 0xABCD, 1, 2, 77, 0, 96, 4, 2, 0, 2, 2, 196608, 61000, 40000)
            for i, value in enumerate(other.values()):
                self.link.out[i] = value
            self.link.send(tables.HELLO)
        self._write(bytes(self.link.tx[:self.link.tx_len]))

    def _send(self, name, *fields):
        values = BY_NAME[name](*fields).values()
        for i, value in enumerate(values):
            self.link.out[i] = value
        self.link.send(BY_NAME[name].ID)

    def _answer(self):
        values, message_id = self.link.values, self.link.message_id
        if message_id == tables.IDENTIFY and values[0] == 2 and values[1] < len(STORES):
            name, used, capacity, record = STORES[values[1]]
            self._send("STORE", values[1], name, used, capacity, record, 0)
        elif message_id == tables.IDENTIFY and values[0] == 4:
            self._send("IDENTITY", 4, values[1], 0, b"")    # as a core that does not tell its schema
        elif message_id == tables.IDENTIFY:
            self._hello()
        elif message_id == tables.STATUS:
            self._send("STATUS_RSP", 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 196608, 62000, 1, 0, 0, 0)
        elif message_id == tables.PARAM_LIST and values[0] < len(PARAMETERS):
            name, unit, count, low, high, default = PARAMETERS[values[0]]
            self._send("PARAM_INFO", values[0], count, low, high, default, unit, name)
        elif message_id in (tables.PARAM_GET, tables.PARAM_SET):
            self._parameter(values[0], values[1], values[2] if message_id == tables.PARAM_SET else None)
        elif message_id != tables.WELCOME:
            self.link.send_error(schema.ERROR_UNKNOWN_ID, message_id, 0)

    def _parameter(self, parameter, index, value):
        status, low, high = schema.PARAM_OK, PARAMETERS[parameter][3], PARAMETERS[parameter][4]
        if value is not None and self.kind == "locked":
            status = schema.PARAM_LOCKED
        elif value is not None and not low <= value <= high:
            status = schema.PARAM_OUT_OF_RANGE
        elif value is not None:
            self.values[parameter][index] = value
        self._send("PARAM_VALUE", parameter, index, status, self.values[parameter][index])
