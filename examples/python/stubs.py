# SPDX-License-Identifier: MIT
"""Writes trephine/__init__.pyi beside the built module, from the module itself: stubs.py FOLDER-OF-THE-PACKAGE"""

import enum
import inspect
import re
import sys
from pathlib import Path

package = Path(sys.argv[1])
sys.path.insert(0, str(package.parent))
import trephine  # noqa: E402

# Arguments that any object is taken for, and looked at by the module.
GIVEN = {
    "voxels": "NDArray[Any]",
    "labels": "NDArray[Any]",
    "spindle": "ArrayLike",
    "dt": "ArrayLike",
    "renderer": "str | CoupledOptions | LineOptions | SurfaceOptions | RendererOptions | DevicePreset",
}

HEAD = '''# Written by stubs.py from the module.
import enum
import os
from typing import Any, ClassVar, NamedTuple, overload

import numpy
from numpy.typing import ArrayLike, NDArray

Cut = GeometricCut | RateLimitedCut | AdvancingCut | PressureCut
__version__: str
'''


def type_of(text, given):
    """A type of pybind11's signatures as a checker writes it; arrays that are given may be anything like one."""
    text = re.sub(r"\btrephine\.(_trephine\.)?", "", text)
    text = re.sub(r"numpy\.ndarray\[numpy\.float64\]", "ArrayLike" if given else "NDArray[numpy.float64]", text)
    text = re.sub(r"numpy\.ndarray\[(numpy\.\w+|bool)\]", lambda m: f"NDArray[{m[1].replace('bool', 'numpy.bool_')}]", text)
    text = re.sub(r"numpy\.ndarray\b(?!\[)", "NDArray[Any]", text)
    text = re.sub(r"\bdtype\b", "numpy.dtype[Any]", text).replace("numpy.numpy.", "numpy.")
    text = re.sub(r"Optional\[(.*)\]$", r"\1 | None", text)
    while "Union[" in text:
        text = re.sub(r"Union\[([^][]*)\]", lambda m: m[1].replace(", ", " | "), text)
    text = re.sub(r"\b(List|Dict|Tuple)\[", lambda m: m[0].lower(), text)
    text = text.replace("os.PathLike", "str | os.PathLike[str]") if given else text
    text = re.sub(r"\b(object|dict)\b(?!\[)", lambda m: {"dict": "dict[str, NDArray[Any]]"}.get(m[1], "Any"), text)
    return text


def split(arguments):
    """Splits at the commas that stand in no bracket."""
    parts, depth, text = [], 0, ""
    for c in arguments:
        depth += c in "([{<"
        depth -= c in ")]}>"
        if c == "," and depth == 0:
            parts.append(text.strip())
            text = ""
        else:
            text += c
    return parts + [text.strip()] if text.strip() else parts


def signature(line):
    """name(arguments) -> type, as pybind11 writes it, without the values of defaults."""
    name, rest = line.split("(", 1)
    arguments, result = rest.rsplit(") -> ", 1)
    made = []
    for argument in split(arguments):
        declared, default = (argument.split(" = ", 1) + [""])[:2] if " = " in argument else (argument, "")
        if argument in ("self", "*") or argument.startswith("**"):
            made.append(argument + (": Any" if argument.startswith("**") else ""))
            continue
        parameter, kind = declared.split(": ", 1)
        if parameter == "self":
            made.append("self")
            continue
        kind = GIVEN.get(parameter, "Any") if kind == "object" else type_of(kind, True)
        made.append(f"{parameter}: {kind}" + (" = ..." if default else ""))
    return f"def {name}({', '.join(made)}) -> {type_of(result, False)}: ..."


def lines_of(function, name):
    """The stub of a function, of each of its overloads."""
    doc = inspect.getdoc(function) or ""
    found = [re.sub(r"^\d+\. ", "", line) for line in doc.splitlines() if re.match(rf"(\d+\. )?{name}\(.*\) -> ", line)]
    if len(found) > 1 and found[0].startswith(f"{name}(*args"):
        found = found[1:]
    for line in found:
        if len(found) > 1:
            yield "@overload"
        yield signature(line)


def class_lines(cls):
    base = "enum.IntEnum" if issubclass(cls, enum.IntEnum) else cls.__base__.__name__
    yield f"class {cls.__name__}{'' if base == 'pybind11_object' else f'({base})'}:"
    members = vars(cls)
    if issubclass(cls, enum.IntEnum):
        yield from (f"    {entry.name} = {entry.value}" for entry in cls)
        return
    if "__entries" in members:
        yield f"    __members__: ClassVar[dict[str, {cls.__name__}]]"
        for name in cls.__members__:
            yield f"    {name}: ClassVar[{cls.__name__}]"
        for line in ("def __init__(self, value: int) -> None: ...", "def __int__(self) -> int: ...", "def __index__(self) -> int: ..."):
            yield "    " + line
        for name in ("name", "value"):
            yield "    @property"
            yield f"    def {name}(self) -> {'str' if name == 'name' else 'int'}: ..."
        return
    count = 0
    for name, member in members.items():
        if isinstance(member, property):
            kind = type_of(re.search(r"-> (.*)", member.fget.__doc__)[1], False)
            yield "    @property"
            yield f"    def {name}(self) -> {kind}: ..."
            if member.fset:
                given = type_of(split(re.search(r"\((.*)\) -> ", member.fset.__doc__)[1])[-1].split(": ", 1)[1], True)
                yield f"    @{name}.setter"
                yield f"    def {name}(self, value: {given}) -> None: ..."
            count += 1
        elif isinstance(member, staticmethod):
            for line in lines_of(member.__func__, name):
                yield "    @staticmethod"
                yield "    " + line
                count += 1
        elif name in ("__init__", "__len__", "__enter__", "__exit__") or not name.startswith("_"):
            for line in lines_of(member, name):
                yield "    " + line
                count += 1
    if count == 0:
        yield "    ..."


def python_lines(item):
    """What the package's own Python declares is copied."""
    source = inspect.getsource(item)
    if inspect.isclass(item) and issubclass(item, OSError):
        return [f"class {item.__name__}(OSError): ..."]
    if inspect.isfunction(item):
        return [re.sub(r"\s+", " ", source[: source.index(":\n    \"\"\"")]).replace("( ", "(").replace(" )", ")") + ": ..."]
    kept = [f"class {item.__name__}(NamedTuple):"]
    for name, kind in item.__annotations__.items():
        kept.append(f"    {name}: {getattr(kind, '__forward_arg__', kind)}".replace("numpy.ndarray", "NDArray[Any]"))
    for name, member in vars(item).items():
        if inspect.isfunction(member) and member.__module__ == item.__module__ and not name.startswith("_"):
            kept.append(f"    def {name}{inspect.signature(member)}: ...".replace("'", "").replace("numpy.ndarray", "NDArray[Any]"))
    return kept


out = [HEAD]
for name in trephine.__all__:
    item = getattr(trephine, name)
    if getattr(item, "__module__", "") == "trephine" and (inspect.isfunction(item) or hasattr(item, "_fields") and issubclass(item, tuple) or inspect.isclass(item) and issubclass(item, OSError)):
        out += python_lines(item)
    elif inspect.isclass(item):
        out += class_lines(item)
    else:
        out += lines_of(item, name)
(package / "__init__.pyi").write_text("\n".join(out) + "\n", encoding="utf-8")
