# SPDX-License-Identifier: MIT
"""compare.py --program bench_milling --out DIR [--rows measured.csv] [--quick]: runs each published cut of measured.csv.

Writes DIR/measured.csv: the row, the law's value from a run in bone, and whether it holds. A magnitude holds within a
factor of two or one standard deviation, a trend if its sign does, and a trend of 0 within a tenth. Prints misses first.
A condition that a paper does not state is one of DEFAULTS."""

import argparse
import csv
import os
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
DEFAULTS = {"speed": 40000, "feed": 2, "depth": 0.5}
DIAMETER = {"fluted": 4, "diamond": 4, "twist": 3.2}
FAMILY = {"fluted": "round", "diamond": "diamond", "twist": "twist"}
LIMITS = {"round": (0.6, 7), "diamond": (0.6, 7), "twist": (1, 6)}
# What a trend changes, and to what; `kind` goes from the fluted burr to the diamond.
CHANGES = {"feed": ("feed", 2), "speed": ("speed", 2), "depth": ("depth", 2), "load": ("load", 2), "wear": ("wear", 1),
           "density": ("strength", 4), "angle": ("tilt", 60), "kind": ("tool", "diamond"), "diameter": ("tool", 1.5)}


def number(text):
    return float(text) if text else None


def condition(row):
    """Arguments of the program."""
    family = FAMILY[row["kind"]]
    least, most = LIMITS[family]
    diameter = min(max(number(row["diameter_mm"]) or DIAMETER[row["kind"]], least), most)
    out = {"tool": f"{family}-{diameter:g}", "strength": number(row["strength"]) or 1}
    for key, column in (("speed", "speed_rpm"), ("feed", "feed_mm_s"), ("depth", "depth_mm"), ("load", "load_N")):
        value = number(row[column])
        out[key] = DEFAULTS.get(key, 0) if value is None else value
    if row["edges"]:
        out["flutes"] = row["edges"]
    if row["kind"] == "twist" or out["load"]:
        out["depth"] = 0
    if out["load"] and not row["feed_mm_s"]:  # pressed straight into the bone
        out["feed"] = 0
    if row["angle_deg"]:
        out["tilt"] = row["angle_deg"]
    if row["stall_N_mm"]:
        out["stall"] = row["stall_N_mm"]
    return out


def run(program, arguments):
    said = subprocess.run([program, *(f"{k}={v}" for k, v in arguments.items())], capture_output=True, text=True)
    if said.returncode:
        sys.exit(said.stderr.strip())
    out = {key: float(value) for key, value in (line.split() for line in said.stdout.splitlines())}
    out["normal over tangential"] = out["normal"] / max(out["tangential"], 1e-9)
    return out


def changed(arguments, by):
    key, to = CHANGES[by]
    out = dict(arguments)
    family, _, diameter = arguments["tool"].rpartition("-")
    if by == "kind":
        out["tool"] = f"{to}-{diameter}"
    elif by == "diameter":
        out["tool"] = f"{family}-{to * float(diameter):g}"
    elif by in ("feed", "speed", "depth", "load", "density"):
        out[key] = to * float(arguments[key])
    else:
        out[key] = to
    return out


def judge(row, program):
    """The law's value, and whether it holds."""
    arguments, measured, quantity = condition(row), row["value"], row["quantity"]
    if quantity.startswith("trend of "):
        what, _, by = quantity.removeprefix("trend of ").partition(" with ")
        before, after = run(program, arguments)[what], run(program, changed(arguments, by))[what]
        change = after / before - 1
        sign = 0 if abs(change) < 0.1 else 1 if change > 0 else -1
        return change, sign != 0 if measured == "differs" else sign == float(measured)
    value = run(program, arguments)[quantity]
    measured = float(measured)
    near = abs(value - measured) <= (number(row["spread"]) or 0)
    return value, near or measured / 2 <= value <= measured * 2


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--out", default="build/report")
    parser.add_argument("--rows", default=os.path.join(HERE, "measured.csv"))
    given = parser.parse_args()
    with open(given.rows, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    judged = []
    for row in rows:
        law, holds = ("", "") if row["role"] == "none" else judge(row, given.program)
        judged.append({**row, "law": law if law == "" else f"{law:.4g}", "holds": "" if holds == "" else "yes" if holds else "no"})
    os.makedirs(given.out, exist_ok=True)
    with open(os.path.join(given.out, "measured.csv"), "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, judged[0].keys())
        writer.writeheader()
        writer.writerows(judged)
    for row in sorted(judged, key=lambda r: ["no", "yes", ""].index(r["holds"])):
        verdict = row["holds"].replace("yes", "holds").replace("no", "MISSED") or "not run: " + row["why_not"]
        print(f'{row["id"]:6} {row["source"][:40]:40} {row["quantity"][:36]:36} measured {row["value"]:>7} '
              f'law {row["law"]:>8} {row["unit"]:8} {row["role"]:5} {verdict}')
    tests = [r for r in judged if r["role"] == "test"]
    trends = [r for r in tests if r["quantity"].startswith("trend")]
    sizes = [r for r in tests if r not in trends]
    for name, of in (("magnitudes", sizes), ("trends", trends)):
        print(f'{name}: {sum(r["holds"] == "yes" for r in of)} of {len(of)} hold')


if __name__ == "__main__":
    main()
