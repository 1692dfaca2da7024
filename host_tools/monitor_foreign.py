"""What a core says for which this program has no words of its own: its messages as tables of fields, names and units as the
core's own schema has them (HostLink.foreign). Pure, as monitor_rows.py.
"""

from host_tools.monitor_rows import number

SHOWN_MAX = 8       # of a group's items, or of an array


def sections(link):
    """[(title, rows)]: how the two schemas differ, then each message."""
    if link.translation is None:
        return []
    differs = link.translation.differs
    rows = [("core", "%08x" % link.dialect.hash, ""), ("this host", "%08x" % link.translation.ours.hash, "")]
    rows += [("differ", name, "dim") for name in differs] or [("differ", "its parameters", "dim")]
    return [("SCHEMA", rows)] + [
        ("%s  %s" % (name, number(link.foreign_counts[name])), message_rows(message, link.dialect.codes, _known(link, message)))
        for name, message in sorted(link.foreign.items())]


def _known(link, message):
    """The fields that stand in the rows of our own messages already."""
    reading = link.translation.reads[message.ID]
    return {field[0] for field in link.translation.ours.by_name[message.NAME].FIELDS} if reading.whole else ()


def message_rows(message, codes, known=()):
    rows = []
    for value, (name, kind, unit) in zip(message, message.FIELDS, strict=True):
        if name in known:
            continue
        if kind == "*":
            rows += _group(name, value, unit)
        elif kind == "p10":
            rows.append((name, _joined(" ".join(map(str, value)), unit), ""))
        elif name == "state" and value < len(codes["states"]):
            rows.append((name, codes["states"][value], ""))
        else:
            rows.append((name, _joined(value if kind[0] == "c" else number(value), unit), ""))
    return rows


def _group(name, items, fields):
    """A head, then a row an item."""
    rows = [(name, "%d of them" % len(items), "")]
    if isinstance(items, bytes):
        return [(name, items[:SHOWN_MAX].hex(" ") + (" ..." if len(items) > SHOWN_MAX else ""), "")]
    for item in items[:SHOWN_MAX]:
        told = ["%s %s" % (field[0], _joined(number(value), field[2] if len(field) > 2 else ""))
                for value, field in zip(item, fields, strict=True)]
        rows.append(("", "  ".join(told), ""))
    return rows + [("", "...", "dim")] * (len(items) > SHOWN_MAX)


def _joined(text, unit):
    if unit[:1].isdigit():
        return "%s x %s" % (text, unit)     # a unit that carries a scale: 5 mm
    return "%s %s" % (text, unit) if unit else text


def plain_lines(link):
    """The same for pipes, a line a message."""
    return ["  %s: %s" % (title, "  ".join("%s %s" % (label, text) if label else text for label, text, _ in rows))
            for title, rows in sections(link)[1:]]
