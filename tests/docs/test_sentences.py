"""No sentence stands on the pages twice, nor nearly so.

Tables, captions, headings and code are left out: a table may repeat what an entry says. So are
pages and parts that programs write, which show one text in several places on purpose.
"""

import re
from collections import defaultdict
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import pairwise
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from tests.docs.pages import PAGES

GENERATED = ("benchmarks.md", "effects.md", "environment.md")
FEWEST_WORDS = 6
ALIKE = 0.85
"""Share of words in common, in the same order, from which two sentences count as one."""


@dataclass(frozen=True)
class Sentence:
    """A sentence of a page, and its words in lower case."""

    page: str
    text: str
    words: tuple[str, ...]


def sentences(name: str, text: str) -> list[Sentence]:
    """Sentences of at least six words in the paragraphs and lists of a page."""
    text = re.sub(r"<!-- (\w+) -->.*?<!-- end of \1 -->", "", text, flags=re.DOTALL)
    found = []
    for before, token in pairwise(MarkdownIt("commonmark").enable("table").parse(text)):
        if before.type != "paragraph_open":
            continue
        said = "".join(
            " " if part.type == "softbreak" else part.content
            for part in token.children or ()
            if part.type != "image"
        )
        for sentence in re.split(r"(?<=[.:?])\s+(?=[A-Z`])", said):
            words = tuple(re.findall(r"\w+", sentence.lower()))
            if len(words) >= FEWEST_WORDS:
                found.append(Sentence(name, sentence, words))
    return found


def twins(pages: list[Sentence]) -> list[str]:
    """Pairs of sentences that say nearly the same in nearly the same words."""
    places = defaultdict(set)
    for i, sentence in enumerate(pages):
        for pair in pairwise(sentence.words):
            places[pair].add(i)
    found = []
    for i, sentence in enumerate(pages):
        shared = defaultdict(int)
        for pair in set(pairwise(sentence.words)):
            for j in places[pair]:
                shared[j] += j > i
        for j, count in shared.items():
            other = pages[j]
            longer = max(len(sentence.words), len(other.words))
            if count >= longer / 2 and alike(sentence, other):
                found.append(f"{sentence.page}: {sentence.text}\n{other.page}: {other.text}")
    return found


def alike(a: Sentence, b: Sentence) -> bool:
    """Whether two sentences have most words in common, in the same order."""
    return SequenceMatcher(None, a.words, b.words, autojunk=False).ratio() >= ALIKE


def written_by_people() -> list[Path]:
    return [page for page in PAGES if page.name not in GENERATED]


def test_no_sentence_stands_on_the_pages_twice():
    found = [
        sentence
        for page in written_by_people()
        for sentence in sentences(page.name, page.read_text(encoding="utf-8"))
    ]
    assert len(found) > 1000
    assert twins(found) == []


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("The fish swims to the north. So it does.\n\n* The fish swims to the *north*.", 1),
        ("The fish then swims to the\nnorth at once.\n\nThe fish swims to the north at once.", 1),
        ("The fish swims to the north.\n\nThe fish swims far to the south of here.", 0),
        ("The fish swims to the north.\n\n| a |\n| --- |\n| The fish swims to the north. |", 0),
        ("The fish swims to the north.\n\n```\nThe fish swims to the north.\n```", 0),
        ("It swims.\n\nIt swims.", 0),
    ],
)
def test_the_check_finds_twins(text, count):
    assert len(twins(sentences("page.md", text))) == count
