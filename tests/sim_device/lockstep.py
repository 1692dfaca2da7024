# Starts the virtual robot and a core as processes in a folder of their own, for the stories of the session.

import json
import os
import subprocess
import sys
from pathlib import Path

from protocol.host_link import HostLink
from protocol.log import LogReader
from sim_device.links.tap import wire

PROJECT = Path(__file__).resolve().parents[2]
FAKE_CORE = Path(__file__).with_name("fake_core.py")


class Lockstep:
    """Inside `with`, both processes are ours; after it none is left."""

    def __init__(self, folder):
        self.folder = folder
        self.link = folder / "robot"
        self.processes = []

    def sim(self, *arguments, home="studio", json_lines=True, **options):
        command = [sys.executable, "-m", "sim_device", home, "--link", str(self.link), *arguments, *["--json-lines"][:json_lines]]
        return self._start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def core(self, *arguments):
        return self._start([sys.executable, str(FAKE_CORE), str(self.link), *map(str, arguments)])

    def run(self, *sim_arguments, core=(), timeout_s=60, **options):
        """A whole mission: (exit code, events, stderr)."""
        self.core(*core)
        return self.finish(self.sim(*sim_arguments, **options), timeout_s)

    def finish(self, sim, timeout_s=60):
        out, err = sim.communicate(timeout=timeout_s)
        return sim.returncode, [json.loads(line) for line in out.splitlines()], err

    def events_until(self, sim, name):
        """Reads the events of a running robot up to and with the first of that name."""
        events = []
        while not events or events[-1]["event"] != name:
            line = sim.stdout.readline()
            assert line, (events, sim.stderr.read())
            events.append(json.loads(line))
        return events

    def names_left(self):
        return [name for name in os.listdir(self.folder) if os.path.islink(self.folder / name)]

    def _start(self, command, **options):
        process = subprocess.Popen(command, cwd=PROJECT, env={**os.environ, "PYTHONPATH": str(PROJECT)}, **options)
        self.processes.append(process)
        return process

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
            process.wait()
            for stream in (process.stdout, process.stderr):
                if stream:
                    stream.close()


def read_log(path):
    """(reader, records) of a log file."""
    reader = LogReader()
    return reader, reader.feed(path.read_bytes())


def messages(records):
    """Every message of a log as the schema names it."""
    found = []
    for record in records:
        link = HostLink(listen=2, any_epoch=True)
        found += link.feed(bytes(wire(record.frame)))
    return found
