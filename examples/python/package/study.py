# SPDX-License-Identifier: MIT
"""Studies: a function over many cases, in this process or on Dask's workers, as one table.

    def hole(feed, place, scene):           # each call has a copy of `scene` of its own
        ...
        return {"peak_N": peak, "removed_mm3": removed}

    table = study.run(hole, {"feed": [1e-3, 2e-3], "place": range(8)}, scene=scene, out="holes.csv")
    table["peak_N"]                         # of the 16 cases, in their order

With `client=distributed.Client(...)` the cases go over the workers, and the table has the same bits.
"""

from __future__ import annotations

import csv
import importlib
import itertools
import os
import pickle
import time
import warnings
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Sequence, Tuple

import numpy

Row = Dict[str, Any]
Table = Dict[str, numpy.ndarray]  #: columns of one length

_SECONDS_BETWEEN_SAVES = 10.0


def run(
    function: Callable[..., Mapping[str, Any]],
    cases: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]],
    *,
    client: Any = None,
    out: str | os.PathLike[str] | None = None,
    **given: Any,
) -> Table:
    """Calls `function(**case, **given)` for each case, and returns a table with a row a case, in their order.

    `cases` are dicts of parameters, or a dict of lists whose every combination is a case. The function returns a dict
    of numbers, bools or texts. What is `given` to all, such as a Scene, must pickle, and each call has a copy.

    `client` is a `distributed.Client`; None: this process. Results are the same bits, whichever worker has a case, and
    what a lost worker had is done again. A case that fails leaves a row with NaN and its `error`, and a warning tells
    its parameters; the other cases go on.

    `out` is a .csv or .h5 file, written every few seconds and at the end. Cases that it already holds without an error
    are not done again; delete it where the function has changed. Raises ValueError for cases with other parameters
    than the first has, and for a file of another kind.
    """
    todo = _list_of(cases)
    path = None if out is None else _checked(out)
    rows: List[Row | None] = _known(path, todo)
    left = [i for i, row in enumerate(rows) if row is None]
    packed = pickle.dumps(given)
    saved = time.monotonic()
    for i, row in _here(function, packed, todo, left) if client is None else _over(client, function, packed, todo, left):
        rows[i] = row
        if row["error"]:
            warnings.warn(f"trephine.study: {todo[i]}: {row['error']}", stacklevel=2)
        if path and time.monotonic() - saved > _SECONDS_BETWEEN_SAVES:
            save(path, _table_of([r for r in rows if r]))
            saved = time.monotonic()
    table = _table_of([r for r in rows if r])
    if path:
        save(path, table)
    return table


def save(path: str | os.PathLike[str], table: Table) -> None:
    """Writes a table as CSV, with all digits, or as HDF5 with a data set a column (needs h5py). Replaces a file whole."""
    path = _checked(path)
    part = path.with_name(path.name + ".part")
    if path.suffix == ".csv":
        with open(part, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(table)
            writer.writerows(map(_text, row) for row in zip(*(column.tolist() for column in table.values())))
    else:
        h5py = _import("h5py")
        with h5py.File(part, "w") as file:
            file.attrs["columns"] = list(table)
            for name, column in table.items():
                text = column.dtype.kind == "U"
                file.create_dataset(name, data=column.astype(object) if text else column,
                                    dtype=h5py.string_dtype() if text else None)  # fmt: skip
    os.replace(part, path)


def load(path: str | os.PathLike[str]) -> Table:
    """Reads a table of `save`. In a CSV a text that reads as a number becomes one."""
    path = _checked(path)
    if path.suffix == ".csv":
        with open(path, newline="", encoding="utf-8") as file:
            names, *lines = csv.reader(file)
        return _table_of([dict(zip(names, map(_value, line))) for line in lines], names)
    with _import("h5py").File(path, "r") as file:
        columns = {name: file[name] for name in file.attrs["columns"]}
        return {name: c.asstr()[()].astype(str) if c.dtype.kind == "O" else c[()] for name, c in columns.items()}


def _import(name: str) -> Any:
    return importlib.import_module(name)


def _list_of(cases: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]]) -> List[Row]:
    if isinstance(cases, Mapping):
        return [dict(zip(cases, values)) for values in itertools.product(*cases.values())]
    made = [dict(case) for case in cases]
    for case in made:
        if case.keys() != made[0].keys():
            raise ValueError(f"trephine.study: every case must have the parameters {list(made[0])}, got {case}")
    return made


def _checked(path: str | os.PathLike[str]) -> Path:
    if Path(path).suffix not in (".csv", ".h5"):
        raise ValueError(f"trephine.study: a table is a .csv or .h5 file, got {os.fspath(path)}")
    return Path(path)


def _known(path: Path | None, todo: Sequence[Row]) -> List[Row | None]:
    """Rows that a file already has, at the places of their cases."""
    if path is None or not path.exists() or not todo:
        return [None] * len(todo)
    table = load(path)
    rows = [dict(zip(table, values)) for values in zip(*(column.tolist() for column in table.values()))]
    done = {_key(row, todo[0]): row for row in rows if not row["error"] and row.keys() >= todo[0].keys()}
    return [done.get(_key(case, case)) for case in todo]


def _key(row: Row, names: Iterable[str]) -> Tuple[str, ...]:
    return tuple(_text(_plain(row[name])) for name in names)


def _perform(function: Callable[..., Mapping[str, Any]], packed: bytes, case: Row) -> Row:
    try:
        row = {**case, **function(**case, **pickle.loads(packed)), "error": ""}
    except Exception as error:
        row = {**case, "error": f"{type(error).__name__}: {error}"}
    return {name: _plain(value) for name, value in row.items()}


def _here(function: Callable[..., Any], packed: bytes, todo: Sequence[Row], left: Sequence[int]) -> Iterator[Tuple[int, Row]]:
    for i in left:
        yield i, _perform(function, packed, todo[i])


def _over(
    client: Any, function: Callable[..., Any], packed: bytes, todo: Sequence[Row], left: Sequence[int]
) -> Iterator[Tuple[int, Row]]:
    # A task's result, which unlike scattered data is made again where its worker is lost.
    data = client.submit(bytes, packed, pure=False)
    place = {client.submit(_perform, function, data, todo[i], pure=False): i for i in left}
    try:
        for future in _import("distributed").as_completed(list(place)):
            i = place[future]
            if future.status == "finished":
                yield i, future.result()
            else:
                error = future.exception()
                yield i, {**{n: _plain(v) for n, v in todo[i].items()}, "error": f"{type(error).__name__}: {error}"}
    finally:
        client.cancel([future for future in place if not future.done()])


def _plain(value: Any) -> Any:
    """A number, bool or text as Python's own; anything else as text."""
    if isinstance(value, numpy.generic):
        value = value.item()
    return value if isinstance(value, (bool, int, float, str)) else str(value)


def _text(value: Any) -> str:
    return repr(value) if isinstance(value, float) else str(value)


def _value(text: str) -> Any:
    for read in (int, float, {"True": True, "False": False}.__getitem__):
        try:
            return read(text)  # type: ignore[operator]
        except (ValueError, KeyError):
            pass
    return text


def _table_of(rows: Sequence[Row], names: Iterable[str] = ()) -> Table:
    """Columns in the order in which rows bring them, the error last; NaN or no text where a row has none."""
    order = dict.fromkeys([*names, *(name for row in rows for name in row if name != "error"), "error"])
    table = {}
    for name in order:
        values = [row.get(name) for row in rows]
        text = name == "error" or any(isinstance(value, str) for value in values)
        if text:
            values = ["" if value is None else _text(value) for value in values]
        table[name] = numpy.array([numpy.nan if value is None else value for value in values], str if text else None)
    return table
