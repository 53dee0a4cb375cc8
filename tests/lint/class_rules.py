"""Rules about the size of interfaces: data members of a class, parameters of a function."""

import re

import tables
from text_rules import code_without_directives
from tree import Finding

_CLASS = re.compile(
    r"\b(class|struct|union)\s+(?:\w+\([^()]*\)\s*)?([\w:]*)(?:<[^;{}]*>)?(?:\s+final)?\s*(?::[^;(){}]+)?$"
)
_NO_DATA = re.compile(
    r"(?:using|typedef|friend|enum|static|static_assert|template|explicit|virtual)\b|~|(?:class|struct) [\w:]+$"
)
_SPECIFIERS = re.compile(r"^(?:\[\[[^\]]*\]\] |alignas\([^()]*\) |mutable |inline )*")
_INITIALISED = re.compile(r"(?<!operator)=")
_MARK = re.compile(r"[{};(]|\b(?:public|private|protected)\s*:(?!:)")
_TYPED = re.compile(r"(?:const )?[\w:]+[ &*]+(?:\w|\.\.\.)")
_AFTER_PARAMETERS = re.compile(r"[{;]|:(?!:)|->|(?:const|override|noexcept|mutable)\b|= (?:default|delete|0)\b")


def _flat(text, *brackets):
    """The text on one line, without these kinds of brackets and what stands in them."""
    text = re.sub(r"<<|<=>?|->", "", " ".join(text.split()))
    for left, right in brackets:
        inner = re.compile(rf"{re.escape(left)}[^{re.escape(left + right)}]*{re.escape(right)}")
        while (without := inner.sub("", text)) != text:
            text = without
    return text


def _closing(code, at):
    """Where the bracket that opens at `at` is closed."""
    depth = 0
    for match in re.compile(r"[{}()\[\]]").finditer(code, at):
        depth += 1 if match[0] in "{([" else -1
        if depth == 0:
            return match.start()
    return len(code)


class _Class:
    """A class, its data members and the classes in it. access: how the class around it shows it."""

    def __init__(self, name="", line=0, access="public"):
        self.name, self.line, self.access = name, line, access
        self.members, self.inner = [], {}

    def count(self):
        """Data members; a member of a private class inside counts as many as that class has."""
        total = 0
        for member in self.members:
            held = [self.inner[word] for word in re.findall(r"\w+", member) if word in self.inner]
            by_value = not re.search(r"[*&]", member)
            total += held[0].count() if held and held[0].access != "public" and by_value else 1
        return total

    def all(self):
        yield self
        for inner in self.inner.values():
            yield from inner.all()

    def declare(self, statement):
        """Adds what a statement declares, unless it is a function or declares no data."""
        text = _SPECIFIERS.sub("", _flat(statement, "{}", "<>").strip())
        if text and not _NO_DATA.match(text) and "operator" not in text and "(" not in text.split("=")[0]:
            self.members += [part.split("=")[0].strip() for part in _flat(text, "()", "[]").split(",")]

    def read(self, file, code, begin, end, access="public"):
        """Fills in what stands in code[begin:end], namespaces included."""
        head = at = begin
        while match := _MARK.search(code, at, end):
            at, mark = match.end(), match[0]
            if mark == ";":
                self.declare(code[head : match.start()])
                head = at
            elif mark == "(":
                at = _closing(code, match.start()) + 1
            elif mark == "{":
                text, closing = code[head : match.start()].strip(), _closing(code, match.start())
                kind = _CLASS.search(text)
                if kind and not text.startswith("enum"):
                    inner = _Class(kind[2].split("::")[-1] or "struct", file.line_of(match.start()), access)
                    inner.read(file, code, at, closing, "private" if kind[1] == "class" else "public")
                    self.inner.setdefault(inner.name, inner)
                elif re.match(r"(?:inline )?namespace\b|extern\b", text):
                    self.read(file, code, at, closing)
                    head = closing + 1
                elif "(" in text and code[match.start() - 1].isspace() and not _INITIALISED.search(_flat(text, "()")):
                    head = closing + 1  # a function's body
                at = closing + 1
            elif mark != "}":
                head, access = at, mark.split(":")[0].strip()


def _sources(tree):
    return (file for file in tree.sources() if not file.path.startswith("tests/"))


def _judged(tree, rule, found, most, exceptions):
    """Findings for what has more than `most` and no exception, and for exceptions that are not needed."""
    needed = set()
    for path, line, name, count in found:
        if count > most:
            needed.add((path, name))
            if (path, name) not in exceptions:
                yield Finding(path, line, rule, f"{name}: {count}, more than {most}")
    for path, name in sorted(exceptions - needed):
        if tree.exists(path):
            yield Finding(path, 1, rule, f"{name} needs no exception in tables.py")


def _classes(tree):
    for file in _sources(tree):
        code = code_without_directives(file)
        everything = _Class()
        everything.read(file, code, 0, len(code))
        for one in everything.all():
            if one is not everything:
                yield file.path, one.line, one.name, one.count()


def _functions(tree):
    for file in _sources(tree):
        code = code_without_directives(file)
        for match in re.finditer(r"([\w:~]+|\])\s*\(", code):
            closing = _closing(code, match.end() - 1)
            listed, after = code[match.end() : closing], code[closing + 1 : closing + 60].lstrip()
            if listed.count(",") < tables.MOST_PARAMETERS or not _AFTER_PARAMETERS.match(after):
                continue
            parts = [part.strip() for part in _flat(listed, "<>", "{}", "()", "[]").split(",")]
            if sum(bool(_TYPED.match(part)) for part in parts) >= len(parts) - 1:  # else a call
                yield file.path, file.line_of(match.start()), match[1], len(parts)


def members(tree):
    """A class has no more data members than a person keeps in mind; a larger one has parts of its own."""
    return _judged(tree, "members", _classes(tree), tables.MOST_MEMBERS, tables.LARGE_CLASSES)


def parameters(tree):
    """A function has no more parameters than can be told apart at its call; more are a struct."""
    return _judged(tree, "parameters", _functions(tree), tables.MOST_PARAMETERS, tables.LONG_LISTS)


RULES = (members, parameters)
