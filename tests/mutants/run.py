# SPDX-License-Identifier: MIT
"""run.py [--list] [--only N...]: a mutation test of the library.

`mutants.txt` holds faults of one line, each with the tests that must see it. All of them are written at once into a
copy of the tree, each as a choice that the environment variable TREPHINE_MUTANT makes, so that a folder of tests
compiles once. Each mutant is then run with its tests alone, until one fails, crashes or hangs.

Fails if under 95 % are killed, if a survivor has no reason, and if one with a reason is killed.

The list: a comment about what a user would feel, `in HEADER` or `in HEADER after TEXT`, `- original`, `+ mutated`,
`by TEST...`, `case NAME` where a part of a test will do, and for a survivor `survives because ...`. The original occurs once in the header, or first after a text
that does; blanks and line ends are alike. It is a statement if it ends with a semicolon, else an expression."""

import argparse
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / "build/mutants"
SWITCH = """
#include <cstdlib>
#include <type_traits>
namespace trephine {
inline const int mutant_of_this_run = [] {
  const char* const number = std::getenv("TREPHINE_MUTANT");
  return number == nullptr ? 0 : std::atoi(number);
}();
}
constexpr bool trephine_mutant(int number) noexcept {
  if (std::is_constant_evaluated()) return false;
  return number == trephine::mutant_of_this_run;
}
"""


def read_list():
    mutants, block, comment = [], None, []
    for number, line in enumerate((ROOT / "tests/mutants/mutants.txt").read_text().splitlines(), 1):
        key, _, rest = line.strip().partition(" ")
        if key == "#":
            comment.append(rest)
        elif key == "in":
            header, _, after = rest.partition(" after ")
            block = {"number": len(mutants) + 1, "line": number, "felt": " ".join(comment), "in": header, "after": after}
            mutants.append(block)
        elif key in ("-", "+", "by", "case", "survives"):
            block[key] = f"{block[key]} {rest}" if key in block else rest
        elif not key:
            comment = []
        else:
            sys.exit(f"mutants.txt:{number}: {line}")
    return mutants


def place_of(mutant, text):
    """Where the original is, from its first to beyond its last character."""
    def find(original, start, once):
        pattern = re.compile(r"\s+".join(map(re.escape, original.split())))
        found = list(pattern.finditer(text, start))
        if not found or (once and len(found) > 1):
            sys.exit(f"mutants.txt:{mutant['line']}: {mutant['in']} has this {len(found)} times: {original}")
        return found[0]
    start = find(mutant["after"], 0, True).end() if mutant["after"] else 0
    begin, end = find(mutant["-"], start, not mutant["after"]).span()
    # A field that is initialised stays: the expression is its value.
    field = re.match(r"\.\w+ = ", mutant["-"])
    if field:
        mutant["+"] = mutant["+"].removeprefix(field.group())
        begin += field.end()
    return begin, end


def write(path, text):
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def make_tree(mutants, tests):
    tree = WORK / "tree"
    changed = {ROOT / "include/trephine" / m["in"] for m in mutants} | {ROOT / "include/trephine/core/host.hpp"}
    for source in ROOT.rglob("*"):
        inside = source.relative_to(ROOT)
        if inside.parts[0] in ("build", ".git") or not source.is_file() or source in changed:
            continue
        copy = tree / inside
        copy.parent.mkdir(parents=True, exist_ok=True)
        if not copy.exists() or copy.read_bytes() != source.read_bytes():
            shutil.copyfile(source, copy)
    for folder in {test.split("/")[0] for test in tests}:
        for source in (tree / "tests" / folder).glob("*.cpp"):
            if f"{folder}/{source.name}" not in tests:
                source.unlink()
    for header in changed:
        text = header.read_text()
        places = {}
        for m in mutants:
            if ROOT / "include/trephine" / m["in"] == header:
                places.setdefault(place_of(m, text), []).append(m)
        following = len(text)
        for begin, end in sorted(places, reverse=True):
            if end > following:
                sys.exit(f"mutants.txt:{places[begin, end][0]['line']}: overlaps with another one")
            following = begin
            choice = text[begin:end]
            for m in places[begin, end]:
                test = f"trephine_mutant({m['number']})"
                is_statement = m["-"].endswith(";")
                choice = f"if ({test}) {{ {m['+']} }} else {{ {choice} }}" if is_statement else f"({test} ? ({m['+']}) : ({choice}))"
                choice = f"{{ {choice} }}" if is_statement else choice
            text = text[:begin] + choice + text[end:]
        copy = tree / header.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        write(copy, text + (SWITCH if header.name == "host.hpp" else ""))


def build(tests, jobs):
    programs = sorted({"tests_" + test.split("/")[0] for test in tests})
    configure = ["cmake", "-S", WORK / "tree", "-B", WORK / "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=None",
                 "-DCMAKE_CXX_FLAGS=-O1", "-DTREPHINE_WARNINGS_AS_ERRORS=OFF", "-DTREPHINE_BUILD_EXAMPLES=OFF",
                 "-DTREPHINE_BUILD_BENCH=OFF"]
    subprocess.run(configure, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", WORK / "build", "-j", str(jobs), "--target", *programs], check=True)


def run(test, case, mutant, limit=None):
    """Returns what a test, or its cases with this in their names, says: whether it passes, its time, the first failure."""
    folder = test.split("/")[0]
    program = next(p for p in (WORK / "build/tests" / f"tests_{folder}", WORK / "build/tests" / folder / f"tests_{folder}") if p.exists())
    start = time.monotonic()
    try:
        done = subprocess.run([program, f"--source-file=*/{test}", f"--test-case=*{case}*", "--abort-after=1"], cwd=WORK, timeout=limit, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, errors="replace", env={**os.environ, "TREPHINE_MUTANT": str(mutant)})
    except subprocess.TimeoutExpired:
        return False, limit, "hangs"
    failed = re.search(r"TEST CASE: *(.*)", done.stdout)
    passes = done.returncode == 0 and re.search(r"test cases: *[1-9]", done.stdout) is not None
    return passes, time.monotonic() - start, failed.group(1).strip() if failed else f"ends with {done.returncode}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--only", type=int, nargs="+")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    mutants = read_list()
    if options.list:
        for m in mutants:
            print(f"{m['number']:3} {m['in']}: {m['felt']}")
        return 0
    tests = sorted({test for m in mutants for test in m["by"].split()})
    make_tree(mutants, tests)
    build(tests, options.jobs)

    chosen = [m for m in mutants if not options.only or m["number"] in options.only]
    times = {}
    for test in sorted({(test, m.get("case", "")) for m in chosen for test in m["by"].split()}):
        passes, times[test], failure = run(*test, 0)
        print(f"{times[test]:5.1f} s {' '.join(test)}", flush=True)
        if not passes:
            sys.exit(f"{test[0]} fails without a mutant: {failure}")

    def kill(m):
        for test in m["by"].split():
            case = m.get("case", "")
            passes, _, failure = run(test, case, m["number"], 10 * times[test, case] + 10)
            if not passes:
                return f"{test}: {failure}"
        return None

    killed, wrong = 0, 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for m, killer in zip(chosen, pool.map(kill, chosen)):
            reason = m.get("survives")
            killed += killer is not None
            wrong += (killer is None) != (reason is not None)
            verdict = f"killed by {killer}" if killer else f"survives {reason}" if reason else "SURVIVES"
            print(f"{m['number']:3} {verdict}\n    {m['in']}: {m['felt']}: {m['+']}", flush=True)
    print(f"{killed} of {len(chosen)} mutants killed; longest test {max(times.values()):.1f} s")
    return 1 if wrong or killed < 0.95 * len(chosen) else 0


if __name__ == "__main__":
    sys.exit(main())
