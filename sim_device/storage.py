# What the core keeps over a loss of power: its wishes to the non-volatile memory, one at a time, as it can only answer.

from protocol import schema
from protocol.messages import BY_NAME
from sim_device.links.peer_errors import Refused

WISHES = 65535      # then they count from 1 again
BOOT_MAX = 2000     # exchanges: both slots of the largest memory there can be read through take fewer

_PASSED_OVER = (
    ("damaged", schema.NVM_DAMAGED, "A stored map was passed over: it is not whole, as after a loss of power while it was written."),
    ("foreign", schema.NVM_FOREIGN, "A stored map was passed over: another version of the core wrote it, or one with larger stores."),
)
_LOADED = {
    None: "The core had stored nothing yet: its mission begins again.",
    "outline": "The core has loaded the outline that it had stored, and goes on searching inside.",
    "explored": "The core has loaded the home that it had explored: only the map is built.",
}
_ANEW = "To have the home explored anew, give --nvm another name."
_UNABLE = "This core is of a version that keeps nothing: a loss of power costs its map, and the non-volatile memory stays as it is."

_NVM, _NVM_DONE = BY_NAME["NVM"], BY_NAME["NVM_DONE"]


# parameters(link): what the core at its end is told. begin(peer) before the first step: the core looks for what it kept. serve(peer)
# once behind each answer that says SAVE. `loaded` is what a core found when it began last: None, "outline" or "explored".
class Storage:
    def __init__(self, nvm=None):
        self.nvm = nvm
        self.able = True        # the core can keep something
        self.loaded = None
        self.found = []         # the same of every core that began, and what it passed over
        self.kept = 0           # what the core said last
        self._done = (0, 0, b"")
        self._number = 0        # of the last wish

    def parameters(self, link):
        """None for a core from before there was such a memory: it works without."""
        self.able = "nvm_bytes" in link.dialect.numbers and not link.flaw(("NVM_DONE", "NVM"))
        return {"nvm_bytes": [self.nvm.size]} if self.nvm is not None and self.able else {}

    def begin(self, peer):
        self._done = (0, 0, b"")
        self._number = 0
        self.loaded = None
        self.kept = 0
        if self.nvm is None or not self.able:
            return
        self.nvm.on()
        for _ in range(BOOT_MAX):
            try:
                if not self.serve(peer):
                    break
            except Refused:
                self.able = False
                return
        if self.kept & schema.NVM_KEPT:
            self.loaded = self._phase()
        self.found.append({"loaded": self.loaded, **{name: bool(self.kept & bit) for name, bit, _ in _PASSED_OVER}})

    def sentences(self, again=False):
        """What the core found when it began, or began again, for people."""
        if self.nvm is not None and not self.able:
            return [_UNABLE]
        told = [sentence for _, bit, sentence in _PASSED_OVER if self.kept & bit]
        told += [_LOADED[self.loaded]] if self.loaded or again else []
        return told + [_ANEW] if self.loaded == "explored" and self.nvm.path and not again else told

    def serve(self, peer):
        """One exchange; whether the core wants more."""
        if self.nvm is None or self.nvm.off:
            return False
        # One of another number is a stray of 256 questions ago. "Nothing" may be one, too: then the core says its wish once more.
        fits = (0, self._number % WISHES + 1)
        wish = peer.ask(_NVM_DONE(*self._done), _NVM, lambda m: m.request in fits)
        self._number = wish.request or self._number
        self.kept = wish.kept
        status, data = self._do(wish)
        self._done = (wish.request, status, data)
        return wish.operation != schema.NVM_NOTHING

    def _do(self, wish):
        nvm = self.nvm
        if wish.operation == schema.NVM_READ:
            return nvm.read(wish.address, wish.size)
        if wish.operation == schema.NVM_ERASE:
            return nvm.erase(wish.address), b""
        if wish.operation == schema.NVM_PROGRAM:
            return nvm.program(wish.address, wish.data), b""
        return 0, b""

    def _phase(self):
        return None if not self.kept & schema.NVM_KEPT else "explored" if self.kept & schema.NVM_EXPLORED else "outline"

    def figures(self):
        """For the end event; None without a memory."""
        nvm = self.nvm
        return None if nvm is None else {
            "nvm_bytes": nvm.size, "erases": nvm.erases, "programs": nvm.programs, "reads": nvm.reads, "written_bytes": nvm.written,
            "kept": self._phase(),
            "too_small": bool(self.kept & schema.NVM_TOO_SMALL), "failed": bool(self.kept & schema.NVM_FAILED), "found": self.found}
