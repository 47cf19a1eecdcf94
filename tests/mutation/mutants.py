"""Makes small changes to a module's source, each of which a test should detect.

Changed are: comparisons, and/or/not, conditions, arithmetic, numbers, truth values, return values, statements with
an effect (removed), entries of tables (removed). Not changed, because they are no behaviour: annotations, docstrings,
texts of messages and of the log, decorators, assertions that narrow types, and ``strict=True``, which guards against
a defect that no test can cause.
"""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

_COMPARISONS: Final[dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_ARITHMETIC: Final[dict[type[ast.operator], type[ast.operator]]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.Pow: ast.Mult,
}
_SMALL: Final = 10
"""Smaller numbers are changed by one, others by a tenth."""
_LONG: Final = 200


@dataclass(frozen=True)
class Mutant:
    """One change. Place and texts identify it in the list of survivors, independently of its line."""

    file: Path
    place: str
    was: str
    becomes: str
    lines: range
    """Lines of the statement; only a test that executes one can detect the change. Empty for code executed at import."""
    tree: ast.Module

    @property
    def name(self) -> tuple[str, str, str, str]:
        """Its text in the list of survivors."""
        return (self.file.name, self.place, self.was, self.becomes)


def mutants(file: Path) -> Iterator[Mutant]:
    """Yield every change to one file in order."""
    tree = ast.parse(file.read_text())
    # Change the tree in place, copy it, and change it back; the copy is compiled.
    for statement, place, body in list(_statements(tree, "")):
        lines = _header(statement) if place.functions else range(0)
        was = _text(statement)
        for undo in _changes(statement, body, table=not place.functions):
            becomes = "pass" if statement not in body else _text(statement)
            if becomes != was:
                changed = ast.fix_missing_locations(copy.deepcopy(tree))
                yield Mutant(file, place.name, *_around(was, becomes), lines, changed)
            undo()


@dataclass(frozen=True)
class _Place:
    name: str
    functions: int


def _statements(node: ast.AST, name: str, functions: int = 0) -> Iterator[tuple[ast.stmt, _Place, list[ast.stmt]]]:
    """Yield every statement with its place and the list that contains it."""
    for _, value in ast.iter_fields(node):
        if not isinstance(value, list):
            continue
        for part in value:
            if isinstance(part, ast.FunctionDef | ast.ClassDef):
                inner = f"{name}.{part.name}".lstrip(".")
                yield part, _Place(inner, functions), value
                yield from _statements(part, inner, functions + isinstance(part, ast.FunctionDef))
            elif isinstance(part, ast.stmt):
                yield part, _Place(name, functions), value
                yield from _statements(part, name, functions)
            elif isinstance(part, ast.match_case | ast.ExceptHandler):
                yield from _statements(part, name, functions)


def _header(statement: ast.stmt) -> range:
    body = getattr(statement, "body", None)
    end = body[0].lineno - 1 if body else statement.end_lineno or statement.lineno
    return range(statement.lineno, max(end, statement.lineno) + 1)


def _text(statement: ast.stmt) -> str:
    """Return a statement without its body, on one line."""
    bare = copy.copy(statement)
    for part in ("body", "orelse"):
        if hasattr(bare, part):
            setattr(bare, part, [ast.Pass()] if part == "body" else [])
    lines = [line.strip() for line in ast.unparse(ast.fix_missing_locations(bare)).splitlines()]
    return " ".join(line for line in lines if line not in ("pass", ""))


def _around(was: str, becomes: str) -> tuple[str, str]:
    """Return the part of a long table around the change."""
    if len(was) <= _LONG:
        return was, becomes
    same = next((n for n, pair in enumerate(zip(was, becomes, strict=False)) if pair[0] != pair[1]), 0)
    begin = max(0, same - _LONG // 2)
    return was[begin : same + _LONG // 2], becomes[begin : same + _LONG // 2]


# -- changes: each is made, and yields the function with which the caller undoes it ----------------------------------


def _changes(statement: ast.stmt, body: list[ast.stmt], *, table: bool) -> Iterator[Any]:
    if isinstance(statement, ast.Assert | ast.Import | ast.ImportFrom | ast.ClassDef) or _is_text(statement):
        return
    if _acts(statement, table):
        at = body.index(statement)
        body[at] = ast.copy_location(ast.Pass(), statement)

        def put_back() -> None:
            body[at] = statement

        yield put_back
    if isinstance(statement, ast.Return) and statement.value and not _is_none_or_truth(statement.value):
        yield from _with(statement, "value", [ast.Constant(None)])
    yield from _within(statement, table=table)


def _acts(statement: ast.stmt, table: bool) -> bool:
    """Return True if the statement can be removed and the rest is still valid."""
    match statement:
        case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Raise() | ast.Return(value=None):
            return True
        case ast.Assign(targets=targets):
            return not table and all(isinstance(target, ast.Attribute | ast.Subscript) for target in targets)
    return False


def _is_text(statement: ast.stmt) -> bool:
    match statement:
        case ast.Expr(value=ast.Constant()):
            return True
        case ast.Expr(value=ast.Call(func=ast.Attribute(value=ast.Name(id="log")))):
            return True
    return False


def _is_none_or_truth(node: ast.expr) -> bool:
    """Return True if None can replace the value: not for None and False, and True becomes False by another change."""
    return isinstance(node, ast.Constant) and (node.value is None or isinstance(node.value, bool))


def _within(node: ast.AST, *, table: bool) -> Iterator[Any]:
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "slice", "body", "orelse", "cases", "handlers") and not (
            isinstance(node, ast.IfExp | ast.Lambda)
            or (name == "slice" and isinstance(node.ctx, ast.Load) and not table)  # type: ignore[attr-defined]
        ):
            continue
        parts = value if isinstance(value, list) else [value]
        for n, part in enumerate(parts):
            if not isinstance(part, ast.AST) or isinstance(part, ast.JoinedStr):
                continue
            if isinstance(part, ast.keyword) and part.arg == "strict":
                continue
            if isinstance(part, ast.expr):
                instead = list(_instead(part, condition=name == "test" or name == "ifs"))
                if isinstance(value, list):
                    yield from _each(value, n, instead)
                else:
                    yield from _with(node, name, instead)
            yield from _within(part, table=table)
    if isinstance(node, ast.Compare):
        for n, operator in enumerate(node.ops):
            yield from _each(node.ops, n, [other() for other in _COMPARISONS[type(operator)]])
    if isinstance(node, ast.BinOp | ast.AugAssign) and type(node.op) in _ARITHMETIC:
        yield from _with(node, "op", [_ARITHMETIC[type(node.op)]()])
    if isinstance(node, ast.BoolOp):
        yield from _with(node, "op", [ast.Or() if isinstance(node.op, ast.And) else ast.And()])
    if table and isinstance(node, ast.Dict | ast.Tuple):
        yield from _one_less(node)


def _instead(node: ast.expr, *, condition: bool) -> Iterator[ast.expr]:
    match node:
        case ast.Constant(value=bool() as truth):
            yield ast.Constant(not truth)
        case ast.Constant(value=int() | float() as number):
            step = 1 if abs(number) < _SMALL else number / 10
            yield ast.Constant(type(number)(number + step))
            yield ast.Constant(type(number)(number - step))
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield operand
        case ast.Compare() | ast.BoolOp():
            pass
        case _ if condition:
            yield ast.UnaryOp(ast.Not(), node)
        case ast.IfExp(body=body, orelse=orelse):
            yield ast.copy_location(ast.IfExp(node.test, orelse, body), node)


def _one_less(node: ast.Dict | ast.Tuple) -> Iterator[Any]:
    lists: list[list[Any]] = [node.keys, node.values] if isinstance(node, ast.Dict) else [node.elts]
    for n in range(len(lists[0])):
        taken = [entries.pop(n) for entries in lists]

        def put_back(n: int = n, taken: list[Any] = taken) -> None:
            for entries, entry in zip(lists, taken, strict=True):
                entries.insert(n, entry)

        yield put_back


def _with(node: ast.AST, name: str, instead: list[Any]) -> Iterator[Any]:
    was = getattr(node, name)
    for other in instead:
        setattr(node, name, other)
        yield lambda: setattr(node, name, was)


def _each(entries: list[Any], n: int, instead: list[Any]) -> Iterator[Any]:
    was = entries[n]

    def put_back() -> None:
        entries[n] = was

    for other in instead:
        entries[n] = other
        yield put_back
