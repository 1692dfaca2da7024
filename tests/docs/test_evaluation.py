# docs/evaluation.md: every figure has its table there, and the tables are put in below their marks only.

from benchmarks.evaluation_page import MARK, page_with
from host_tools.evaluate import FIGURES
from tests.docs.pages import page

PAGE = "docs/evaluation.md"


def test_every_figure_has_its_place():
    names = [name for marked in MARK.findall(page(PAGE)) for name in marked.split()]
    assert names == [*FIGURES, "ablation", "growth"]


def test_tables_go_below_their_marks_and_nothing_else_changes():
    text = "# Page\n\nwords\n\n## One\n\n<!-- 5a 6 -->\n\nold\n\n| a |\n\n## Two\n\n<!-- table2 -->\n\nstays\n\n## Three\n\nend\n"
    sections = {name: {"title": "title " + name, "lines": ["| x |", "|---|"], "notes": ["a note"]} for name in ("5a", "6")}
    made = page_with(text, sections)
    block = "title %s\n\n| x |\n|---|\n\na note\n\n"
    assert made == text.replace("\nold\n\n| a |\n\n", "\n" + block % "5a" + block % "6")
    assert page_with(made, sections) == made
