# SPDX-License-Identifier: MIT
"""Figures of bench/cutting.md, from cutting.csv, cutting_figures.csv and constants.csv of `bench/run`. A row is name, value, unit
and set, as in figures.py."""

import tables
from tables import digits, places

SPECIMENS = {"MacAvelia 2012: human femurs": "human", "MacAvelia 2012: artificial femurs": "artificial"}


def drills(folder):
    rows = tables.read(folder, "cutting")
    for part, specimen in SPECIMENS.items():
        for speed in ("1000 rpm", "1250 rpm", "1500 rpm"):
            for quantity, unit in (("thrust", "N"), ("torque", "N·mm")):
                for r in tables.where(rows, part=part, case=speed, quantity=quantity):
                    name = f"{specimen}, {speed}{', fitted' if r['fitted'] == 'yes' else ''}"
                    yield (f"{name} / {quantity.capitalize()}: measured, law, run",
                           f"{r['measured']:.0f} ± {r['spread']:.0f}, {r['law']:.0f}, {r['simulated']:.0f}", unit, "MacAvelia et al. 2012")


def others(folder):
    """The 2 mm drill that fitted a constant, and measurements that the law does not reproduce."""
    for r in tables.read(folder, "cutting"):
        case = str(r["case"]).replace(";", ",")
        if r["part"] == "J Braz Soc 2020":
            yield f"{case} / Measured", digits(r["measured"], 3), "N", r["part"]
            yield f"{case} / Law", digits(r["law"], 3), "N", r["part"]
        elif r["part"] == "James 2013":
            yield f"{case}, ratio / Measured", digits(r["measured"]), "", r["part"]
            yield f"{case}, ratio / Law", digits(r["law"]), "", r["part"]
        elif r["part"] == "other femurs":
            yield f"{case}, by the law / Measured", digits(r["measured"]), "", r["part"]
            yield f"{case}, by the law / Law", "1", "", r["part"]


def hands(folder):
    for r in tables.where(tables.read(folder, "cutting"), part="operators"):
        yield (f"{str(r['case']).replace(';', ',')} / {str(r['quantity']).capitalize()}", digits(r["simulated"]), "N",
               "round burr of 2.3 mm, 20 000 rpm")


def cuts(folder):
    columns = {"mean force": ("Mean force", 3), "ripple rms": ("Ripple, rms", 2), "removed": ("Removed", 3)}
    for r in tables.where(tables.read(folder, "cutting"), part="beside"):
        title, count = columns[r["quantity"]]
        yield (f"{r['case']} / {title}", digits(r["simulated"], count), str(r["unit"]).replace("mm3", "mm³"),
               "match-head of 3 mm, a device of 8.5 N")


def loops(folder):
    rows = tables.where(tables.read(folder, "cutting"), part="stability")
    single = [r for r in rows if "loops" not in str(r["case"])]
    for title, quantity in (("With the law", "ripple rms with the law"), ("Geometric cut", "ripple rms without")):
        ripples = [r["simulated"] for r in tables.where(single, quantity=quantity)]
        yield f"worst ripple / {title}", digits(max(ripples, default=None)), "N", f"{len(ripples)} loops"
    for r in tables.where(rows, case="of 42 loops"):
        yield "loops with a ripple over a tenth of the device's force / With the law", digits(r["simulated"]), "", "42 loops"


def plunges(folder):
    rows = tables.read(folder, "cutting_figures")
    asked = [("thrust, voxels to 0.3 mm", "thrust off the law; voxels to 0.3 mm"), ("torque, voxels to 0.3 mm", "torque off the law; voxels to 0.3 mm"),
             ("thrust, 0.5 mm", "thrust off the law; voxels of 0.5 mm"), ("torque, 0.5 mm", "torque off the law; voxels of 0.5 mm"),
             ("work of chips off u by volume", "work of chips off u by volume")]
    for name, figure in asked:
        for title in ("median", "worst"):
            yield f"{name} / {title.capitalize()}", digits(100 * tables.first(tables.where(rows, figure=figure), title)), "%", "120 plunges of five tools"
    along = [r for r in rows if str(r["figure"]).startswith("breakthrough") and "median" not in str(r["figure"])]
    for name, way in (("fall of thrust at the far side, along voxels", "along voxels"), ("– askew", "askew")):
        mine = [r for r in along if way in str(r["figure"])]
        for title in ("median", "worst"):
            yield f"{name} / {title.capitalize()}", digits(max((r[title] for r in mine), default=None)), "ms", "72 plates, 1 and 4 kHz; worst blur"


CONSTANTS = {
    "kLead": "where elements sample: half a voxel", "kLead / 6, where bone is whole": "density that counts as whole bone",
    "kFilm": "how much nearer they look for a film", "distance of the voxels that strength is of": "distance of the densest voxels",
    "lag": "lag of the spindle's work", "least share of the elements": "least share of the elements that counts",
    "release": "time of a release", "kPressureBite": "share of the bite before pressure", "kGuide": "flutes that finish a drill's wall",
    "kMaxRoom": "room in a hole: a thousandth of the radius", "kSteepness": "steepness of a cut's slope", "kMaxStartAhead": "how far ahead a search starts",
    "kCatchUp": "catching up where a rim is held", "kSharpCorner": "what voxels lack at a corner",
    "kBands": "bands of elements: 20 and 28 for 24", "kSmallStep": "Newton's smallest step",
}


def constants(folder):
    """By constant and factor the figure that changed most, as a share of its bound."""
    rows = tables.read(folder, "constants")
    plunged = {str(r["figure"]) for r in tables.read(folder, "cutting_figures")}
    for constant, name in CONSTANTS.items():
        for title, factor in (("A fifth less", 0.8), ("A fifth more", 1.2)):
            mine = [r for r in tables.where(rows, constant=constant, factor=factor) if str(r["figure"]) in plunged and "ms]" not in str(r["figure"])]
            shares = {r["figure"]: abs(r["after"] - r["before"]) / r["bound"] for r in mine if r["bound"]}
            if not shares:
                yield f"{name} / {title}", None, "", "20 plunges, two slots"
                continue
            most = max(shares, key=shares.get)
            share = places(100 * shares[most], 0)
            what = str(most).split(";")[0].replace(" off the law", "").replace("slot: ", "a slot's ")
            yield f"{name} / {title}", share + " %" + ("" if share == "0" else ", " + what), "", "20 plunges, two slots"


def time(folder):
    titles = {"tick without": "Tick without", "more; median": "More", "p99 without": "p99 without", "p99 with": "p99 with"}
    for r in tables.where(tables.read(folder, "cutting"), part="time"):
        yield f"{str(r['case']).replace(';', ',')} / {titles[r['quantity']]}", digits(r["simulated"]), "µs", "ticks in turn"


def tested(folder):
    """Rows of measured.csv that fitted nothing and were run."""
    return [r for r in tables.read(folder, "measured") if r["role"] == "test" and r["holds"] in ("yes", "no")]


def measured(folder):
    """How many of the published cuts the law gives."""
    rows = tested(folder)
    drills, burrs, others = ("twist",), ("fluted", "diamond"), ("saw", "other")
    for name, kinds, signs in (("Forces and torques of drills, within a factor of two", drills, False),
                               ("Trends and effects of drills", drills, True), ("Trends and effects of burrs", burrs, True),
                               ("Sizes of edges, motors and dura, within a factor of two", others + burrs, False),
                               ("Trends of edges and motors", others, True)):
        of = [r for r in rows if r["kind"] in kinds and (r["unit"] in ("sign", "yes")) == signs]
        yield f"{name} / Hold", str(len(tables.where(of, holds="yes"))), "", "bench/cutting/measured.csv"
        yield f"{name} / Of", str(len(of)), "", "bench/cutting/measured.csv"
    alone = [r for r in tables.read(folder, "measured") if r["role"] == "test" and isinstance(r["held_by"], str)]
    yield "Held by tests of their own, and not run here / Of", str(len(alone)), "", "bench/cutting/measured.csv"


def missed(folder):
    for r in tables.where(tested(folder), holds="no"):
        name = f"{r['id'].partition('-')[0]}: {r['quantity'].rpartition(': ')[2]}"
        trend = r["unit"] in ("sign", "yes")
        yield f"{name} / Measured", places(r["value"], 0) if trend else digits(r["value"]), "", r["source"]
        yield f"{name} / Law", digits(100 * r["law"] if trend else r["law"]).replace("-", "−"), "%" if trend else "", "of a run in bone"
