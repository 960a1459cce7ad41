#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""compare.py --program bench_milling [--out DIR]: runs the published cuts of measured.csv in bone, by the cutting law.

Writes DIR/measured.csv: each row with the law's value, whether it holds, and what the run assumed because the source
does not state it. A magnitude holds within a factor of two or one standard deviation. A trend holds if the law's sign
is the measured one, where a change below a hundredth has no sign, and a trend of 0 within a tenth. An effect holds if
the law changes by more than a tenth. Rows that name a test are held by it and not run. Prints misses first."""

import argparse
import csv
import functools
import math
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).parent
QUANTITIES = {"thrust": "thrust", "force": "thrust", "normal force": "normal", "tangential force": "tangential",
              "torque": "torque", "specific energy": "energy", "spindle speed": "speed", "removal rate": "rate",
              "normal to tangential force": "ratio", "sound": "sound", "speed lost under load to free": "lost",
              "modulus": "modulus", "strength": "stress", "strain at rupture": "strain",
              "indentation before rupture": "depth"}
# Of a motor, by its runs from almost no load until it stalls: pairs of torque [N mm] and speed [1/min].
LOADS = (0.01, 0.5, 1, 1.25, 1.5, 1.75, 2, 2.5, 4)
MOTORS = {"stall torque, largest": lambda runs: max(torque for torque, _ in runs),
          "free speed, largest": lambda runs: max(speed for _, speed in runs),
          "power, largest": lambda runs: max(power(*at) for at in runs),
          "speed of largest power to free speed": lambda runs: 100 * max(runs, key=lambda at: power(*at))[1] / runs[0][1],
          "trend: torque by speed, linear": lambda runs: correlation(runs)}
# A quantity at two depths [um], whose ratio is meant.
DEPTHS = re.compile(r"(.+) at (\S+) to (\S+) um")
# What a trend changes: an argument and the factor on it, or what it becomes.
CHANGES = {"feed": ("feed", 2), "speed": ("speed", 2), "depth": ("depth", 2), "load": ("load", 2),
           "removal rate": ("feed", 2), "density": ("strength", 2), "grey value": ("strength", 2),
           "dentine after enamel": ("strength", 0.5), "wear": ("wear", "1"), "tool's angle": ("tilt", "60"),
           "burr type": ("family", "diamond"), "edge speed": ("speed", 2),
           "length of chisel edge": ("chisel", 2), "twist drill after round bur": ("family", "twist")}
# Conditions that a source does not state in what was read of it, by the beginning of its rows' names; the last that
# fits counts. Dental burrs cut with their side, on an air turbine. Leucite ceramic is taken as ten times as strong as
# cortical bone, from hardnesses of 5.5 to 6 GPa and 0.5 GPa.
DENTAL = {"tool": "diamond-1", "speed": 300000, "feed": 0.5, "depth": 0.03, "tilt": 85, "stall": 2.33}
CERAMIC = {**DENTAL, "strength": 10}
PRESSED = {"tool": "diamond-1.6", "speed": 300000, "load": 0.5, "stall": 2.33}
EDGE = {"edge": 1, "depth": 0.005}
DURA = {"membrane": "dura", "tool": "round-3"}
ASSUMED = {"": {"tool": "round-4", "speed": 40000, "feed": 2, "depth": 0.5},
           "danda-feed": {"tool": "round-4", "speed": 60000, "feed": 2, "load": 1},
           "zhang20": {"tool": "diamond-4", "speed": 40000, "feed": 1, "depth": 0.3},
           "operators": {"tool": "round-2.3", "speed": 20000, "feed": 1},
           "leucite": CERAMIC, "song": CERAMIC, "dong": PRESSED, "macor": PRESSED, "grits": PRESSED, "jprosth": PRESSED,
           "jor95": PRESSED, "f57": {**PRESSED, "tool": "round-1"},
           "macavelia-artificial": {"strength": 0.44}, "highspeed": {"speed": 6000, "feed": 0.833},
           "orelaja": {"speed": 1000, "feed": 1}, "abjs": {"tool": "twist-3.2", "speed": 1000, "feed": 1},
           "wolff": {"tool": "twist-3.2", "speed": 1000, "feed": 1},
           "staroveski": {"tool": "twist-3.2", "speed": 1000, "feed": 1},
           "saha": {"tool": "twist-3.2", "speed": 1000, "feed": 1}, "hartl": {"load": 3}, "james": EDGE, "ortho-u": EDGE,
           "zwirner": DURA, "zarzur": DURA, "brockhurst": {"tool": "round-2", "strength": 16},
           "dyson": {"tool": "round-2", "strength": 16}}
STATED = {"speed": "speed_rpm", "feed": "feed_mm_s", "depth": "depth_mm", "load": "load_N", "flutes": "edges"}
FAMILY = {"fluted": "round", "diamond": "diamond", "twist": "twist"}


def first_number(text):
    return float(text.partition("..")[0])


def conditions(row):
    """Arguments of the program, and those of them that are assumed."""
    assumed = [v for name, v in ASSUMED.items() if row["id"].startswith(name)][-1]
    if row["kind"] == "twist" and assumed is ASSUMED[""]:
        assumed = {}
    out = dict(assumed)
    stated = {key: first_number(row[column]) for key, column in STATED.items() if row[column]}
    if row["kind"] == "twist":
        stated.pop("depth", None)  # of the hole
    if row["diameter_mm"]:
        stated["tool"] = f'{FAMILY[row["kind"]]}-{first_number(row["diameter_mm"]):g}'
    out.update(stated)
    if "load" in out and "feed" not in out:
        out["feed"] = 0  # pressed straight into the bone
    return out, {key: value for key, value in assumed.items() if key not in stated}


def changed(arguments, by):
    key, to = next(change for name, change in CHANGES.items() if by.startswith(name))
    if key == "family":
        return {**arguments, "tool": f'{to}-{arguments["tool"].rpartition("-")[2]}'}
    return {**arguments, key: to if isinstance(to, str) else to * float(arguments.get(key, 1))}


def run(program, arguments):
    said = subprocess.run([program, *(f"{k}={v}" for k, v in arguments.items())], capture_output=True, text=True)
    if said.returncode:
        sys.exit(f"{arguments}: {said.stderr.strip()}")
    out = {key: float(value) for key, value in (line.split() for line in said.stdout.splitlines())}
    if out.get("tangential"):
        out["ratio"] = out.get("normal", math.nan) / out["tangential"]
    return out


def power(torque, speed):
    return 1e-3 * torque * speed * math.pi / 30


def correlation(pairs):
    n = len(pairs)
    means = [sum(values) / n for values in zip(*pairs)]
    off = [[value - mean for value, mean in zip(pair, means)] for pair in pairs]
    return sum(a * b for a, b in off) / math.sqrt(sum(a * a for a, _ in off) * sum(b * b for _, b in off))


@functools.cache
def motor(program, name, tool, strength):
    runs = [run(program, {"motor": name, "tool": tool, "strength": strength, "load": load, "feed": 0}) for load in LOADS]
    return [(at["torque"], at["speed"]) for at in runs]


def parts(row):
    """Kind of a row, the program's name of its quantity, and what a trend or an effect changes; None: not run here."""
    if row["quantity"] in MOTORS:
        return row["quantity"].rpartition(": ")[0], row["quantity"], ""
    kind, _, rest = row["quantity"].rpartition(": ")
    of, by = re.fullmatch(r"(.+?)(?: by |, )(.+)", rest).groups() if kind in ("trend", "effect") else (rest, "")
    of = DEPTHS.sub(r"\1", of)
    known = row["kind"] in FAMILY or any(row["id"].startswith(name) for name in ASSUMED if name)
    runs = known and of in QUANTITIES and (not by or any(by.startswith(name) for name in CHANGES))
    return (kind, QUANTITIES[of], by) if runs else None


def judge(row, program):
    """The law's value, whether it holds, and what was assumed."""
    kind, of, by = parts(row)
    arguments, assumed = conditions(row)
    measured = float(row["value"])
    if of in MOTORS:
        value = MOTORS[of](motor(program, "air-turbine", arguments["tool"], arguments["strength"]))
    elif depths := DEPTHS.fullmatch(row["quantity"]):
        one, other = (run(program, {**arguments, "depth": 1e-3 * float(depths[i])})[of] for i in (2, 3))
        value = one / other
    else:
        value = run(program, arguments)[of]
    if kind == "trend" and not by:  # the value is the trend's own
        holds = abs(value) > 0.99 and value * measured > 0
    elif by:
        value = run(program, changed(arguments, by))[of] / value - 1
        small = abs(value) < 0.1
        holds = not small if kind == "effect" else small if measured == 0 else abs(value) > 0.01 and value * measured > 0
    else:
        spread = row["spread"] if ".." not in row["spread"] else ""
        holds = abs(value - measured) <= float(spread or 0) or measured / 2 <= value <= 2 * measured
    return value, holds, " ".join(f"{k}={v}" for k, v in assumed.items())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--out", default="build/report")
    given = parser.parse_args()
    rows = list(csv.DictReader((HERE / "measured.csv").open(newline="", encoding="utf-8")))
    for row in rows:
        row.update(law="", holds="", assumed="")
        if row["role"] != "none" and not row["held_by"] and parts(row):
            value, holds, assumed = judge(row, given.program)
            row.update(law=f"{value:.4g}", holds="yes" if holds else "no", assumed=assumed)
    out = pathlib.Path(given.out)
    out.mkdir(parents=True, exist_ok=True)
    with (out / "measured.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    for row in sorted((r for r in rows if r["role"] != "none"), key=lambda r: ("no", "yes", "").index(r["holds"])):
        verdict = {"no": "MISSED", "yes": "holds", "": "by its test"}[row["holds"]]
        print(f'{verdict:12} {row["role"]:4} {row["id"]:28} {row["quantity"][:44]:44} {row["value"]:>6} {row["law"]:>9} {row["unit"]}')
    tests = [r for r in rows if r["role"] == "test" and r["holds"]]
    for name, of in (("magnitudes", [r for r in tests if parts(r)[0] not in ("trend", "effect")]),
                     ("trends and effects", [r for r in tests if parts(r)[0] in ("trend", "effect")])):
        print(f'{name}: {sum(r["holds"] == "yes" for r in of)} of {len(of)} hold')


if __name__ == "__main__":
    main()
