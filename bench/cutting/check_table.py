#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Check of measured.csv, the table of published measurements of bone cutting.

usage: check_table.py [TABLE]; prints one line a fault and exits with 1 after any.

A number is a decimal, or a range LOW..HIGH. A value has no range: where a source gives only a range,
the range is the spread and the value its middle. Otherwise the spread is a standard deviation.
A trend's value is the sign of the change: "force by speed", or "force, down after up cutting".
An effect's value is 1 where the source found it significant and the page read gives no sign.
An empty condition was not stated in the page that was read.
A row that fits or tests the law is run by compare.py, unless held_by names the test case that holds it: a file in tests
and the beginning of the case's name."""
import csv
import pathlib
import re
import sys

import compare

COLUMNS = ("id source doi tool kind diameter_mm edges speed_rpm feed_mm_s load_N depth_mm material density "
           "quantity value spread unit page role why_not held_by").split()
KINDS = {"fluted", "diamond", "twist", "saw", "other"}
ROLES = {"fit", "test", "none"}
UNITS = set("N|mN|N mm|N/m|N s/m|kg|W|rpm|mm|mm3/s|J/mm3|s|g|K|degC|dBA|dB SPL|MPa|%|1|sign|yes".split("|"))
CONDITIONS = "diameter_mm edges speed_rpm feed_mm_s load_N depth_mm density spread".split()
NEEDED = "id source tool quantity page".split()
NUMBER = r"-?\d+(\.\d+)?"
LEAST_SOURCES, LEAST_BURR_SOURCES, LONGEST_CELL = 12, 8, 60


def is_test(name):
    """Whether there is a test case `FILE: BEGINNING OF ITS NAME`."""
    file, _, begins = name.partition(": ")
    path = pathlib.Path(__file__).parents[2] / "tests" / file
    return path.is_file() and bool(begins) and f'TEST_CASE("{begins}' in re.sub(r"\(\s+", "(", path.read_text(encoding="utf-8"))


def faults(rows):
    """Lines that name each fault of the rows, each a list of cells with the header first."""
    if not rows or rows[0] != COLUMNS:
        yield f"header: must be {','.join(COLUMNS)}"
        return
    seen, sources, burrs = set(), set(), set()
    for line, cells in enumerate(rows[1:], 2):
        if len(cells) != len(COLUMNS):
            yield f"row {line}: {len(cells)} cells, must be {len(COLUMNS)}"
            continue
        row = dict(zip(COLUMNS, cells))
        name = f"row {line} ({row['id']})"
        sources.add(row["doi"])
        if row["kind"] in ("fluted", "diamond"):
            burrs.add(row["doi"])
        if row["id"] in seen:
            yield f"{name}: id is there twice"
        seen.add(row["id"])
        for column in NEEDED:
            if not row[column]:
                yield f"{name}: {column} is empty"
        for column, cell in row.items():
            if column != "doi" and len(cell) > LONGEST_CELL:
                yield f"{name}: {column} is longer than {LONGEST_CELL} letters"
        if not re.fullmatch(r"10\.\d{4,9}/\S+|https?://\S+", row["doi"]):
            yield f"{name}: doi is neither a DOI nor a URL: '{row['doi']}'"
        if not re.fullmatch(NUMBER, row["value"]):
            yield f"{name}: value is no number: '{row['value']}'"
        for column in CONDITIONS:
            if row[column] and not re.fullmatch(rf"{NUMBER}(\.\.{NUMBER})?", row[column]):
                yield f"{name}: {column} is no number or range: '{row[column]}'"
        for column, known in (("kind", KINDS), ("role", ROLES), ("unit", UNITS)):
            if row[column] not in known:
                yield f"{name}: {column} is unknown: '{row[column]}'"
        if row["unit"] == "sign" and row["value"] not in ("-1", "0", "1"):
            yield f"{name}: a trend's value is -1, 0 or 1, not '{row['value']}'"
        if (row["unit"] == "sign") != row["quantity"].startswith("trend: "):
            yield f"{name}: a trend's unit is sign, and only a trend's"
        if bool(row["why_not"]) != (row["role"] == "none"):
            yield f"{name}: why_not must be there exactly where role is none"
        if row["held_by"] and not is_test(row["held_by"]):
            yield f"{name}: there is no test '{row['held_by']}'"
        if row["role"] == "none" and row["held_by"]:
            yield f"{name}: a test holds it, so its role is not none"
        if row["role"] != "none" and not row["held_by"] and not compare.parts(row):
            yield f"{name}: compare.py does not run it, and no test holds it"
    if len(sources) < LEAST_SOURCES:
        yield f"{len(sources)} sources, must be {LEAST_SOURCES} or more"
    if len(burrs) < LEAST_BURR_SOURCES:
        yield f"{len(burrs)} sources on burrs, must be {LEAST_BURR_SOURCES} or more"


if __name__ == "__main__":
    path = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).with_name("measured.csv")
    with path.open(newline="", encoding="utf-8") as file:
        found = list(faults(list(csv.reader(file))))
    print("\n".join(found), end="\n" if found else "")
    sys.exit(1 if found else 0)
