"""Seeded mutations of small good inputs: what users do to their files, and numbers at the edges."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable

Files = dict[str, bytes]

EDGES = (
    "0", "-0", "-1", "1e-200", "5e-324", "1e6",
    "1e15", "1e19", "1e154", "1e200", "1e300", "1.7e308",
    "1e400", "-1e200", "-1e300", "nan", "inf", "-inf", "9" * 25, "1" + "0" * 400, "1" + "0" * 5000, "0x10",
    "1_000", "1,5",
)  # fmt: skip
FACTORS = (-1.0, 0.0, 1e-3, 1e3, 57.29577951308232, 0.017453292519943295, 1.9438444924406, 3.280839895, 2.0,
           1e-200, 1e150, 1e200, 1e300)  # fmt: skip
TEXTS = ("abc", "", "-", "1.0.0", "12 m", "=A1+B1", "#REF!", "1e", "--5", "é", "\x00", "\u202e1", "true", '"5"', "'5")
UNITS = ("deg", "rad", "mps", "degps", "radps", "m", "rpm", "rps", "kn", "km", "ft", "s", "N", "kg")


def mutate(files: Files, strangers: Files, draw: random.Random) -> tuple[Files, str, str]:
    """The files with one of them changed once or twice, the name of that one, and the mutations in words."""
    name = draw.choice(sorted(files))
    content, words = files[name], []
    for _ in range(draw.choice((1, 1, 1, 2))):
        kind = _kind(name)
        if kind == "binary" or draw.random() < 0.12:
            change, content = _bytes(content, strangers, draw)
        else:
            text = content.decode("utf-8", "replace")
            change, text = {"csv": _csv, "toml": _toml, "json": _json}[kind](text, draw)
            content = text.encode("utf-8", "surrogatepass")
        words.append(change)
    return {**files, name: content}, name, " + ".join(words)


def _kind(name: str) -> str:
    suffix = name.rpartition(".")[2]
    return suffix if suffix in ("csv", "toml", "json") else "binary"


def _bytes(content: bytes, strangers: Files, draw: random.Random) -> tuple[str, bytes]:
    which = draw.randrange(9)
    cut = draw.randrange(len(content) + 1)
    if which < 3:
        stranger = draw.choice(sorted(strangers))
        return f"swapped for {stranger}", strangers[stranger]
    if which == 3:
        return f"cut at byte {cut}", content[:cut]
    if which == 4:
        return "empty", b""
    if which == 5:
        encoding = draw.choice(("utf-16", "utf-32", "cp037"))
        return f"as {encoding}", content.decode("utf-8", "replace").encode(encoding, "replace")
    if which == 6:
        return "byte order mark", b"\xef\xbb\xbf" + content
    if which == 7:
        return f"bytes put in at {cut}", content[:cut] + draw.choice((b"\x00\x00", b"\xff\xfe", b'"', b"\r")) + content[
            cut:
        ]
    return "old line ends", content.replace(b"\n", draw.choice((b"\r", b"\r\n", b"\n\n", b" ")))


def _csv(text: str, draw: random.Random) -> tuple[str, str]:
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    rows = [line.split(",") for line in lines if not line.startswith("#") and line.strip()]
    if len(rows) < 2 or len(rows[0]) < 1:
        return "left", text
    head, body = rows[0], [row + [""] * (len(rows[0]) - len(row)) for row in rows[1:]]
    words = draw.choice(CSV_CHANGES)(comments, head, body, draw)
    return words, "\n".join([*comments, *(",".join(row) for row in [head, *body])]) + "\n"


Table = list[list[str]]


def _cell(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    row, column = draw.randrange(len(body)), draw.randrange(len(head))
    body[row][column] = value = draw.choice(EDGES + TEXTS)
    return f"{head[column]} of row {row} is {value[:20]!r}"


def _whole_column(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    column, value = draw.randrange(len(head)), draw.choice(EDGES + TEXTS)
    for row in body:
        row[column] = value
    return f"all of {head[column]} is {value[:20]!r}"


def _factor(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    column, factor = draw.randrange(len(head)), draw.choice(FACTORS)
    columns = range(len(head)) if draw.random() < 0.2 else [column]
    for row in body:
        for each in columns:
            row[each] = _times(row[each], factor)
    return f"{head[column] if columns == [column] else 'every column'} x {factor:g}"


def _times(cell: str, factor: float) -> str:
    try:
        return repr(float(cell) * factor)
    except ValueError:
        return cell


def _zeros(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    for row in body:
        row[1:] = ["0"] * (len(row) - 1)
    return "all zero"


def _sparse(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    column, step, begin = draw.randrange(len(head)), draw.choice((2, 3, 7, 50, 10**9)), draw.choice((0, 1, 5, 40))
    columns = range(1, len(head)) if draw.random() < 0.2 else [column]
    for number, row in enumerate(body):
        for each in columns:
            if number < begin or number % step:
                row[each] = ""
    return f"{head[column]} ({len(columns)} columns) sparse, 1 of {step} from {begin}"


def _deleted_column(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    column = draw.randrange(len(head))
    words = f"no column {head[column]}"
    for row in [head, *body]:
        del row[column]
    return words


def _heading(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    column = draw.randrange(len(head))
    old = head[column]
    stem = old.rpartition("_")[0] or old
    head[column] = draw.choice(
        (f"{stem}_{draw.choice(UNITS)}", draw.choice(head), "", old.upper(), f"{old} ", "x" * 3000)
    )
    return f"{old} is headed {head[column][:20]!r}"


def _swapped_headings(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    one, other = draw.randrange(len(head)), draw.randrange(len(head))
    head[one], head[other] = head[other], head[one]
    return f"{head[one]} and {head[other]} swapped"


def _rows(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    which = draw.choice(("doubled", "shuffled", "reversed", "thinned", "few", "repeated", "gap"))
    if which == "doubled":
        row = draw.randrange(len(body))
        body[row:row] = [body[row]] * draw.choice((1, 3))
    elif which == "shuffled":
        draw.shuffle(body)
    elif which == "reversed":
        body.reverse()
    elif which == "thinned":
        body[:] = [row for row in body if draw.random() < 0.2] or body[:1]
    elif which == "few":
        del body[draw.choice((0, 1, 2, 3, 4, 5, 8)) :]
    elif which == "repeated":
        body.extend(list(row) for row in body[:])
    else:
        del body[len(body) // 4 : 3 * len(body) // 4]
    return f"rows {which}"


def _ragged(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    row = draw.choice(body)
    if draw.random() < 0.5:
        row.append("7")
        return "a cell too many"
    row.pop()
    return "a cell too few"


def _time(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    which = draw.choice(("epoch", "one epoch", "milliseconds", "jump", "stopped", "tiny", "huge"))
    half = len(body) // 2
    for number, row in enumerate(body):
        try:
            value = float(row[0])
        except ValueError:
            continue
        changed = {
            "epoch": value + 1.6e9,
            "one epoch": value + (1.6e9 if number == half else 0.0),
            "milliseconds": value * 1e3,
            "jump": value + (1e7 if number > half else 0.0),
            "stopped": value if number < half else 100.0,
            "tiny": value * 1e-200,
            "huge": value * 1e200,
        }[which]
        row[0] = repr(changed)
    return f"time: {which}"


def _comment(comments: list[str], head: list[str], body: Table, draw: random.Random) -> str:
    if comments and draw.random() < 0.5:
        place = draw.randrange(len(comments))
        old = comments[place]
        comments[place] = re.sub(r"[-\d.e]+", draw.choice(EDGES), old, count=1)
        return f"comment {old[:20]!r} is {comments[place][:40]!r}"
    key = draw.choice(("noise", "scale", "rudder_sign", "force_N", "mass_kg", "length_m", "medium",
                       "water_density_kgpm3",
                       "max_rate_degps", "humps", "water_depth_m"))  # fmt: skip
    value = draw.choice(
        (*EDGES, "port", "x_m 1e300", "u_mps 1e-300, psi_deg 0", "u_mps nan", "x_m", "a b c", "", "air")
    )
    comments.append(f"# {key}: {value}")
    return f"comment {comments[-1][:40]!r}"


CSV_CHANGES: tuple[Callable[[list[str], list[str], Table, random.Random], str], ...] = (
    _cell, _cell, _cell, _whole_column, _factor, _factor, _zeros, _sparse, _sparse, _deleted_column, _heading, _heading,
    _swapped_headings, _rows, _rows, _ragged, _time, _time, _comment, _comment,
)  # fmt: skip

_ASSIGNMENT = re.compile(r"^(\s*[\w.-]+\s*=\s*)([^#]*)(#.*)?$")


def _toml(text: str, draw: random.Random) -> tuple[str, str]:
    lines = text.split("\n")
    places = [number for number, line in enumerate(lines) if _ASSIGNMENT.match(line) and "[[" not in line]
    if not places:
        return "left", text
    place = draw.choice(places)
    match = _ASSIGNMENT.match(lines[place])
    assert match is not None
    key, value = match[1], match[2].strip()
    which = draw.random()
    if which < 0.12:
        del lines[place]
        words = f"no key {key.strip(' =')}"
    elif which < 0.16:
        lines.insert(place, lines[place])
        words = f"{key.strip(' =')} twice"
    elif which < 0.22:
        lines.insert(place, draw.choice(("unknown = 1", "[nested.deep.down]", "[[effects]]", "x = ", "[environment]")))
        words = f"{lines[place]!r} put in"
    elif which < 0.27:
        heads = [number for number, line in enumerate(lines) if line.startswith("[")]
        begin = draw.choice(heads)
        end = next((number for number in heads if number > begin), len(lines))
        words = f"no section {lines[begin]}"
        del lines[begin:end]
    else:
        other = draw.choice((*EDGES, *EDGES, *TOML_VALUES))
        if which > 0.8 and re.fullmatch(r"[-+\d.eE]+", value):
            other = repr(float(value) * draw.choice(FACTORS))
        lines[place] = key + other
        words = f"{key.strip(' =')} = {other[:24]}"
    return words, "\n".join(lines)


TOML_VALUES = (
    '"text"', '""', "true", "[]", "[1.0]", "[[1.0]]", "{}", "{ a = { b = { c = 1 } } }", "1979-05-27", '"\\u0000"',
    '"\\ud800"', "[" * 2000 + "]" * 2000, "{ a = " * 150 + "1" + " }" * 150, '"' + "x" * 5000 + '"',
    '"../../etc/passwd"',
    '"<script>alert(1)</script>"', "[1.0, 2.0]", "[2.0, 1.0]", "[0.0, 1e300]", "[nan, nan]", "[1.0, 'a']",
)  # fmt: skip


def _json(text: str, draw: random.Random) -> tuple[str, str]:
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        return "left", text
    if not isinstance(content, dict | list) or not content:
        return "left", text
    holder, key, path = _place(content, draw)
    which = draw.random()
    if which < 0.25:
        del holder[key]
        return f"no {path}", json.dumps(content)
    if which < 0.35 and isinstance(holder[key], list):
        holder[key] = holder[key][: len(holder[key]) // 2]
        return f"half of {path}", json.dumps(content)
    if which < 0.42 and isinstance(holder[key], int | float):
        holder[key] = _finite(holder[key] * draw.choice(FACTORS))
        return f"{path} = {holder[key]:g}", json.dumps(content)
    holder[key] = "@@@"
    value = draw.choice(JSON_VALUES)
    return f"{path} = {value[:24]}", json.dumps(content).replace('"@@@"', value)


def _finite(value: float) -> float:
    return min(max(value, -1.7e308), 1.7e308)


JSON_VALUES = (
    "null", "true", "[]", "{}", "[[]]", "[null]", '[{"a": [1, {"b": 2}]}]', '{"a": {"b": {"c": 1}}}', '""',
    '"text"', '"\\ud800"',
    '"\\u0000"', '"<script>alert(1)</script>"', "1e300", "-1e300", "1e200", "0", "-1", "1e400", "NaN",
    "Infinity", "1" + "0" * 400,
    "1" + "0" * 5000, "[1, 2, 3]", '["a", "b"]', "[" * 3000 + "]" * 3000, "[1e300, -1e300]", "5e-324",
    '"2026-01-01"', "1.5",
)  # fmt: skip


def _place(content: object, draw: random.Random) -> tuple[object, object, str]:
    """A holder in the content, the key or index of one of its items, and the way to it."""
    holder, path = content, ""
    while True:
        keys = sorted(holder) if isinstance(holder, dict) else list(range(len(holder)))
        key = draw.choice(keys)
        path += f"/{key}"
        item = holder[key]
        if not isinstance(item, dict | list) or not item or draw.random() < 0.2:
            return holder, key, path[:60]
        holder = item
