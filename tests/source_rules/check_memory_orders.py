# SPDX-License-Identifier: MIT
"""check_memory_orders.py INCLUDE LIST [--weaken]: every access to memory that threads share is in LIST, with its order.

An x86 processor orders more than these accesses ask for, so no test that runs there fails where one asks for too
little. LIST has a line for each variable: header, variable, accesses with their orders and numbers, and the reason.
With --weaken each order is in turn replaced by relaxed in what was read, and each time the check must fail: how the
check itself is tested."""

import collections
import os
import re
import sys

MEMBER = r"(\w+|\))\.(load|store|exchange|fetch_\w+|compare_exchange_\w+)\("
FREE = r"(?<![\w.])(load|store)_(relaxed|acquire|release)\((?:\w+(?:->|\.))?(\w+)"
BUILT_IN = r"__atomic_(load|store)\(.*__ATOMIC_(\w+)\)"


def arguments(text, at):
    """What stands between the parenthesis that opens before `at` and its end, without what is in further ones."""
    depth, own = 1, ""
    while depth > 0:
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        own += text[at] if depth == 1 else ""
        at += 1
    return own


def accesses(text):
    """(variable, access, order) of each access, in order of the text."""
    text = re.sub(r"//[^\n]*", "", text)
    atomics = {name for line in re.findall(r"std::atomic<[^>]*>+([^;]*);", text) for name in re.findall(r"(\w+)\{", line)}
    found = []
    for m in re.finditer(MEMBER, text):
        order = re.search(r"std::memory_order_(\w+)", arguments(text, m.end()))
        if order or m[1] in atomics:
            found.append((m.start(), m[1].replace(")", "atomic_ref"), m[2], order[1] if order else "seq_cst"))
    found += [(m.start(), m[3], m[1], m[2]) for m in re.finditer(FREE, text) if m[3] not in ("const", "T")]
    found += [(m.start(), "built-in", m[1], m[2].lower()) for m in re.finditer(BUILT_IN, text)]
    return [one[1:] for one in sorted(found)]


def lines_of(header, found):
    of_variable = collections.defaultdict(collections.Counter)
    for variable, access, order in found:
        of_variable[variable][f"{access} {order}"] += 1
    return {f"{header} {variable}: " + ", ".join(f"{n} {what}" for what, n in sorted(count.items()))
            for variable, count in of_variable.items()}


def main(include, path, weaken=False):
    with open(path, encoding="utf-8") as file:
        listed = {line.split(";")[0].strip() for line in file if line.strip() and not line.startswith("#")}
    root = os.path.join(include, "trephine")
    all_found = {}
    for folder, _, names in os.walk(root):
        for name in names:
            header = os.path.relpath(os.path.join(folder, name), root)
            with open(os.path.join(folder, name), encoding="utf-8") as file:
                found = accesses(file.read())
            if found:
                all_found[header] = found
    if weaken:
        tried = 0
        for header, found in all_found.items():
            for i, (variable, access, order) in enumerate(found):
                if order == "relaxed":
                    continue
                weaker = found[:i] + [(variable, access, "relaxed")] + found[i + 1:]
                if lines_of(header, weaker) <= listed:
                    sys.exit(f"{header}: {variable}.{access} may be relaxed unnoticed")
                tried += 1
        print(f"{tried} orders cannot be weakened unnoticed")
        sys.exit(0 if tried >= 10 else "too few orders were found")
    now = set().union(*(lines_of(header, found) for header, found in all_found.items()))
    for line in sorted(now - listed):
        print(f"not in {path}: {line}")
    for line in sorted(listed - now):
        print(f"only in {path}: {line}")
    sys.exit(now != listed)


main(sys.argv[1], sys.argv[2], "--weaken" in sys.argv[3:])
