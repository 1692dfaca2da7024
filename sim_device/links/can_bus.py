# A CAN bus with its controllers: who may send next, what is refused, what is lost. Sans-I/O.

from collections import deque

from sim_device.links.bus_faults import BusFaults

QUEUE_MAX = 64
BUS_OFF_S = 128 * 11 / 500_000  # recessive bits after which a controller may come back


# One controller. `queue` holds what it has still to send, in order; `full_for` is how many of the next
# frames find it full whatever is in it, `full_until_s` until when all do, `off_until_s` when it comes back from bus-off:
# these are faults.
class Controller:
    def __init__(self, name):
        self.name = name
        self.open = False
        self.listens_only = False
        self.queue = deque()
        self.queue_max = QUEUE_MAX
        self.full_for = 0
        self.full_until_s = 0.0
        self.off_until_s = 0.0
        self.sent = 0
        self.refused = 0    # the queue was full, the channel closed, or the controller off the bus


# The bus: transmit() gives the bus to the lowest id among what the controllers would send first (arbitration),
# as often as there is somebody else to acknowledge. A frame reaches every other controller that is open and not
# bus-off. No time passes in it: `busy_s` adds up how long a real bus at 500 kbit/s would have been busy.
class CanBus:
    def __init__(self):
        self.controllers = []
        self.frames = 0
        self.busy_s = 0.0
        self.lost = 0
        self.faults = BusFaults()

    def attach(self, name):
        self.controllers.append(Controller(name))
        return self.controllers[-1]

    def offer(self, controller, frame, now_s):
        """Into the controller's queue; False where it takes none."""
        if controller.full_for > 0:
            controller.full_for -= 1
        elif now_s < controller.full_until_s or self.faults.refuses():
            pass
        elif self._on(controller, now_s) and not controller.listens_only and len(controller.queue) < controller.queue_max:
            controller.queue.append(frame)
            return True
        controller.refused += 1
        return False

    def transmit(self, now_s):
        """The next frame on the bus: (frame, its sender, those that get it), or None where there is none. Of others: no sender."""
        if (foreign := self.faults.others()) is not None:
            self._count(foreign)
            return foreign, None, [one for one in self.controllers if self._on(one, now_s)]
        senders = [one for one in self.controllers if one.queue and self._on(one, now_s)]
        if not senders:
            return None
        sender = min(senders, key=lambda one: one.queue[0].rank)
        others = [one for one in self.controllers if one is not sender and self._on(one, now_s)]
        if not any(not one.listens_only for one in others):
            return None     # nobody acknowledges: it will be sent again and again until somebody does
        frame = sender.queue.popleft()
        sender.sent += 1
        self._count(frame)
        self.faults.passed(frame.bus_s)
        if self.faults.loses():
            self.lost += 1
            others = []
        return frame, sender, others

    def _count(self, frame):
        self.frames += 1
        self.busy_s += frame.bus_s

    def worsen(self, by, what, value, now_s):
        """A fault that the controller `by` asks for. Whether there is such a one."""
        if what == "busoff":
            for one in self.controllers:
                if one is not by:
                    self.bus_off(one, now_s, value or BUS_OFF_S)
        elif what == "jam":
            for one in self.controllers:
                one.full_until_s = now_s + value
        else:
            return self.faults.set(what, value)
        return True

    def bus_off(self, controller, now_s, for_s=BUS_OFF_S):
        """Fault: too many errors. What it had to send is gone, and it hears nothing until it comes back by itself."""
        controller.off_until_s = now_s + for_s
        controller.queue.clear()

    def close(self, controller):
        controller.open = False
        controller.queue.clear()

    def _on(self, controller, now_s):
        return controller.open and now_s >= controller.off_until_s

    def figures(self):
        return {"frames": self.frames, "busy_s": round(self.busy_s, 6), "lost": self.lost,
                "refused": sum(one.refused for one in self.controllers)}
