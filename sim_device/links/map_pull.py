# The map as it comes from the core, in pieces, over resets of the core and everything else that breaks off.

import zlib

from protocol import schema
from protocol.messages import BY_NAME
from sim_device.links.peer_errors import PeerError, Refused

STALE_MAX = 5           # so often the map may change while it is read

_MAP_INFO, _MAP_INFO_RSP, _MAP_READ, _MAP_DATA = (BY_NAME[name] for name in ("MAP_INFO", "MAP_INFO_RSP", "MAP_READ", "MAP_DATA"))


# pull(peer): the map's bytes. As many reads are out at once as the core can retain answers. What has come stays when it raises: the
# next pull() goes on behind it if generation, size and check sum are the same, else it begins anew, as it does where the core
# says that the map has changed. None where there is no map; PeerError where what came does not make one.
class MapPull:
    def __init__(self):
        self.info = None
        self.resumed = 0        # times that it went on where it had broken off
        self._data = bytearray()
        self._piece = 0         # bytes that this core sends at once

    def pull(self, peer, dead_s):
        for _ in range(STALE_MAX):
            try:
                info = peer.ask(_MAP_INFO(0), _MAP_INFO_RSP, dead_s=dead_s)
            except Refused:
                return None
            if info != self.info:
                self.info = info
                self._data.clear()
            elif self._data:
                self.resumed += 1
            try:
                self._read(peer, info, dead_s)
                return self._whole(info)
            except Refused as error:
                if error.code != schema.ERROR_STALE:
                    raise
        raise PeerError("the core's map changed %d times while it was read" % STALE_MAX)

    def _read(self, peer, info, dead_s):
        if not self._data and info.size:
            self._data += peer.ask(*_piece(info, 0), dead_s).data
            self._piece = len(self._data)
        offsets = range(len(self._data), info.size, self._piece or 1)
        reads = [_piece(info, offset, min(self._piece, info.size - offset)) for offset in offsets]
        for part in peer.each_answer(reads, dead_s):
            self._data += part.data

    def _whole(self, info):
        data = bytes(self._data)
        crc = zlib.crc32(data[:-4])  # its last four bytes are this sum once more
        if len(data) != info.size or (crc & 0xFFFF, crc >> 16) != (info.crc_lo, info.crc_hi):
            raise PeerError("the core's map of %d bytes came with a wrong check sum: it changed while it was read" % info.size)
        return data


def _piece(info, offset, size=None):
    """The question for what begins there, and which answer fits."""
    place = (info.generation, offset)
    return _MAP_READ(*place), _MAP_DATA, lambda m: (m.generation, m.offset) == place and (
        len(m.data) == size or size is None and 0 < len(m.data) <= info.size)
