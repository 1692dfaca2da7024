"""Where two answers to the same question differ: found by the schema's fields, shown side by side."""

from typing import NamedTuple

from host_tools.mission import STEP_S
from protocol import states
from protocol.dialect import name_of

OF_THE_TARGET = {"STATUS_RSP": ("heap_bytes", "heap_used_bytes", "heap_locked", "allocated_after_boot_bytes", "late_ticks", "late_ms")}
HEX = ("hash16", "steps_lo", "steps_hi", "map_lo", "map_hi")
NAME_COLUMN, COLUMN = 26, 12


# One message of one step that the sides (the log, the targets) do not agree on: {field: {side: value}}, in the schema's order.
class Difference(NamedTuple):
    step: int
    message: str
    fields: dict

    @property
    def names(self):
        return "%s %s" % (self.message, ", ".join(self.fields))

    def as_dict(self):
        return {"step": self.step, "message": self.message, "field": next(iter(self.fields)), "fields": self.fields}


def between(step, by_side, skipped=()):
    """The Difference of {side: message}, all of one kind; None if they agree."""
    one, *others = by_side.values()
    if all(other == one for other in others):
        return None
    skipped = (*skipped, *OF_THE_TARGET.get(one.NAME, ()))
    fields = {name: {side: message[at] for side, message in by_side.items()} for at, name in enumerate(one._fields)
              if name not in skipped and any(other[at] != one[at] for other in others)}
    return Difference(step, one.NAME, fields) if fields else None


def between_lists(step, by_side, what="telemetry"):
    """The same for {side: [message, ...]}: what followed one answer."""
    one, *others = by_side.values()
    if all(other == one for other in others):
        return None
    for at in range(max(map(len, by_side.values()))):
        there = {side: messages[at] if at < len(messages) else None for side, messages in by_side.items()}
        kinds = {side: "nothing" if message is None else message.NAME for side, message in there.items()}
        if len(set(kinds.values())) > 1:
            return Difference(step, what, {"message": kinds})
        found = between(step, there)
        if found is not None:
            return found
    return None


def between_same(step, by_side):
    """As between_lists, but of messages that every side has: what one of them did not send, or lost, is passed over."""
    found = (between(step, there) for there in same(by_side))
    return next((difference for difference in found if difference is not None), None)


def same(by_side):
    """{side: message} of each message that every side has, in the order of the first side's."""
    keyed = {side: {_key(message): message for message in messages} for side, messages in by_side.items()}
    one, *others = keyed.values()
    return [{side: messages[key] for side, messages in keyed.items()} for key in one if all(key in other for other in others)]


def _key(message):
    return message.NAME, message[0]  # by its step, index or order


def at_the_end(step, statuses, maps):
    """Of {side: STATUS_RSP} and {side: the map's bytes}."""
    found = between(step, statuses)
    if found is not None or len(set(maps.values())) < 2:
        return found
    sizes = {side: len(data) for side, data in maps.items()}
    if len(set(sizes.values())) > 1:
        return Difference(step, "map", {"bytes": sizes})
    at = next(i for i, there in enumerate(zip(*maps.values())) if len(set(there)) > 1)
    return Difference(step, "map", {"byte %d" % at: {side: data[at] for side, data in maps.items()}})


def robot_s(step):
    return round(step * STEP_S, 2)


def state_name(state):
    return name_of(states.NAMES, state, "state")


def as_json(message):
    """A message as what JSON takes, groups as lists of objects."""
    def plain(value):
        if hasattr(value, "_asdict"):
            return {key: plain(part) for key, part in value._asdict().items()}
        return [plain(part) for part in value] if isinstance(value, (tuple, list, bytes)) else value
    return plain(message)


def input_lines(question):
    """A STEP's values, in three lines."""
    units = {name: unit for name, _, unit in question.FIELDS}
    plain = ["%s %d %s" % (name, getattr(question, name), units[name]) for name in ("left", "right", "ultrasonic_mm", "bump")]
    records = ["anchor %d %d cdB %d mm" % tuple(record) for record in question.uwb]
    return ["    " + "   ".join(plain), "    ir %s %s" % (" ".join(map(str, question.ir)), units["ir"]),
            "    uwb " + ("   ".join(records) or "no report")]


def table(name, by_side, fields):
    """Fields {name: {side: value}} as rows, a star before those that differ."""
    widths = {side: max(COLUMN, len(side) + 2) for side in by_side}
    lines = ["    %-*s%s" % (NAME_COLUMN, name, "".join(side.rjust(widths[side]) for side in by_side))]
    for field, values in fields.items():
        cells = "".join(_cell(field, values[side]).rjust(widths[side]) for side in by_side)
        lines.append("  %s %-*s%s" % ("*" if len(set(values.values())) > 1 else " ", NAME_COLUMN, field, cells))
    return lines


def all_fields(by_side):
    """{field: {side: value}} of the same message of each side."""
    names = next(iter(by_side.values()))._fields
    return {name: {side: message[at] for side, message in by_side.items()} for at, name in enumerate(names)}


def _cell(field, value):
    return "%04x" % value if field in HEX else str(value)
