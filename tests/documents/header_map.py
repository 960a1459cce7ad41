# SPDX-License-Identifier: MIT
"""header_map.py INCLUDE DOCUMENT [--check]: writes the map of headers into DOCUMENT, or checks that it is current.

INCLUDE holds trephine/. Folders come in the order of their layers, a line a header: its name and the first sentence of
its comment. That is the comment of the namespace where a header has one, else of the type that the header is named
after, else the first one. The map replaces all between the two marks in DOCUMENT. A header without any comment is named
with what it declares; bodies of another header (*_impl.hpp) are left out."""

import os
import re
import sys

BEGIN, END = "<!-- map of headers: begin -->", "<!-- map of headers: end -->"
LAYERS = ["core", "voxel", "tool", "contact", "render", "stage", "structure", "session", "device", "compiled", "adapter"]
LONG = 110  # characters; a longer sentence is cut at its colon or semicolon
SHORT = 12


def comments(lines):
    """(comment, declaration after it) in the order of the file; trailing comments are none."""
    found, i = [], 0
    while i < len(lines):
        if not lines[i].startswith("///"):
            i += 1
            continue
        comment = []
        while i < len(lines) and lines[i].startswith("///"):
            comment.append(lines[i][3:].strip())
            i += 1
        declaration = " ".join(lines[i : i + 4])
        if "" in comment:  # a paragraph
            comment = comment[: comment.index("")]
        found.append((" ".join(comment), declaration))
    return found


def first_sentence(comment):
    sentence = re.split(r"(?<=[.!?…])\s+(?=[^a-z0-9])|(?<=\]\.)\s", comment.strip())[0]
    if len(sentence) > LONG:
        for sign in (": ", "; "):
            head = sentence.split(sign)[0]
            if SHORT <= len(head) < len(sentence):
                sentence = head
                break
    sentence = re.sub(r"(?<!\w)(\*\*|\*)(?=\S)(.*?)\1", r"\2", sentence)
    return sentence.rstrip(".:;, …")


def about(path, name):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    found = comments([line.rstrip() for line in text.split("\n")])
    if not found:
        declared = re.findall(r"^(?:inline constexpr \w+|class|struct|enum class|concept) (\w+)", text, flags=re.M)
        return ", ".join(f"`{d}`" for d in declared)
    type_name = "".join(word.capitalize() for word in name.split("_"))
    of_namespace = [c for c, d in found if d.startswith("namespace ")]
    of_type = [c for c, d in found if re.search(rf"\b(class|struct|concept|enum class) {type_name}\b", d)]
    return first_sentence((of_namespace or of_type or [found[0][0]])[0])


def make_map(include):
    root = os.path.join(include, "trephine")
    folders = {}
    for folder, _, files in os.walk(root):
        for file in files:
            if file.endswith(".hpp") and not file.endswith("_impl.hpp"):
                folders.setdefault(os.path.relpath(folder, root).replace(os.sep, "/"), []).append(file)
    if not folders:
        raise SystemExit(f"no headers in {root}")

    def order(folder):
        layer = folder.split("/")[0]
        return (-1 if folder == "." else LAYERS.index(layer) if layer in LAYERS else len(LAYERS), folder)

    text = []
    for folder in sorted(folders, key=order):
        if folder != ".":
            text += ["", f"### {folder}", ""]
        for file in sorted(folders[folder]):
            path = file if folder == "." else f"{folder}/{file}"
            sentence = about(os.path.join(root, path), file[: -len(".hpp")])
            text.append(f"- [`{file[:-4]}`]({path})" + (f": {sentence}" if sentence else ""))
    return "\n".join(text).strip("\n")


def main():
    arguments = [a for a in sys.argv[1:] if a != "--check"]
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    include, document = arguments
    with open(document, encoding="utf-8") as file:
        old = file.read()
    if old.count(BEGIN) != 1 or old.count(END) != 1 or old.index(BEGIN) > old.index(END):
        print(f"{document}: needs one line '{BEGIN}' and after it one '{END}'", file=sys.stderr)
        return 2
    new = old[: old.index(BEGIN)] + BEGIN + "\n\n" + make_map(include) + "\n\n" + old[old.index(END) :]
    if new == old:
        return 0
    if "--check" not in sys.argv:
        with open(document, "w", encoding="utf-8") as file:
            file.write(new)
        print(f"{document}: map written")
        return 0
    stale = set(new.split("\n")) ^ set(old.split("\n"))
    print(f"{document}: the map of headers is not current: {sorted(stale)}", file=sys.stderr)
    print(f"write it: python3 {os.path.relpath(__file__)} {include} {document}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
