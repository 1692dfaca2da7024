"""`host_tools budget`: what each store and buffer of the running core costs, byte by byte.

Every size comes from the core by message (HELLO, MEMORY by STATUS, one STORE record a
store); nothing is computed from our own constants. Beside it stands what the
paper's map alone needs.
"""

import sys

from host_tools import core_process, heap_ledger, heap_search
from host_tools.core_process import CoreError
from host_tools.core_session import CoreSession
from host_tools.hil_options import UsageError
from host_tools.replay import check_json, write_json
from protocol.messages import BY_NAME

PAPER_BYTES = 28200     # Paper Table 2: the topological-vector map of 458 vectors takes 28.2 KB
PAPER_VECTORS = 458
STORE_SECTION = 2       # IDENTIFY section that is answered by a STORE record
EXIT_OK = 0
EXIT_NOT_FOUND = 1
EXIT_USAGE = 2


def add_arguments(parser):
    core_process.add_arguments(parser)
    parser.add_argument("--json", metavar="FILE", default=None, help="also write the figures to FILE")
    parser.add_argument("--search", metavar="HOME", nargs="+", default=None,
                        help="on stm32: find the smallest heap in which the core boots and maps these homes, by running it")


def run(args):
    try:
        check_json(args.json)
        figures, lines = _searched(args) if args.search else _measured(args)
    except heap_search.DoesNotFit as error:
        print("budget: %s" % error, file=sys.stderr)
        return EXIT_NOT_FOUND
    except (CoreError, UsageError) as error:
        print("budget: %s" % error, file=sys.stderr)
        return getattr(error, "code", EXIT_USAGE)
    written = write_json("budget", args.json, figures)  # first: whoever reads the lines may go before their end
    for line in lines:
        print(line)
    return EXIT_OK if written else EXIT_USAGE


def _measured(args):
    with core_process.running_core(args.target, args.heap, args.link) as port:
        figures = measure(CoreSession(port), args.target)
        if args.target == "stm32":
            figures |= heap_ledger.figures(port, lambda text: print(text, file=sys.stderr, flush=True))
    lines = report(figures) + (heap_ledger.report(figures) if args.target == "stm32" else [])
    return figures, lines


def _searched(args):
    if args.target != "stm32" or args.heap:
        raise UsageError("--search looks for the heap of --target stm32: give that, and no --heap.")
    missions, heap = heap_search.search(args.search, lambda text: print(text, flush=True))
    return {"target": args.target, "heap_bytes": heap, "missions": missions}, []


def measure(core, target):
    """All that the core says of its memory; what it does not measure on its target is None."""
    hello = core.handshake()
    stores = []
    for index in range(hello.stores):
        store = core.ask(BY_NAME["IDENTIFY"](STORE_SECTION, index), "STORE",
                         lambda got, want=index: got.index == want)
        if store is None:
            raise CoreError("The core has %d stores by its HELLO, but does not describe number %d." % (hello.stores, index))
        stores.append({"name": store.name, "used": store.used, "capacity": store.capacity,
                       "record_bytes": store.record_bytes, "bytes": store.capacity * store.record_bytes})
    status = core.ask(BY_NAME["STATUS"](flags=0), "STATUS_RSP")
    memory = status or hello
    used, code = memory.heap_used_bytes, hello.heap_code_bytes
    return {
        "target": target, "stores": stores, "stores_bytes": sum(store["bytes"] for store in stores),
        "heap_bytes": memory.heap_bytes or None, "heap_used_bytes": used or None, "heap_code_bytes": code or None,
        "heap_data_bytes": used - code if used and 0 < code <= used else None,
        "heap_locked": bool(status.heap_locked) if status else None,
        "allocated_after_boot_bytes": status.allocated_after_boot_bytes if status else None,
        "paper_bytes": PAPER_BYTES,
    }


def report(figures):
    """The figures as a table, then one line on each sum."""
    stores = figures["stores"]
    rows = [("store", "records", "B each", "bytes", "share")]
    total = figures["stores_bytes"]
    for store in sorted(stores, key=lambda store: -store["bytes"]):
        rows.append((store["name"], grouped(store["capacity"]), grouped(store["record_bytes"]), grouped(store["bytes"]),
                     "%.1f %%" % (100 * store["bytes"] / total if total else 0)))
    rows.append(("all stores", "", "", grouped(total), ""))
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    lines = ["  ".join([row[0].ljust(widths[0])] + [row[i].rjust(widths[i]) for i in range(1, 5)]) for row in rows]
    return lines + [""] + heap_lines(figures) + [paper_line(total)]


def heap_lines(figures):
    used, code, data = figures["heap_used_bytes"], figures["heap_code_bytes"], figures["heap_data_bytes"]
    if used is None:
        return ["Heap: not measured on this target (%s)." % figures["target"]]
    text = "Heap after boot: %s" % grouped(used)
    if figures["heap_bytes"]:
        text += " of %s B (%.1f %%)" % (grouped(figures["heap_bytes"]), 100 * used / figures["heap_bytes"])
    lines = [text + (", locked" if figures["heap_locked"] else ", not locked") + "; allocated since: %s B." % (
        "unknown" if figures["allocated_after_boot_bytes"] is None else grouped(figures["allocated_after_boot_bytes"]))]
    if data is None and code:
        lines.append("Of it code and data: unknown, as the core's own figures contradict one another (code %s B)." % grouped(code))
    if data is not None and figures["target"] != "stm32":  # there the code lies in flash, and heap_ledger tells more
        lines.append("Of it code %s B, data %s B: the stores above %s B, objects and buffers around them %s B." % (
            grouped(code), grouped(data), grouped(figures["stores_bytes"]), grouped(data - figures["stores_bytes"])))
    return lines


def paper_line(total):
    """Paper Table 2 reads 28.2 KB; as 28,200 B, the smaller reading."""
    return "The paper's map of %d vectors alone takes %s B: all stores here are %.1f %% of that." % (
        PAPER_VECTORS, grouped(PAPER_BYTES), 100 * total / PAPER_BYTES)


def grouped(value):
    return "{:,}".format(value)
