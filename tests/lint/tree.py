"""The files of the repository, as the rules read them."""

import dataclasses
import functools
import os
import pathlib
import re

# The folders that rules look at. Build folders and run folders lie beside them.
ROOTS = ("cmake", "client", "common", "compose", "docs", "examples", "services", "tests", "tools")
SOURCES = (".h", ".cpp")

# Whatever is not code: raw strings, strings, characters, comments.
_NOT_CODE = re.compile(
    r'R"(?P<mark>[^\s()\\]{0,16})\(.*?\)(?P=mark)"'
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'(?:\\[^\n']+|\\'|[^'\\\n])'"
    r"|//[^\n]*"
    r"|/\*.*?\*/",
    re.DOTALL,
)
_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:"([^"\n]+)"|<([^>\n]+)>)', re.MULTILINE)


@dataclasses.dataclass(frozen=True, order=True)
class Finding:
    """One violation of one rule."""

    path: str
    line: int
    rule: str
    text: str

    def __str__(self):
        return f"{self.path}:{self.line}: {self.rule}: {self.text}"


@dataclasses.dataclass(frozen=True)
class Include:
    """One include directive. own: written in quotes, so of this repository."""

    line: int
    target: str
    own: bool


def _blank(text):
    return re.sub(r"[^\n]", " ", text)


class File:
    """One text file. Everything is computed when it is first asked for."""

    def __init__(self, root, path):
        self.path = path
        self.name = os.path.basename(path)
        self.folder = os.path.dirname(path)
        self._root = root

    @functools.cached_property
    def text(self):
        return (self._root / self.path).read_text(encoding="utf-8", errors="replace")

    @functools.cached_property
    def lines(self):
        return self.text.split("\n")

    @functools.cached_property
    def code(self):
        """The text with comments, strings and characters blanked; lines and columns stay."""
        return _NOT_CODE.sub(lambda m: _blank(m[0]), self.text)

    @functools.cached_property
    def without_comments(self):
        """The text with comments blanked."""
        return _NOT_CODE.sub(lambda m: _blank(m[0]) if m[0][:2] in ("//", "/*") else m[0], self.text)

    @functools.cached_property
    def comments(self):
        """(line, text) of each line of each comment."""
        found = []
        for match in _NOT_CODE.finditer(self.text):
            if match[0][:2] in ("//", "/*"):
                first = self.line_of(match.start())
                found += [(first + i, part) for i, part in enumerate(match[0].split("\n"))]
        return found

    @functools.cached_property
    def includes(self):
        return [
            Include(self.line_of(m.start(1 if m[1] else 2)), m[1] or m[2], m[1] is not None)
            for m in _INCLUDE.finditer(self.without_comments)
            if "#" in self.code[m.start() : m.end()]  # not in a string
        ]

    def line_of(self, offset):
        return self.text.count("\n", 0, offset) + 1


class Tree:
    """The repository below `root`, or a small one that looks like it."""

    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.names = {}  # folder -> names of the files in it
        self._files = {}
        self._walk()

    def _walk(self):
        self.names[""] = sorted(p.name for p in self.root.iterdir() if p.is_file())
        for top in ROOTS:
            for folder, folders, names in os.walk(self.root / top):
                folders[:] = sorted(f for f in folders if f not in ("__pycache__",))
                relative = os.path.relpath(folder, self.root).replace(os.sep, "/")
                self.names[relative] = sorted(names)

    def file(self, path):
        if path not in self._files:
            self._files[path] = File(self.root, path)
        return self._files[path]

    def exists(self, path):
        return (self.root / path).exists()

    def files(self, *endings, below=""):
        """Files whose path ends with one of `endings`, in order of paths."""
        for folder in sorted(self.names):
            for name in self.names[folder]:
                path = f"{folder}/{name}" if folder else name
                if path.endswith(endings) and path.startswith(below):
                    yield self.file(path)

    def sources(self, below=""):
        return self.files(*SOURCES, below=below)

    def cmake_lists(self):
        return self.files("CMakeLists.txt", ".cmake")
