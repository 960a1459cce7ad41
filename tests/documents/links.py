# SPDX-License-Identifier: MIT
"""links.py FILE...: every link to a file, folder or heading in these documents leads to one.

Addresses on the web are not looked at. A heading's anchor is made as GitHub makes it."""

import os
import re
import sys


def without_code(text):
    return re.sub(r"^```.*?^```[^\n]*$", "", text, flags=re.S | re.M)


def anchors(path):
    with open(path, encoding="utf-8") as file:
        headings = re.findall(r"^#+ (.*)$", without_code(file.read()), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


def main():
    broken = []
    for document in sys.argv[1:]:
        with open(document, encoding="utf-8") as file:
            text = without_code(file.read())
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            path = os.path.join(os.path.dirname(document), path) if path else document
            if not os.path.exists(path):
                broken.append(f"{document}: no file {target}")
            elif anchor and anchor not in anchors(path):
                broken.append(f"{document}: no heading {target}")
    for line in broken:
        print(line, file=sys.stderr)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
