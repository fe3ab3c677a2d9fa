"""The contributor's documents: what sources cite stands in them, and what they link to exists."""

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SOURCES = [path for top in ("tui_gcs", "sitl", "tests") for path in sorted((ROOT / top).rglob("*.py"))]
GENERATED = {
    *("cli.md", "keys.md", "alarms.md", "scenario.md", "messages.md", "settings.md", "exit-codes.md", "planner-api.md"),
}
"""Pages in `docs/reference` that `docs/make_reference.py` writes for the site; they may not be there."""
ROOT_PAGES = [ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "CHANGELOG", "SECURITY", "CODE_OF_CONDUCT")]
DOCUMENTS = [*sorted(p for p in DOCS.rglob("*.md") if p.name not in GENERATED), *ROOT_PAGES]

CASES = re.compile(r"B\.6-(\d+(?:(?:…|, | and | \([^)]*\), )(?!B)\d+)*)")
"""One case of the catalogue or several: `B.6-24`, `B.6-24…26`, `B.6-14, 16, 27…37`."""
TEST_OF_A_CASE = re.compile(r"def test_b6_(\d+)_")
SECTION = re.compile(r"(?:docs/)?(\w+)\.md,? ((?:[A-D]\.?\d{1,2}|[A-D])(?![\w.-]))")
"""A section by its number: `docs/threats.md C.4`, `docs/terminal.md D7`."""
QUOTED = re.compile(r'(?:docs/)?(\w+)\.md,? "([^"]+)"')
"""A section by its heading: `docs/autopilots.md "Sticks"`."""
LINK = re.compile(r"\[[^\]]*\]\(([^)#\s]*)(?:#([^)\s]+))?\)")
OLD_NAMES = {"security": "threats", "px4": "autopilots", "ardupilot": "autopilots", "mavlink": "autopilots"}
"""What sources called these documents when they were outside the repository."""


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def numbers_of(cases: str) -> set[int]:
    """`14, 16, 27…37` as numbers."""
    found: set[int] = set()
    for part in re.split(r", | and ", re.sub(r" \([^)]*\)", "", cases)):
        first, _, last = part.partition("…")
        found.update(range(int(first), int(last or first) + 1))
    return found


def headings(path: Path) -> list[str]:
    return re.findall(r"^#{1,6} (.+)$", text_of(path), re.MULTILINE)


def anchor(heading: str) -> str:
    """The name of a heading in links, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def test_generated_pages_are_those_of_the_generator() -> None:
    text = text_of(DOCS / "make_reference.py")
    assert set(re.findall(r'^    "([\w-]+\.md)": ', text, re.MULTILINE)) == GENERATED


def test_there_are_documents_and_citations() -> None:
    assert {"threats.md", "autopilots.md", "terminal.md", "planning.md"} <= {path.name for path in DOCUMENTS}
    assert numbers_of("14, 16, 27…29") == {14, 16, 27, 28, 29}
    assert sum(len(CASES.findall(text_of(path))) for path in SOURCES) > 50


def test_every_case_that_is_cited_or_tested_is_in_the_catalogue() -> None:
    listed = {int(number) for number in re.findall(r"^\| B\.6-(\d+) \|", text_of(DOCS / "threats.md"), re.MULTILINE)}
    assert listed == set(range(1, 113))
    for path in SOURCES:
        cited = {number for cases in CASES.findall(text_of(path)) for number in numbers_of(cases)}
        cited |= {int(number) for number in TEST_OF_A_CASE.findall(text_of(path))}
        assert cited <= listed, path


@pytest.mark.parametrize("pattern", [SECTION, QUOTED], ids=["by number", "by heading"])
def test_every_section_that_is_cited_is_there(pattern: re.Pattern[str]) -> None:
    missing = []
    for path in SOURCES:
        for name, section in pattern.findall(text_of(path)):
            document = DOCS / f"{OLD_NAMES.get(name, name)}.md"
            if document.exists() and not any(re.match(rf"{re.escape(section)}\b", h) for h in headings(document)):
                missing.append(f"{path.relative_to(ROOT)}: {name}.md {section}")
    assert missing == []


@pytest.mark.parametrize("path", [p for p in DOCUMENTS if p.exists()], ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(path: Path) -> None:
    for target, part in LINK.findall(text_of(path)):
        if "://" in target:
            continue
        if Path(target).name in GENERATED and "reference/" in target:
            continue
        led = path if not target else (path.parent / target).resolve()
        assert led.exists(), target
        assert not part or part in map(anchor, headings(led)), f"{target}#{part}"


def test_each_term_of_the_glossary_stands_there_once() -> None:
    terms = re.findall(r"^\| (?!term |---)([^|]+?) \|", text_of(DOCS / "glossary.md"), re.MULTILINE)
    assert len(terms) > 100
    assert sorted(terms) == sorted(set(terms))
