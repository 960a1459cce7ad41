# SPDX-License-Identifier: MIT
"""check_mistakes.py FOLDER COMPILER [ARGUMENTS...]: each source in FOLDER ends in one sentence that says what to write.

A source has a line `// says: TEXT`, and may have one `// with: ARGUMENTS`. Compiled, it must fail, print TEXT, and be
done with one static assertion (or #error) in at most kMaxLines lines."""

import concurrent.futures
import glob
import os
import re
import subprocess
import sys

kMaxLines = 12


def fault(source, command):
    with open(source, encoding="utf-8") as file:
        text = file.read()
    says = re.search(r"^// says: (.*)$", text, re.M).group(1)
    extra = re.search(r"^// with: (.*)$", text, re.M)
    arguments = command + (extra.group(1).split() if extra else []) + ["-fsyntax-only", source]
    run = subprocess.run(arguments, capture_output=True, text=True, check=False, env={**os.environ, "LC_ALL": "C"})
    said = run.stderr
    lines = len(said.splitlines())
    errors = len(re.findall(r"(?<!fatal) error: ", said))
    if run.returncode != 0 and says in said and errors == 1 and lines <= kMaxLines:
        return None
    return f"{source}: ended with {run.returncode}, {errors} errors in {lines} lines, expected '{says}':\n{said}"


def main():
    sources = sorted(glob.glob(os.path.join(sys.argv[1], "*.cpp")))
    if not sources:
        print(f"no sources in {sys.argv[1]}", file=sys.stderr)
        return 1
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        faults = [f for f in pool.map(lambda s: fault(s, sys.argv[2:]), sources) if f]
    for text in faults:
        print(text, file=sys.stderr)
    print(f"{len(sources)} mistakes, {len(faults)} of them not well told")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
