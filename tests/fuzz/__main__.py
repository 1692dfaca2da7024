# Coverage-guided fuzzing, on demand:  python -m tests.fuzz [TARGET ...] [--seconds N]
#
# What it finds is written to tests/fuzz/found/TARGET/, from where the ordinary tests take it: they fail until it is
# mended, and keep it. The inputs that reach new code stay in out/fuzz/TARGET, for the next time.

import argparse
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORPUS = HERE.parents[1] / "out" / "fuzz"
NAMES = ("frames", "can", "slcan", "home", "log", "schema", "faults")
WORDS = ('"name"', '"units"', '"m"', '"outline"', '"obstacles"', '"rooms"', '"start"', '"centre"', '"polygon"', "[[0, 0], [1, 0], [1, 1]]",
         "NaN", "1e309", "-1", "TVSLAM1\n", "drop=", "@step=", "reset@", "cut@", "@up=", "@down=", "20ms")
ALL_SECONDS, MEMORY_MB, SLOW_S, LONGEST = 60, 2048, 20, 4096


def main():
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description="Coverage-guided fuzzing by atheris.", allow_abbrev=False)
    parser.add_argument("targets", metavar="TARGET", nargs="*", default=NAMES, help="some of %s; all by default" % ", ".join(NAMES))
    parser.add_argument("--seconds", type=int, default=ALL_SECONDS, help="for each target (default %d)" % ALL_SECONDS)
    options = parser.parse_args()
    unknown = set(options.targets) - set(NAMES)
    if unknown:
        parser.error("%s is no target; there are %s" % (", ".join(sorted(unknown)), ", ".join(NAMES)))
    try:
        import atheris
    except ImportError:
        print("fuzz: atheris is not installed; pip install 'tvslam[fuzz]' gets it, on Linux for CPython 3.11 to 3.14.", file=sys.stderr)
        return 2
    if len(options.targets) == 1:
        return fuzz(atheris, options.targets[0], options.seconds)
    codes = [subprocess.run([sys.executable, "-m", "tests.fuzz", name, "--seconds", str(options.seconds)]).returncode
             for name in options.targets]
    return max(map(abs, codes))


def fuzz(atheris, name, seconds):
    """Does not return: libFuzzer ends the process, with 77 where something was found."""
    with atheris.instrument_imports(include=["protocol", "firmware_py", "sim_device", "host_tools"]):
        from tests.fuzz.targets import TARGETS
    run, seeds = TARGETS[name]
    corpus, found = CORPUS / name, HERE / "found" / name
    for folder in (corpus, found):
        folder.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(seeds()):
        (corpus / ("seed-%03d" % number)).write_bytes(seed)
    words = CORPUS / "words"
    words.write_text("".join('"%s"\n' % word.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\x0a") for word in WORDS))
    atheris.Setup([sys.argv[0], str(corpus), "-max_total_time=%d" % seconds, "-artifact_prefix=%s%s" % (found, os.sep),
                   "-dict=%s" % words, "-rss_limit_mb=%d" % MEMORY_MB, "-timeout=%d" % SLOW_S, "-max_len=%d" % LONGEST], run)
    atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
