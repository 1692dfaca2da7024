# Puts the tables of an evaluation into docs/evaluation.md, each below the mark that names it.
#
#   python -m benchmarks.evaluation_page out/eval [out/growth ...]

import json
import re
import sys
from pathlib import Path

PAGE = Path(__file__).parent.parent / "docs" / "evaluation.md"
MARK = re.compile(r"<!-- ([\w ]+) -->\n(?:(?!^## |<!-- )(?s:.))*", re.M)


def page_with(text, told):
    """The page's text with the sections of {name: section} below their marks; those that are not given stay as they are."""
    def replaced(found):
        names = found[1].split()
        if not all(name in told for name in names):
            return found[0]
        return "<!-- %s -->\n\n%s\n\n" % (found[1], "\n\n".join(block(told[name]) for name in names))

    return MARK.sub(replaced, text).rstrip("\n") + "\n"


def block(section):
    return "\n\n".join([section["title"], "\n".join(section["lines"]), *section["notes"]])


def main(folders):
    told = {}
    for folder in folders:
        evaluation = json.loads((Path(folder) / "evaluation.json").read_text())
        where = "`%s`, seeds 1 to %d" % (evaluation["home"], len(evaluation["seeds"]))
        for name, section in evaluation["sections"].items():
            told[name] = section | {"title": "**%s** (%s)" % (section["title"], where)}
    PAGE.write_text(page_with(PAGE.read_text(), told))


if __name__ == "__main__":
    main(sys.argv[1:])
