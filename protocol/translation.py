# Between the messages of another schema and ours, by the names of messages and fields: whatever their order, width or id.
#
#   translation = Translation(theirs)                     a Dialect of dialect.py
#   message = translation.reads[frame_id].unpack(body)    ours; None where ours has no such message, or it says too little
#   number, body = translation.write(message)             theirs; SchemaError where it cannot be told
#   sentence = translation.flaw(names)                    why these of our messages cannot pass, "" if they can
#
# A field that one of the two has not is read as 0 where that one which knows it calls it optional (schema.OPTIONAL); a value other
# than 0 that has no place at the other end is an error, never left out. Host only.

from protocol.dialect import HANDSHAKE_MAX, NUMBERS, OURS, SchemaError, dialect_of
from protocol.messages import MessageError

CODES = (("states", "state", 256), ("reasons", "reason", 256), ("degraded", "bit", 16))     # and what one without a name is, how many
UPDATE = "update the older of the two"
_EMPTY = {"p10": (0,) * 8, "*": ()}


def empty(kind):
    return 0 if kind in NUMBERS else _EMPTY.get(kind, "")


def spelt(name, field):
    """`STEP.left (i16, pulse)`"""
    field_name, kind, unit = field
    said = "group" if kind == "*" else ", ".join(part for part in (kind, unit) if part)
    return "%s.%s (%s)" % (name, field_name, said)


def apart(sender, taker):
    """Whether these fields of one name cannot carry the same value."""
    if sender[1] == taker[1] == "*" or sender[1] == taker[1] == "p10":
        return False
    if sender[1] in NUMBERS and taker[1] in NUMBERS or sender[1][0] == taker[1][0] == "c":
        return bool(sender[2] and taker[2] and sender[2] != taker[2])
    return True


# How a message of the sender becomes one of the taker: `flaw` is a sentence where it cannot. make(values) gives the taker's values;
# `missed` are (place, field) of the sender that the taker has not.
class Recipe:
    def __init__(self, sender, taker, optional, sends, takes, codes=None):
        self.flaw = ""
        self.missed = [(at, field) for at, field in enumerate(sender.FIELDS) if field[0] not in {other[0] for other in taker.FIELDS}]
        self._parts = []
        places = {field[0]: (at, field) for at, field in enumerate(sender.FIELDS)}
        name = taker.NAME
        for field in taker.FIELDS:
            at, there = places.get(field[0], (None, None))
            if there is None:
                self._parts.append((None, empty(field[1])))
                if "%s.%s" % (name, field[0]) not in optional:
                    self.flaw = self.flaw or "%s is needed by %s, and %s has no such field" % (spelt(name, field), takes, sends)
            elif apart(there, field):
                self.flaw = self.flaw or "%s of %s is no %s of %s" % (spelt(name, there), sends, spelt(name, field), takes)
            elif field[1] == "*":
                self._parts.append((at, self._group(name, there, field, optional, sends, takes)))
            else:
                self._parts.append((at, (codes or {}).get(field[0])))
        if sender.DIRECTION != taker.DIRECTION:
            self.flaw = "%s goes the other way in %s's schema" % (name, sends)

    def _group(self, name, there, field, optional, sends, takes):
        """values -> values of the repeated group."""
        places = {item[0]: (at, item) for at, item in enumerate(there[2])}
        order = []
        for item in field[2]:
            at, other = places.get(item[0], (None, None))
            if other is None and "%s.%s.%s" % (name, field[0], item[0]) not in optional:
                self.flaw = self.flaw or "%s is needed by %s, and %s has no such field" % (
                    spelt("%s.%s" % (name, field[0]), item if len(item) > 2 else (*item, "")), takes, sends)
            order.append(at)
        theirs_bytes, ours_bytes = (len(group[2]) == 1 and group[2][0][1] == "u8" for group in (there, field))

        def convert(items):
            rows = ((item,) for item in items) if theirs_bytes else items
            made = [tuple(0 if at is None else row[at] for at in order) for row in rows]
            return bytes(row[0] for row in made) if ours_bytes else tuple(made)
        return convert

    def make(self, values):
        return [part if at is None else part(values[at]) if part is not None else values[at] for at, part in self._parts]


# One of their messages on its way to us. `unpack` as a message class's; what ours has no place for goes to heard(message).
class Reading:
    def __init__(self, theirs, ours, optional, codes, heard, who):
        self.DIRECTION = theirs.DIRECTION
        self._theirs, self._ours, self._heard = theirs, ours, heard
        self.recipe = Recipe(theirs, ours, optional, who, "this host", codes) if ours is not None else None
        self.whole = self.recipe is not None and not self.recipe.flaw
        self._strange = not self.whole or bool(self.recipe.missed)
        self._item = ours._ITEM_TYPE if ours is not None and not ours._BYTES else None

    def unpack(self, body):
        message = self._theirs.unpack(body)
        if self._strange:
            self._heard(message)
        if not self.whole:
            return None
        try:
            values = self.recipe.make(message)
        except ValueError:
            raise MessageError("%s: a byte of its group is none" % message.NAME) from None
        if self._item is not None:
            values[-1] = tuple(map(self._item._make, values[-1]))
        return self._ours._make(values)


def of_log(told):
    """The Translation of a log's messages by its head, None where they are ours."""
    theirs = dialect_of(told)
    return None if theirs.hash == OURS.hash else Translation(theirs, who="the log")


class Translation:
    # heard(message) gets each message of theirs that says something for which ours has no place, in their class.
    def __init__(self, theirs, ours=OURS, heard=lambda message: None, who="the core"):
        self.theirs, self.ours = theirs, ours
        joined = {what: merged(ours.codes[what], theirs.codes[what], word, count) for what, word, count in CODES}
        self.names = {what: names for what, (names, _) in joined.items()}   # ours, and behind them those that only they have
        states, reasons, self._degraded = (numbers for _, numbers in joined.values())
        ids = {kind.ID: ours.by_name[kind.NAME].ID for kind in theirs.by_id.values() if kind.NAME in ours.by_name}
        codes = {"state": lambda value: states.get(value, value), "reason": lambda value: reasons.get(value, value),
                 "degraded": lambda value: self._bits(value), "message_id": lambda value: ids.get(value, value)}
        self._writes = {name: Recipe(kind, theirs.by_name[name], theirs.optional, "this host", "the core")
                        for name, kind in ours.by_name.items() if name in theirs.by_name}
        self.reads = {number: Reading(kind, ours.by_name.get(kind.NAME), ours.optional, codes, heard, who)
                      for number, kind in theirs.by_id.items() if number > HANDSHAKE_MAX}
        self.reads |= {number: kind for number, kind in ours.by_id.items() if number <= HANDSHAKE_MAX}
        self.differs = sorted(name for name in {**ours.by_name, **theirs.by_name}
                              if bare(ours.by_name.get(name)) != bare(theirs.by_name.get(name)))

    def summary(self):
        count = len(self.differs)
        what = "%d message%s differ%s: %s%s" % (count, "s" * (count != 1), "s" * (count == 1), ", ".join(self.differs[:4]),
                                                ", ..." * (count > 4)) if count else "its parameters differ"
        return "the core speaks schema %08x, this host %08x: adapted (%s)" % (self.theirs.hash, self.ours.hash, what)

    def flaw(self, names):
        """The sentence on the first of these messages of ours that cannot pass; "" if all can."""
        for name in names:
            ours, theirs = self.ours.by_name[name], self.theirs.by_name.get(name)
            if ours.ID <= HANDSHAKE_MAX:
                continue
            if theirs is None:
                return self._sentence("it has no message %s" % name)
            recipe = self.reads[theirs.ID].recipe if ours.DIRECTION else self._writes[name]
            if recipe.flaw:
                return self._sentence(recipe.flaw)
            if ours.RELIABLE != theirs.RELIABLE:
                return self._sentence("%s is repeated until it has come only by %s" % (name, "this host" if ours.RELIABLE else "the core"))
        return ""

    def unread(self, names):
        """What is wrong with these messages as they stand in a log; "" if all can be read."""
        for name in names:
            theirs = self.theirs.by_name.get(name)
            if theirs is None or not self.reads[theirs.ID].whole:
                return self.reads[theirs.ID].recipe.flaw if theirs else "it has no message %s" % name
        return ""

    def readable(self, names):
        """{id: what unpacks it} of those of our messages with these names that can be read."""
        found = {name: self.theirs.by_name[name].ID for name in names if name in self.theirs.by_name}
        return {number: self.reads[number] for name, number in found.items() if number <= HANDSHAKE_MAX or self.reads[number].whole}

    def _sentence(self, flaw):
        return "the core speaks schema %08x, this host %08x, and %s: %s" % (self.theirs.hash, self.ours.hash, flaw, UPDATE)

    def write(self, message):
        name = message.NAME
        recipe, theirs = self._writes.get(name), self.theirs.by_name.get(name)
        if recipe is None or recipe.flaw:
            raise SchemaError(self.flaw((name,)) if message.DIRECTION == 0 else self._sentence("it has no message %s" % name))
        for at, field in recipe.missed:
            if message[at] not in (0, "", (), b"", _EMPTY["p10"]):
                raise SchemaError(self._sentence("%s = %s has no place in it" % (spelt(name, field), message[at])))
        values = recipe.make(message)
        try:
            return theirs.ID, theirs._pack_parts(values)
        except MessageError:
            raise SchemaError(self._sentence(self._too_large(message, theirs, values))) from None

    def _too_large(self, message, theirs, values):
        sizes = {"u8": (0, 255), "i8": (-128, 127), "u16": (0, 65535), "i16": (-32768, 32767)}
        ours = {field[0]: field for field in message.FIELDS}
        for field, value in zip(theirs.FIELDS, values, strict=True):
            low, high = sizes.get(field[1], (-(1 << 30), 1 << 30))
            if field[1] in NUMBERS and not low <= value <= high and field[0] in ours:
                return "%s = %d does not fit its %s" % (spelt(message.NAME, ours[field[0]]), value, field[1])
        return "its %s does not hold what is to be said" % message.NAME

    def parameter(self, name, index, value):
        """Its number at the core; None where the core has it not, and the value is the one that it would have anyway."""
        row = next(row for row in self.ours.parameters if row[0] == name)
        number = self.theirs.numbers.get(name)
        if number is not None:
            _, unit, count = self.theirs.parameters[number][:3]
            if unit != row[1]:
                raise SchemaError(self._sentence("its parameter %s is in %s, ours in %s" % (name, unit or "no unit", row[1] or "no unit")))
            if index < count:
                return number
        if value != row[5]:
            raise SchemaError(self._sentence("it has no parameter %s[%d], which is to be %d" % (name, index, value)))
        return None

    def _bits(self, value):
        return sum(1 << place for place in {self._degraded[at] for at in range(16) if value >> at & 1})


def merged(ours, theirs, word, count):
    """(our names and behind them those that only they have, {their number: its number in these}); what they have no name for
    must not pass for what we have one for."""
    theirs = (*theirs, *("%s %d" % (word, number) for number in range(len(theirs), count)))
    names = (*ours, *(name for name in dict.fromkeys(theirs) if name not in ours))
    places = {name: number for number, name in reversed(tuple(enumerate(names)))}
    return names, {number: places[name] for number, name in enumerate(theirs)}


def bare(kind):
    """What two schemas must agree upon to need no translation."""
    if kind is None:
        return None
    return (kind.ID, kind.DIRECTION, kind.RELIABLE, [
        (name, type_, [item[:2] for item in unit] if type_ == "*" else unit) for name, type_, unit in kind.FIELDS])
