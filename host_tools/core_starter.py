"""The core of a mission: started as its target wants it, and started anew when it is to be reset."""

from host_tools.hil_options import SLCAN
from host_tools.launch import core_command
from host_tools.qemu import USART, Emulator


# Contract: start() gives what is watched as a Child is, or None where there is no such thing: the core lives in the robot's
# process, or on a board, whose `relay` is it then. reset() ends it without a word, as pulling its plug would, and starts it again.
class CoreStarter:
    def __init__(self, args, children, link, image=None, relay=None, note=lambda text: None):
        self._args = args
        self._children = children
        self._link = link
        self._image = image
        self._relay = relay
        self._note = note
        self._core = None
        self.emulator = None

    def start(self):
        if self._image is not None:
            self._core = self.emulator = self._emulated()
        elif self._relay is not None:
            self._note("Waiting for the core on %s (at most half a minute)." % self._relay.device)
            self._relay.start()
        elif self._args.link != "memory" and not self._args.target.startswith("port:"):
            argv, root = core_command(self._args.target, self._args.heap, self._link)
            self._core = self._children.start("the core", argv, cwd=root)
        return self._core

    def reset(self):
        if self.emulator is not None:
            self.emulator.stop()
        elif self._relay is not None:
            self._relay.pause()
        elif self._core is not None:
            self._core.kill()
        return self.start()

    def stop(self):
        if self.emulator is not None:
            self.emulator.stop()

    def _emulated(self):
        args, link, usart = self._args, self._link, None
        kind, adapter, port = link.partition(":")
        if adapter and kind in SLCAN:
            link, usart = kind, port
        elif args.link == "pty":
            link, usart = USART, link
        emulator = Emulator(self._children, self._image, args.realtime, usart)
        emulator.boot()
        emulator.start_core(link)
        emulator.await_core()
        return emulator
