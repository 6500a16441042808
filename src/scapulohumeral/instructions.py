"""Hash of the instructions that functions run: their definitions and all that these reach.

Names of modules, imports, comments, docstrings, types of arguments, texts of errors and layout do
not count, so that the hash stays when code moves between modules or is worded anew. A definition is
what stands at the top level of a module under one name: a function, a class, a constant.
"""

from __future__ import annotations

import ast
import hashlib
import platform
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from scapulohumeral.cached_file import cached_file
from scapulohumeral.errors import ConfigError
from scapulohumeral.provenance import SOURCE_ROOT, absolute_origin, source_file, user_cache

LABEL = re.compile(r"<<([\w.]*:\w*)>>")
Scope = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
BINDING = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.ExceptHandler, ast.MatchAs)
Comprehension = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp


@dataclass(frozen=True)
class Definition:
    """Dotted name of a module, and a name at its top level; no name stands for the module."""

    module: str
    name: str | None

    @property
    def label(self) -> str:
        """How it is written in texts until its name is known."""
        return f"<<{self.module}:{self.name or ''}>>"


@dataclass(frozen=True)
class _Module:
    """What a module defines and imports; `always` runs whatever is used of it."""

    statements: dict[str, list[ast.stmt]] = field(default_factory=dict)
    imports: dict[str, Definition] = field(default_factory=dict)
    always: list[ast.stmt] = field(default_factory=list)


def instruction_hash(
    entries: Iterable[str], package: str, root: Path = SOURCE_ROOT, without: Sequence[str] = ()
) -> str:
    """SHA-256 over everything that functions reach inside of a package.

    Parameters
    ----------
    entries : functions as ``module:name``, dotted name of the module
    package : dotted name; what lies outside of it is not followed
    root : folder that holds the top-level package
    without : dotted names of packages inside that are not followed either

    Raises
    ------
    ConfigError                      an entry that does not exist
    """
    code = _Code(package, root, tuple(without))
    texts = code.reached([Definition(*entry.split(":")) for entry in entries])
    names = {one.label: one.name or "module" for one in texts}
    own = {one.label: _digest(_named(text, names)) for one, text in texts.items()}
    # Several modules may define one name: what stands behind it tells them apart.
    told_apart = {label: f"{name} {own[label]}" for label, name in names.items()}
    return _digest("\n".join(sorted({_named(text, told_apart) for text in texts.values()})))


def kept_instruction_hash(entries: Sequence[str], package: str, without: Sequence[str] = ()) -> str:
    """:func:`instruction_hash` of this tree, kept for the user while its sources are the same.

    To follow what functions reach takes a second, to read all that they might reach hardly any
    time.
    """
    asked = repr((platform.python_version(), list(entries), package, list(without)))
    digest = hashlib.sha256(asked.encode() + Path(__file__).read_bytes())
    for path in sorted((SOURCE_ROOT / package.replace(".", "/")).rglob("*.py")):
        digest.update(f"{path.relative_to(SOURCE_ROOT)}\n".encode() + path.read_bytes())

    def write(path: Path) -> None:
        path.write_text(instruction_hash(entries, package, without=without), encoding="utf-8")

    kept = cached_file(user_cache() / "instructions" / digest.hexdigest(), write)
    return kept.read_text(encoding="utf-8")


def _named(text: str, names: Mapping[str, str]) -> str:
    """A text with names in place of labels; what is not followed keeps the last part of its own."""
    return LABEL.sub(lambda found: names.get(found[0], found[1].rpartition(":")[2]), text)


class _Code:
    """Definitions of a package, read where they are reached."""

    def __init__(self, package: str, root: Path, without: tuple[str, ...]) -> None:
        self.package, self.root, self.without = package, root, without
        self.modules: dict[str, _Module] = {}
        # By identity of statements, which live as long as their modules; each is spelled once.
        self.spellings: dict[int, tuple[str, list[Definition]]] = {}

    def reached(self, entries: Sequence[Definition]) -> dict[Definition, str]:
        """Entries, and what they use, and so on: each with its text.

        Raises
        ------
        ConfigError                  an entry that does not exist
        """
        for entry in entries:
            if self.found(entry.module, entry.name or "") != entry:
                raise ConfigError(
                    f"no definition {entry.name} in module {entry.module}, of which a hash is to "
                    "be made. Name it where it stands now."
                )
        texts: dict[Definition, str] = {}
        waiting = list(entries)
        while waiting:
            one = waiting.pop()
            if one not in texts and self.read(one.module) is not None:
                texts[one], used = self.spelled(one)
                waiting += used
        return texts

    def spelled(self, one: Definition) -> tuple[str, list[Definition]]:
        """Text of a definition, or of all of a module, and what it uses."""
        module = self.read(one.module)
        if module is None:
            return "", []
        groups = (
            module.statements.values()
            if one.name is None
            else [module.statements.get(one.name, [])]
        )
        statements = [*module.always, *(statement for group in groups for statement in group)]
        for statement in statements:
            if id(statement) not in self.spellings:
                spelling = _Spelling(self, one.module)
                text = ast.dump(spelling.visit(statement))
                self.spellings[id(statement)] = text, spelling.used
        parts = [self.spellings[id(statement)] for statement in statements]
        texts = [text for text, _ in parts]
        # The order of definitions in a module says nothing; that of statements of one name does.
        text = "\n".join(texts if one.name else sorted(set(texts)))
        return text, [used for _, several in parts for used in several]

    def found(self, module: str, name: str) -> Definition | None:
        """What a name stands for at the top level of a module; None if not of this package."""
        known = self.read(module)
        if known is None:
            return None
        if name in known.statements:
            return Definition(module, name)
        if name in known.imports:
            return self.resolved(known.imports[name])
        return None

    def resolved(self, used: Definition) -> Definition:
        """Where something that is imported is defined: behind re-exports, or a module itself."""
        below = f"{used.module}.{used.name}" if used.name else used.module
        if source_file(below, self.root) is not None:
            return Definition(below, None)
        return self.found(used.module, used.name or "") or used

    def read(self, module: str) -> _Module | None:
        """Definitions of a module; None for one that is not followed."""
        if not _within(module, (self.package,)) or _within(module, self.without):
            return None
        if module not in self.modules:
            path = source_file(module, self.root)
            if path is None:
                return None
            self.modules[module] = _read(path, module, self.package.partition(".")[0])
        return self.modules[module]


class _Spelling(ast.NodeTransformer):
    """A statement in one spelling, in place; `used` collects what it refers to."""

    def __init__(self, code: _Code, module: str) -> None:
        self.code, self.module = code, module
        self.used: list[Definition] = []
        self.bound: list[set[str]] = []

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """A name of the package becomes its label, whatever it was imported as."""
        one = self._global(node.id)
        return node if one is None else self._labelled(one, node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """``module.name`` is ``name``."""
        one = self._global(node.value.id) if isinstance(node.value, ast.Name) else None
        if one is None or one.name is not None:
            return self.generic_visit(node)
        return self._labelled(self.code.resolved(Definition(one.module, node.attr)), node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Without docstring; names that it binds are its own."""
        node.body = _without_docstring(node.body)
        if node.returns is not None:
            self.visit(node.returns)
            node.returns = None
        return self._scope(node, node.args, node.body)

    def visit_arg(self, node: ast.arg) -> ast.AST:
        """The type does not count, but its class is used: what is handed in was made by it."""
        if node.annotation is not None:
            self.visit(node.annotation)
            node.annotation = None
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        """Without docstring."""
        node.body = _without_docstring(node.body)
        return self.generic_visit(node)

    def visit_Lambda(self, node: ast.Lambda) -> ast.AST:
        """As a function."""
        return self._scope(node, node.args, [node.body])

    def visit_ListComp(self, node: Comprehension) -> ast.AST:
        """Names of the loop are its own."""
        return self._inside(
            {name for one in node.generators for name in _bound([one.target])}, node
        )

    visit_SetComp = visit_DictComp = visit_GeneratorExp = visit_ListComp

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        """The kind of an error counts, its text does not."""
        if isinstance(node.exc, ast.Call):
            node.exc = node.exc.func
        node.cause = None
        return self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        """Inside of functions the type does not count; in a class it says what a field is."""
        if self.bound:
            self.visit(node.annotation)
            node.annotation = ast.Constant(None)
        return self.generic_visit(node)

    def visit_Import(self, node: ast.Import | ast.ImportFrom) -> ast.AST:
        """Imports do not count."""
        return ast.Pass()

    visit_ImportFrom = visit_Import

    def _scope(self, node: Scope, arguments: ast.arguments, body: Sequence[ast.AST]) -> ast.AST:
        names = {one.arg for one in ast.walk(arguments) if isinstance(one, ast.arg)}
        return self._inside(names | set(_bound(body)), node)

    def _inside(self, names: set[str], node: ast.AST) -> ast.AST:
        self.bound.append(names)
        node = self.generic_visit(node)
        self.bound.pop()
        return node

    def _global(self, name: str) -> Definition | None:
        local = any(name in names for names in self.bound)
        return None if local else self.code.found(self.module, name)

    def _labelled(self, one: Definition, node: ast.Name | ast.Attribute) -> ast.Name:
        self.used.append(one)
        return ast.Name(one.label, node.ctx)


def _bound(body: Sequence[ast.AST]) -> Iterator[str]:
    """Names that statements bind, without those of functions and loops inside of expressions."""
    for node in body:
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            yield node.id
        if isinstance(node, BINDING) and node.name:
            yield node.name
        if not isinstance(node, Scope | ast.ClassDef | Comprehension):
            yield from _bound(list(ast.iter_child_nodes(node)))


def _read(path: Path, module: str, top: str) -> _Module:
    tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
    read = _Module()
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            origin = absolute_origin(node, package)
            if _within(origin, (top,)):
                for alias in node.names:
                    read.imports[alias.asname or alias.name] = Definition(origin, alias.name)
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.asname and _within(alias.name, (top,)):
                    read.imports[alias.asname] = Definition(alias.name, None)
    for statement in _without_docstring(tree.body):
        if isinstance(statement, ast.Import | ast.ImportFrom | ast.Pass) or _is_aside(statement):
            continue
        names = set(_bound([statement])) - {"__all__"}
        for name in names:
            read.statements.setdefault(name, []).append(statement)
        if not names and not _names_all(statement):
            read.always.append(statement)
    return read


def _is_aside(statement: ast.stmt) -> bool:
    """Imports for types only, and what runs when a module is called as a program."""
    return isinstance(statement, ast.If) and ast.unparse(statement.test) in (
        "TYPE_CHECKING",
        "__name__ == '__main__'",
    )


def _names_all(statement: ast.stmt) -> bool:
    return "__all__" in _bound([statement])


def _without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    is_text = body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant)
    return (body[1:] or [ast.Pass()]) if is_text else body


def _within(module: str, packages: Sequence[str]) -> bool:
    return any(module == one or module.startswith(f"{one}.") for one in packages)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
