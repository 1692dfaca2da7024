# The robot's end of a CAN bus, and the hub's arm onto the machine's own buses.

import os
import pty
import socket
import time
import tty

import can
from hypothesis import given
from hypothesis import strategies as st
import pytest

from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from sim_device.can_hub import CanHub
from sim_device.links import can_adapter
from sim_device.links.can import CanLink
from sim_device.links.can_frame import LENGTHS, parse
from sim_device.links.can_uplink import line_of, message_of
from sim_device.links.peer import PeerError
from sim_device.links.pty import LinkError
from tests.protocol.messages import seeded, some_frame, wire
from tests.protocol.test_can_frames import UP, cut
from tests.sim_device.can_story import running_hub
from tests.sim_device.test_can_hub import adapter, until

GROUP, PORT = "239.74.163.77", 43113
can_messages = st.builds(
    lambda extended, can_id, fd, fast, data: can.Message(
        arbitration_id=can_id if extended else can_id & 0x7FF, is_extended_id=extended, is_fd=fd, bitrate_switch=fd and fast,
        data=data[:max(n for n in LENGTHS if n <= (len(data) if fd else min(8, len(data))))]),
    st.booleans(), st.integers(0, 0x1FFFFFFF), st.booleans(), st.booleans(), st.binary(max_size=64))


@given(message=can_messages)
def test_a_message_and_its_line_say_the_same(message):
    frame = parse(line_of(message))
    assert frame is not None
    assert message_of(frame).equals(message, timestamp_delta=None, check_direction=False, check_channel=False)


@pytest.mark.parametrize("kind", ["slcan", "slcan-fd"])
def test_frames_pass_both_ways_whole_and_noise_is_passed_over(tmp_path, kind):
    rng = seeded(9)
    with running_hub(tmp_path, "a", "b") as (hub, (a, b)):
        link, far = CanLink("%s:%s" % (kind, a)), adapter(b)
        until(lambda: all(one.open for one in hub.bus.controllers), "both are there")
        frames = [wire(some_frame(rng, UP, seq=i)) for i in range(20)]
        for frame in frames:
            for can_id, data in cut(frame, UP, link.fd):
                far.send(can.Message(arbitration_id=can_id, data=data, is_fd=link.fd, bitrate_switch=link.fd, is_extended_id=False))
            far.send(can.Message(arbitration_id=0x7FF, data=b"others", is_extended_id=False))
            far.send(can.Message(arbitration_id=0x10000261, data=b"others", is_extended_id=True))
            hub.adapters[0]._out.append(b"t2619zz\r\xff\rt\r\a")
        came = []
        until(lambda: take(link, came) == len(frames), "all came")
        assert came == frames and link.read(0) == b""
        ping = HostLink().encode(BY_NAME["PING"](7))
        link.write(ping)
        heard = [far.recv(5) for _ in cut(ping, 0, link.fd)]
        assert [(m.arbitration_id, bytes(m.data)) for m in heard] == cut(ping, 0, link.fd)
        link.close()
        far.shutdown()


def take(link, came):
    """What comes, as long as anything does; how many there are now."""
    while data := link.read(50):
        came.append(data)
    return len(came)


def test_an_adapter_that_goes_is_named(tmp_path):
    with running_hub(tmp_path, "a") as (_, (path,)):
        link = CanLink("slcan:" + path)
    with pytest.raises(PeerError, match="CAN bus slcan:.* closed while in use"):
        for _ in range(50):
            link.read(20)
    link.close()


@pytest.mark.parametrize("text", [b"t12\r", b"t\r", b"D3F00\r", b"B0\r", b"T1\r", b"t1z\r", b"r12\r"])
def test_half_a_frame_from_an_adapter_is_passed_over(text):
    master, slave = pty.openpty()
    tty.setraw(slave)
    link = CanLink("slcan:" + os.ttyname(slave))
    os.write(master, text)
    assert link.read(20) == b""
    link.close()
    os.close(master)
    os.close(slave)


def test_an_adapter_that_is_none_of_ours_cannot_be_made_worse(tmp_path):
    with running_hub(tmp_path, "a", "b") as (hub, (a, _)):
        link = CanLink("slcan:" + a)
        link.worsen([("seed", 4294967295), ("loss", 0.000001)])
        assert hub.bus.faults.loss == 0.000001
        hub.bus.worsen = lambda *_: False   # an adapter of metal says no
        with pytest.raises(LinkError, match="brings no faults about, as only one of sim_device.can_hub does"):
            link.worsen([("loss", 0.1)])
        link.close()


def test_what_is_no_bus_is_one_sentence(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("x")
    for name, words in (("slcan:%s/gone" % tmp_path, "no CAN adapter"), ("slcan:%s/file" % tmp_path, "no CAN adapter"),
                        ("slcan:%s/none" % tmp_path, r"no CAN adapter that can be opened \(no such file or directory\)"),
                        ("socketcan:no_such_can", "no such CAN bus"), ("slcan:", "slcan: is no CAN bus: give")):
        with pytest.raises(LinkError, match=words):
            CanLink(name, wait_s=0.05)
    monkeypatch.setattr(can_adapter.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(LinkError, match=r"msgpack.*pip install 'tvslam\[udp\]'"):
        CanLink("udp")


@pytest.fixture
def udp():
    try:
        bus = can.Bus(interface="udp_multicast", channel=GROUP, hop_limit=0)
        with can.Bus(interface="udp_multicast", channel=GROUP, hop_limit=0) as other:
            other.send(can.Message(arbitration_id=1, is_extended_id=False))
    except (OSError, can.CanError) as error:
        pytest.skip("no UDP multicast on this machine: %s" % error)
    if bus.recv(1.0) is None:
        bus.shutdown()
        pytest.skip("UDP multicast does not come back on this machine")
    yield bus
    bus.shutdown()


def test_the_hub_joins_its_adapters_to_a_bus_of_the_machine_without_an_echo(tmp_path, udp):
    hub = CanHub([str(tmp_path / "a")], uplink="udp:" + GROUP)
    fd = os.open(tmp_path / "a", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    os.write(fd, b"S6\rO\r")
    turns(hub, 0.1)
    os.write(fd, b"t1232ABCD\r")
    udp.send(can.Message(arbitration_id=0x321, data=b"\x01", is_extended_id=False))
    said, end_s = b"", time.monotonic() + 5.0
    while (b"\r" not in said[said.find(b"t"):] or hub.bus.frames < 2) and time.monotonic() < end_s:
        turns(hub, 0.05)
        said += at_hand(fd)
    turns(hub, 0.2)     # for an echo
    said += at_hand(fd)
    heard = [message for message in iter(lambda: udp.recv(0.2), None) if message.arbitration_id == 0x123]
    os.close(fd)
    hub.close()
    assert b"t321101\r" in said and heard, "between two buses of this machine a frame came through, but not by the hub"
    assert said.count(b"t") == 1 and len(heard) == 1 and bytes(heard[0].data) == b"\xab\xcd"
    assert hub.bus.frames == 2, "what the hub itself had sent was not taken for another's"


def test_what_anybody_sends_to_the_group_is_passed_over(udp):
    link = CanLink("udp:" + GROUP)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        stranger.sendto(b"hello", (GROUP, PORT))
    with pytest.raises(can.CanOperationError):
        udp.recv(1.0)   # it is there
    assert link.read(200) == b""
    link.close()


def at_hand(fd):
    try:
        return os.read(fd, 4096)
    except BlockingIOError:
        return b""


def turns(hub, for_s):
    end_s = time.monotonic() + for_s
    while time.monotonic() < end_s:
        hub.turn()
