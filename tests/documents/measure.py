# SPDX-License-Identifier: MIT
"""measure.py FILE... [--bytes N] [--median LEAST MOST] [--longest N] [--cell N]: how long a document's sentences and cells are.

Prints a line a file: bytes, lines, sentences, the median and the longest sentence [words], the longest table cell
[characters as shown] and how many of 100 words in prose and cells hold a digit. With a bound, a file beyond it fails, and its sentences and cells beyond it are printed.

A sentence ends at . ! or ? before a space, or with its paragraph or list item. Code blocks, tables, headings, pictures,
comments hold no sentences; inline code and a link's text count as they are shown, a link's address not at all."""

import argparse
import re
import statistics
import sys


def shown(text):
    """Text as a reader sees it: no addresses, no marks of emphasis, no backticks."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"<(https?://[^>]*)>", r"\1", text)
    text = re.sub(r"\\([|*_])", r"\1", text)
    return text.replace("`", "").replace("**", "").strip()


def blocks(text):
    """Paragraphs and list items as single lines, and table cells; nothing of what is no prose."""
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    text = re.sub(r"^```.*?^```[^\n]*$", "", text, flags=re.S | re.M)
    paragraphs, cells, current = [], [], []

    def flush():
        if current:
            paragraphs.append(" ".join(current))
            current.clear()

    for line in text.split("\n"):
        stripped = line.strip()
        if stripped.startswith("|"):
            flush()
            if not re.fullmatch(r"[|:\- ]+", stripped):
                cells += [shown(c) for c in re.split(r"(?<!\\)\|", stripped.strip("|"))]
        elif not stripped or stripped.startswith(("#", "![", "<")):
            flush()
        elif re.match(r"([-*]|\d+\.) ", stripped):
            flush()
            current.append(re.sub(r"^([-*]|\d+\.) ", "", stripped))
        else:
            current.append(stripped)
    flush()
    return paragraphs, cells


def sentences(paragraphs):
    found = []
    for paragraph in paragraphs:
        # A full stop before a lower-case letter or a digit is an abbreviation's or a number's.
        found += re.split(r"(?<=[.!?])[*_)]*\s+(?=[^a-z0-9])", paragraph)
    return [shown(s) for s in found if words(s)]


def words(sentence):
    """Signs alone are no words."""
    return [w for w in sentence.split() if re.search(r"\w", w)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("files", nargs="+")
    for bound in ("bytes", "longest", "cell"):
        parser.add_argument(f"--{bound}", type=float, default=float("inf"))
    parser.add_argument("--median", type=float, nargs=2, default=(0, float("inf")))
    bounds = parser.parse_args()

    broken = False
    for path in bounds.files:
        with open(path, "rb") as file:
            raw = file.read()
        text = raw.decode("utf-8")
        paragraphs, cells = blocks(text)
        found = sentences(paragraphs)
        lengths = [len(words(s)) for s in found] or [0]
        median, cell = statistics.median(lengths), max(map(len, cells), default=0)
        every = [w for text in found + cells for w in words(text)]
        numbers = 100 * sum(bool(re.search(r"\d", w)) for w in every) / max(1, len(every))
        print(f"{path}: {len(raw)} bytes, {text.count(chr(10))} lines, {len(found)} sentences, median {median:g}, "
              f"longest {max(lengths)} words, longest cell {cell} characters, {numbers:.0f} numbers per 100 words")
        faults = [f"{len(words(s))} words: {s}" for s in found if len(words(s)) > bounds.longest]
        faults += [f"a cell of {len(c)} characters: {c}" for c in cells if len(c) > bounds.cell]
        if len(raw) > bounds.bytes:
            faults.append(f"more than {bounds.bytes:g} bytes")
        if not bounds.median[0] <= median <= bounds.median[1]:
            faults.append(f"the median sentence has {median:g} words, not {bounds.median[0]:g} to {bounds.median[1]:g}")
        for fault in faults:
            print(f"  {fault}", file=sys.stderr)
        broken |= bool(faults)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
