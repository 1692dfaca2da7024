# The core behind its link: answers every message, runs a step for each STEP.

from protocol.frame_reader import DUPLICATES
from protocol.link import Link
from protocol.parameters import PARAMETERS
from protocol.tables import (
    WELCOME, IDENTIFY, IDENTITY, PING, PONG, STEP, STEP_RSP, STATUS, STATUS_RSP, STORE,
    MAP_INFO, MAP_INFO_RSP, MAP_READ, MAP_DATA, NVM, NVM_DONE, PARAM_SET, PARAM_GET, PARAM_LIST, PARAM_VALUE, PARAM_INFO,
    ERROR_NOT_READY, ERROR_RANGE, ERROR_STALE, ERROR_STEP_ORDER, PARAM_OK, PARAM_UNKNOWN, PARAMETER_TEXT,
    STATUS_BRIEF,
)

from .collection.states import BUILD
from .identity import VERSION, identity_piece
from .inventory import Inventory, STORES
from .limits import HELLO_MS
from .pipeline import Tvslam
from .telemetry import Telemetry

_PIECE = const(88)            # bytes of the map in a MAP_DATA
_ALL = const(65535)           # pieces of the map
_SECTION_HELLO = const(0)
_SECTION_STORES = const(2)
_SECTION_LINK = const(3)


class Device:
    # receive(buf, size): bytes that a port read, in a bytearray that it lends; answers go out by
    # port.write(buf, size). hello(): say HELLO. Allocates in __init__ only; wire input never raises.
    #
    # Lockstep: STEP n+1 after n runs a step (0 follows 2**30 - 1); n once more runs nothing: the link has its answer
    # retained, and gets the same one in a new frame where it has not (a new epoch); any other number gets ERROR. The first
    # STEP locks the parameters and begins the mission. Free run (parameter tick_ms): the same, at the core's own pace.

    def __init__(self, port, boot_id):
        self.port = port
        self.link = Link(boot_id)  # large arrays first, while the heap is whole
        self.core = Tvslam()
        self.inventory = Inventory(self.core, self.link)
        self.telemetry = Telemetry(self.core, self)
        self.welcomed = False
        self._said_ms = -HELLO_MS
        self.begun = False
        self.step_number = 0
        self.tick_ms = 0        # of the free run; 0: lockstep
        self.due_ms = 0         # the free run's next tick
        self.late_ticks = 0
        self.late_ms = 0

    def greet(self):
        # HELLO, twice a second until somebody answers. For the port's loop.
        if not self.welcomed and (self.port.ticks_ms() - self._said_ms & 0x3FFFFFF) >= HELLO_MS:
            self._said_ms = self.port.ticks_ms()
            self.hello()

    def hello(self):
        p = self.port
        self.link.send_hello(VERSION[7] << 8 | VERSION[9], VERSION[11], 0, STORES, len(PARAMETERS),
                             p.heap_bytes, p.heap_used(), p.heap_code_bytes)
        p.write(self.link.tx, self.link.tx_len)

    def send(self, message_id, items=0):
        size = self.link.send(message_id, items)    # before tx is looked at: it says which buffer that is
        self.port.write(self.link.tx, size)

    def send_store(self, index):
        self.inventory.fill(index)
        self.send(STORE)

    def send_memory(self, message_id):
        self._memory(0)
        self.send(message_id)

    def receive(self, buf, size):
        link = self.link
        at = 0
        while at < size:
            at = link.feed(buf, at, size)
            if link.message_id == STEP:
                self.step()
            elif link.message_id:
                self._answer(link.message_id)
            elif link.tx_len:
                self.port.write(link.tx, link.tx_len)

    def step(self):
        # The STEP in link.values, from the link or from a board's own sensors.
        link = self.link
        step = link.values[0]
        if self.begun and step == self.step_number:
            link.reader.count(DUPLICATES)
            self._answer_step()
            return
        expected = self.step_number + 1 if self.step_number < 0x3FFFFFFF else 0
        if self.begun and step != expected:
            self._error(ERROR_STEP_ORDER, STEP, expected)
            return
        core = self.core
        if not self.begun:
            self.begun = True
            core.begin()
            self.tick_ms = core.parameters.of("tick_ms")
            if self.tick_ms:
                now_ms = self.port.ticks_ms()
                self.due_ms = now_ms - now_ms % self.tick_ms + self.tick_ms
        if self.tick_ms:
            self._await_tick()
        self.step_number = step
        core.step(link.values)
        self._answer_step()
        self.telemetry.after_step(step)

    def _await_tick(self):
        # A STEP waits for the next multiple of tick_ms on the core's own clock. One that comes late runs at once,
        # unless the tick after is nearer: then it is meant for that one. Late are ticks that had no STEP, or that
        # began a millisecond or more after they were due.
        tick_ms = self.tick_ms
        passed = (self._late_by() + tick_ms // 2) // tick_ms
        if passed > 0:
            self.late_ticks += passed
            self.due_ms = self.due_ms + passed * tick_ms & 0x3FFFFFF
        late_ms = -1
        while late_ms < 0:
            late_ms = self._late_by()
            if late_ms < 0:
                self.port.wait(-late_ms)
        if late_ms:
            self.late_ticks += 1
        self.due_ms = self.due_ms + tick_ms & 0x3FFFFFF

    def _late_by(self):
        late_ms = (self.port.ticks_ms() - self.due_ms + 0x2000000 & 0x3FFFFFF) - 0x2000000
        if late_ms > self.late_ms:
            self.late_ms = late_ms
        return late_ms

    def _answer_step(self):
        core = self.core
        out = self.link.out
        out[0] = self.step_number
        out[1] = core.left_mm_s
        out[2] = core.right_mm_s
        out[3] = core.state
        out[4] = core.ir_state
        out[5] = core.hash_lo
        self.send(STEP_RSP)

    def _answer(self, message_id):
        if message_id == WELCOME:
            self.welcomed = True
        elif message_id == IDENTIFY:
            self._identify()
        elif message_id == PING:
            self.link.out[0] = self.link.values[0]
            self.link.out[1] = self.port.ticks_ms()
            self.send(PONG)
        elif message_id == STATUS:
            self._status()
        elif message_id == MAP_INFO:
            self._map_info()
        elif message_id == MAP_READ:
            self._map_read()
        elif message_id == NVM_DONE:
            self.send(NVM, self.core.slots.exchange(self.link.values, self.link.out))
        elif message_id == PARAM_LIST:
            self._parameter_info()
        elif message_id == PARAM_SET or message_id == PARAM_GET:
            self._parameter(message_id)

    def _error(self, code, message_id, detail):
        size = self.link.send_error(code, message_id, detail)
        self.port.write(self.link.tx, size)

    def _identify(self):
        values = self.link.values
        section = values[0]
        offset = values[1]
        if section == _SECTION_HELLO:
            self.hello()
            return
        if section == _SECTION_STORES and offset < STORES:
            self.send_store(offset)
            return
        if section == _SECTION_LINK:
            self.telemetry.tell_link()
            return
        self.send(IDENTITY, identity_piece(section, offset, self.link.out))

    def _status(self):
        brief = self.link.values[0] & STATUS_BRIEF  # before the answer takes its place
        core = self.core
        out = self.link.out
        out[0] = self.step_number
        out[1] = core.state
        out[2] = 1 if core.finished else 0
        out[3] = core.reason
        out[4] = core.degraded
        out[5] = core.hash_lo
        out[6] = core.hash_hi
        whole = not brief and self._whole_image()
        out[7] = core.image.crc[0] if whole else 0
        out[8] = core.image.crc[1] if whole else 0
        out[9] = core.closure.before_mm
        out[10] = core.closure.after_mm
        out[11] = core.explorer.bumper.bumps
        out[12] = core.odometry.path_mm
        self._memory(13)
        out[17] = min(self.late_ticks, 65535)
        out[18] = min(self.late_ms, 65535)
        self.send(STATUS_RSP)

    def _memory(self, at):
        out = self.link.out
        p = self.port
        used = p.heap_used()
        out[at] = p.heap_bytes
        out[at + 1] = used
        out[at + 2] = p.locked
        out[at + 3] = used - p.heap_boot_bytes if used > p.heap_boot_bytes else 0

    def _whole_image(self):
        # The mission's end has it ready; asked for earlier, it is made at once. -> False while the core is about it: to help would
        # change when the mission ends.
        image = self.core.image
        if self.core.state == BUILD:
            return False
        if image.generation != self.core.vectors.generation:
            image.begin()
        while not image.step(_ALL):
            pass
        return True

    def _map_info(self):
        if not self._whole_image():
            self._error(ERROR_NOT_READY, MAP_INFO, 0)
            return
        image = self.core.image
        out = self.link.out
        out[0] = image.generation
        out[1] = image.size
        out[2] = image.crc[0]
        out[3] = image.crc[1]
        self.send(MAP_INFO_RSP)

    def _map_read(self):
        image = self.core.image
        values = self.link.values
        out = self.link.out
        offset = values[1]
        if values[0] != image.generation or image.generation != self.core.vectors.generation or not image.whole:
            self._error(ERROR_STALE, MAP_READ, self.core.vectors.generation)
            return
        if offset < 0 or offset > image.size:
            self._error(ERROR_RANGE, MAP_READ, image.size)
            return
        n = min(image.size - offset, _PIECE)
        out[0] = image.generation
        out[1] = offset
        out[2] = n
        for i in range(n):
            out[3 + i] = image.byte(offset + i)
        self.send(MAP_DATA, n)

    def _parameter(self, message_id):
        values = self.link.values
        out = self.link.out
        table = self.core.parameters
        number = values[0]
        index = values[1]
        if message_id == PARAM_SET:
            status = table.set(number, index, values[2])
        else:
            status = PARAM_OK if table.known(number, index) else PARAM_UNKNOWN
        out[0] = number
        out[1] = index
        out[2] = status
        out[3] = table.values[table.firsts[number] + index] if table.known(number, index) else 0
        self.send(PARAM_VALUE)

    def _parameter_info(self):
        number = self.link.values[0]
        out = self.link.out
        if number >= len(PARAMETERS):
            self._error(ERROR_RANGE, PARAM_LIST, len(PARAMETERS))
            return
        row = PARAMETERS[number]
        out[0] = number
        for i in range(4):
            out[1 + i] = row[2 + i]
        for i in range(32):
            out[5 + i] = PARAMETER_TEXT[number * 32 + i]
        self.send(PARAM_INFO)
