# SPDX-License-Identifier: MIT
"""figures.py --write | --check [DOCUMENT...]: tables of figures in documents are those of bench/figures.

A document has a table between `<!-- figures: NAME -->` and `<!-- end -->`, made of bench/figures/NAME.csv, which has the
columns name, value, unit, set, commit and machine. A name of two parts, as `Line / Peak force`, is a row and a column
of the table; other names are rows with value and set. Figures that depend on a machine name it and their commit below
the table. --check fails where a block is another one, or where a table without marks has a figure; --write writes it. Without a name it takes all documents.
`bench/report/figures.py` writes the CSVs."""

import csv
import glob
import os
import re
import sys

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
FIGURES = os.path.join(ROOT, "bench", "figures")
# A cell that holds nothing but a measured number, in a table that no CSV makes.
LOOSE = re.compile(r"^\|.*\| *(?:\d[\d.]*(?: (?:to|/) )?)+ ?(?:%|N|mN|N·mm|µs|ms|s|mm³|°|voxel|MB) *\|", re.M)
BLOCK = re.compile(r"<!-- figures: (\w+) -->\n(.*?)<!-- end -->\n", re.S)


def read(name):
    if not os.path.exists(os.path.join(FIGURES, name + ".csv")):
        raise SystemExit(f"there is no bench/figures/{name}.csv")
    with open(os.path.join(FIGURES, name + ".csv"), newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def shown(row):
    """The value and its unit: degrees stand close, other units apart."""
    return row["value"] + ("" if row["unit"] in ("", "°") else " ") + row["unit"]


def line(cells):
    return "| " + " | ".join(cells) + " |"


def table(rows):
    """Markdown of a CSV's rows."""
    if " / " in rows[0]["name"]:
        cells = {tuple(row["name"].split(" / ")): shown(row) for row in rows}
        columns = list(dict.fromkeys(column for _, column in cells))
        header = ["", *columns]
        body = [[head] + [cells.get((head, column), "–") for column in columns] for head in dict.fromkeys(h for h, _ in cells)]
    else:
        header = ["Figure", "Value", "Set"]
        body = [[row["name"], shown(row), row["set"]] for row in rows]
    lines = [line(header).replace("|  |", "| |", 1), "|" + "---|" * len(header)] + [line(cells) for cells in body]
    made = {}
    for row in rows:
        if row["machine"] != "any" and row["commit"] not in made.setdefault(row["machine"], []):
            made[row["machine"]].append(row["commit"])
    if made:
        lines += ["", "*" + "; ".join(f"{machine}, at {' and '.join(commits)}" for machine, commits in made.items()) + ".*"]
    return "\n".join(lines) + "\n\n"


def main():
    if len(sys.argv) < 2 or sys.argv[1] not in ("--write", "--check"):
        print(__doc__, file=sys.stderr)
        return 2
    stale = 0
    documents = [path for folder in ("", "bench/**/", "cmake/", "examples/**/", "include/**/")
                 for path in glob.glob(os.path.join(ROOT, folder + "*.md"), recursive=True)]
    for path in sys.argv[2:] or documents:
        with open(path, encoding="utf-8") as file:
            old = file.read()
        opened = len(re.findall(r"<!-- figures: ", old))
        if opened != len(BLOCK.findall(old)):
            print(f"{path}: a mark of figures has no end, or an unusual name", file=sys.stderr)
            stale += 1
            continue
        for row in LOOSE.findall(BLOCK.sub("", old)):
            print(f"{path}: a figure stands in a table without marks: {row}", file=sys.stderr)
            stale += 1
        new = BLOCK.sub(lambda m: f"<!-- figures: {m[1]} -->\n\n{table(read(m[1]))}<!-- end -->\n", old)
        if new == old:
            continue
        if sys.argv[1] == "--write":
            with open(path, "w", encoding="utf-8") as file:
                file.write(new)
            print(f"{path}: figures written")
            continue
        stale += 1
        for before, after in zip(BLOCK.finditer(old), BLOCK.finditer(new)):
            changed = [l for l in after[0].splitlines() if l not in before[0].splitlines()]
            if changed:
                print(f"{path}: bench/figures/{after[1]}.csv says: " + "\n  ".join(changed), file=sys.stderr)
    if stale:
        print(f"write them: python3 {os.path.relpath(__file__)} --write", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
