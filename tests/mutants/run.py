# SPDX-License-Identifier: MIT
"""run.py [--list] [--only N...] [--jobs N]: a mutation test of the library.

`mutants.txt` holds faults of one line, each with the tests that must see it. All of them are written at once into a
copy of the tree, each as a choice that the environment variable TREPHINE_MUTANT makes, so that a folder of tests
compiles once. Each mutant is then run with its tests alone, until one fails, crashes or hangs.

Fails if under 95 % are killed, if a survivor has no reason, and if one with a reason is killed.

The list: a comment about what a user would feel; `in HEADER` or `in HEADER after TEXT`; `- original`; `+ mutated`;
`by TEST...`; `case NAME` where some of a test's cases will do; `survives because ...` for a survivor. The original
occurs once in the header, or is the first after a text that occurs once; blanks and line ends are alike. It is a
statement if it ends with a semicolon, else an expression, or `.field = expression`."""

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
HEADERS = ROOT / "include/trephine"
WORK = ROOT / "build/mutants"
TREE, BUILD = WORK / "tree", WORK / "build"
# At the end of the header that all others include.
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
    mutants, comment = [], []
    for line_number, line in enumerate((ROOT / "tests/mutants/mutants.txt").read_text().splitlines(), 1):
        key, _, rest = line.strip().partition(" ")
        if key == "#":
            comment.append(rest)
        elif key == "in":
            header, _, after = rest.partition(" after ")
            mutants.append({"number": len(mutants) + 1, "line": line_number, "felt": " ".join(comment),
                            "in": header, "after": after, "case": ""})
        elif key in ("-", "+", "by", "case", "survives"):
            mutants[-1][key] = rest
        elif not key:
            comment = []
        else:
            sys.exit(f"mutants.txt:{line_number}: {line}")
    return mutants


def place_of(mutant, text):
    """Where the original is: its first character, and the one after it."""
    def find(original, start, once):
        pattern = re.compile(r"\s+".join(map(re.escape, original.split())))
        found = list(pattern.finditer(text, start))
        if not found or (once and len(found) > 1):
            sys.exit(f"mutants.txt:{mutant['line']}: {mutant['in']} has this {len(found)} times: {original}")
        return found[0]
    start = find(mutant["after"], 0, True).end() if mutant["after"] else 0
    begin, end = find(mutant["-"], start, not mutant["after"]).span()
    field = re.match(r"\.\w+ = ", mutant["-"])
    return begin + field.end() if field else begin, end


def with_choices(header, mutants):
    """A header's text with a choice at the place of each of its mutants."""
    text = header.read_text()
    places = {}
    for m in mutants:
        if HEADERS / m["in"] == header:
            places.setdefault(place_of(m, text), []).append(m)
    following = len(text)
    for begin, end in sorted(places, reverse=True):
        choice = text[begin:end]
        for m in places[begin, end]:
            if end > following:
                sys.exit(f"mutants.txt:{m['line']}: overlaps with another one")
            test, mutated = f"trephine_mutant({m['number']})", re.sub(r"^\.\w+ = ", "", m["+"])
            if m["-"].endswith(";"):
                choice = f"{{ if ({test}) {{ {mutated} }} else {{ {choice} }} }}"
            else:
                choice = f"({test} ? ({mutated}) : ({choice}))"
        text, following = text[:begin] + choice + text[end:], begin
    return text + (SWITCH if header.name == "host.hpp" else "")


def make_tree(mutants, tests):
    """Copies the tree. What is equal stays, so that nothing of it is compiled again."""
    mutated = {HEADERS / m["in"] for m in mutants} | {HEADERS / "core/host.hpp"}
    folders = {test.split("/")[0] for test in tests}
    wanted = {}
    for source in ROOT.rglob("*"):
        inside = source.relative_to(ROOT)
        if inside.parts[0] in ("build", ".git") or not source.is_file():
            continue
        is_test = inside.parts[0] == "tests" and inside.parts[1] in folders and source.suffix == ".cpp"
        if not is_test or "/".join(inside.parts[1:]) in tests:
            wanted[TREE / inside] = source
    for copy in TREE.rglob("*"):
        if copy.is_file() and copy not in wanted:
            copy.unlink()
    for copy, source in wanted.items():
        content = with_choices(source, mutants).encode() if source in mutated else source.read_bytes()
        if not copy.exists() or copy.read_bytes() != content:
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(content)
            shutil.copymode(source, copy)


def build(tests, jobs):
    programs = sorted({"tests_" + test.split("/")[0] for test in tests})
    off = [f"-DTREPHINE_{option}=OFF" for option in ("WARNINGS_AS_ERRORS", "BUILD_EXAMPLES", "BUILD_BENCH")]
    subprocess.run(["cmake", "-S", TREE, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=None", "-DCMAKE_CXX_FLAGS=-O1",
                    *off], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", BUILD, "-j", str(jobs), "--target", *programs], check=True)


def run(test, case, mutant, limit=None):
    """Runs a test, or its cases with this in their names: whether it passes, its time [s], and the first failure."""
    program = "tests_" + test.split("/")[0]
    path = next(path for path in BUILD.rglob(program) if path.is_file())
    command = [path, f"--source-file=*/{test}", f"--test-case=*{case}*", "--abort-after=1"]
    start = time.monotonic()
    try:
        done = subprocess.run(command, cwd=WORK, env={**os.environ, "TREPHINE_MUTANT": str(mutant)}, timeout=limit,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
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
            place_of(m, (HEADERS / m["in"]).read_text())
            print(f"{m['number']:3} {m['in']}: {m['felt']}: {m['+']}")
        return 0
    tests = {test for m in mutants for test in m["by"].split()}
    make_tree(mutants, tests)
    build(tests, options.jobs)

    chosen = [m for m in mutants if not options.only or m["number"] in options.only]
    times = {}
    for test, case in sorted({(test, m["case"]) for m in chosen for test in m["by"].split()}):
        passes, times[test, case], failure = run(test, case, 0)
        print(f"{times[test, case]:5.1f} s  {test} {case}", flush=True)
        if not passes:
            sys.exit(f"{test} fails without a mutant: {failure}")

    def kill(m):
        for test in m["by"].split():
            passes, _, failure = run(test, m["case"], m["number"], 10 * times[test, m["case"]] + 10)
            if not passes:
                return f"{test}: {failure}"
        return None

    killed, wrong = 0, 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for m, killer in zip(chosen, pool.map(kill, chosen)):
            killed += killer is not None
            wrong += (killer is None) != ("survives" in m)
            verdict = f"killed by {killer}" if killer else f"survives {m['survives']}" if "survives" in m else "SURVIVES"
            print(f"{m['number']:3} {verdict}\n    {m['in']}: {m['felt']}: {m['+']}", flush=True)
    print(f"{killed} of {len(chosen)} mutants killed")
    return 1 if wrong or killed < 0.95 * len(chosen) else 0


if __name__ == "__main__":
    sys.exit(main())
