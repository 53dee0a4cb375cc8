"""Rules about documents: they tell all that there is, nothing that there is not, and their links lead somewhere."""

import glob
import os
import re

import tables
from tree import Finding


def pages(tree):
    """Every document that people read."""
    return [file for file in tree.files(".md") if file.folder in ("", "docs") or file.folder.startswith("compose")]


def _without_fences(file):
    """Lines of a page, those of code blocks blanked."""
    lines, fenced = [], False
    for line in file.lines:
        fence = line.lstrip().startswith("```")
        fenced ^= fence
        lines.append("" if fenced or fence else line)
    return lines


# ---- messages --------------------------------------------------------------------------------------------------------


def _declared_messages(tree):
    """name -> (file, line, [(field, line)]) of the messages in the sources."""
    found = {}
    for file in tree.sources(below=tables.MESSAGES):
        text = file.without_comments
        for match in re.finditer(r'\bkName\s*=\s*"([^"]+)"', text):
            fields = re.finditer(r'\bf\("(\w+)"', text[match.end() : text.find("\n};", match.end())])
            lines = [(f[1], file.line_of(match.end() + f.start())) for f in fields]
            found[match[1]] = (file.path, file.line_of(match.start()), lines)
    return found


def _documented_messages(tree):
    """name -> (line, words of its paragraphs and tables) of the messages in docs/protocol.md."""
    found, name = {}, None
    for number, line in enumerate(tree.file(tables.PROTOCOL_PAGE).lines, 1):
        if match := re.match(r"\*\*(\w+)\*\* - ", line):
            name = match[1]
            found[name] = (number, set())
        elif line.startswith("#"):
            name = None
        if name:
            found[name][1].update(re.findall(r"\w+", line))
    return found


def messages(tree):
    """Every message, with every field, stands in docs/protocol.md; none stands there that is not in the sources."""
    declared = _declared_messages(tree)
    documented = _documented_messages(tree) if tree.exists(tables.PROTOCOL_PAGE) else {}
    for name, (path, line, fields) in declared.items():
        if name not in documented:
            text = f'"{name}" has no paragraph (**{name}** - ...) in {tables.PROTOCOL_PAGE}'
            yield Finding(path, line, "messages", text)
            continue
        for field, field_line in fields:
            if field not in documented[name][1]:
                text = f'"{field}" of "{name}" does not stand in its paragraph of {tables.PROTOCOL_PAGE}'
                yield Finding(path, field_line, "messages", text)
    for name, (line, _) in documented.items():
        if name not in declared:
            yield Finding(tables.PROTOCOL_PAGE, line, "messages", f"**{name}** is no message of {tables.MESSAGES}")


_PAGE_VERSION = re.compile(r"\bversion (?:is )?(\d+)\.|^`v` is (\d+)\.", re.IGNORECASE)


def version(tree):
    """docs/protocol.md says the version that the code speaks, wherever it says one."""
    if not tree.exists(tables.PROTOCOL_PAGE) or not tree.exists(tables.VERSION_FILE):
        return
    declared = re.search(r"\bkProtocolVersion = (\d+);", tree.file(tables.VERSION_FILE).without_comments)
    found = 0
    for number, line in enumerate(tree.file(tables.PROTOCOL_PAGE).lines, 1):
        if match := _PAGE_VERSION.search(line):
            found += 1
            said = match[1] or match[2]
            if said != declared[1]:
                text = f"says version {said}; {tables.VERSION_FILE} has {declared[1]}"
                yield Finding(tables.PROTOCOL_PAGE, number, "version", text)
    if not found:
        yield Finding(tables.PROTOCOL_PAGE, 1, "version", f"says no version; {tables.VERSION_FILE} has {declared[1]}")


# ---- flags -----------------------------------------------------------------------------------------------------------

def _programs(tree):
    return (f for f in tree.sources() if not f.path.startswith("tests/"))


def flags(tree):
    """Every flag that a page names is one of a program."""
    words = set()
    for file in _programs(tree):
        for text in re.findall(r'"((?:\\.|[^"\\\n])*)"', file.without_comments):
            words.update(word.lstrip("!-") for word in re.split(r"[,\s=:'|]+", text))
    for page in pages(tree):
        if page.name == "CHANGELOG.md":
            continue
        for number, line in enumerate(page.lines, 1):
            for name in re.findall(r"`--([a-z](?:[\w.-]*\w)?)", line):
                if name not in words and name not in tables.FOREIGN_FLAGS:
                    yield Finding(page.path, number, "flags", f"no program has --{name}")


# ---- metric columns --------------------------------------------------------------------------------------------------

_CSV_HEADER = re.compile(r'"([a-z][a-z0-9_]*(?:,[a-z][a-z0-9_]*){2,},?)(?:\\n)?"')
# A table of columns (or of figures, which become columns), then a brace; nothing but a type's arguments and an index
# between.
_COLUMN_TABLE = re.compile(r"(?:[cC]olumns?\w*|Figure)\b(?:<[^;{}()]*>)?[\w\s\[\]=>]*\{")
# A name in such a table: an element of a list, or the first thing of a row.
_COLUMN = re.compile(r'(?:[{,]|\.name\s*=)\s*"([a-z][a-z0-9_]*)"\s*(?=[,}])')


def _matching_brace(code, at):
    depth = 0
    for match in re.compile(r"[{}]").finditer(code, at):
        depth += 1 if match[0] == "{" else -1
        if depth == 0:
            return match.start()
    return len(code)


def _columns(file):
    """(name, line) of the columns that a source declares: tables of columns, and headers of CSV files."""
    text = file.without_comments
    for match in _CSV_HEADER.finditer(text):
        for name in match[1].strip(",").split(","):
            yield name, file.line_of(match.start())
    for match in _COLUMN_TABLE.finditer(text):
        end = _matching_brace(file.code, match.end() - 1)
        for name in _COLUMN.finditer(text, match.end() - 1, end + 1):
            yield name[1], file.line_of(name.start(1))


def _documented_columns(tree):
    """name -> (page, line) for the tables below headings that end with .csv."""
    found = {}
    for page in tree.files(".md", below="docs/"):
        inside = False
        for number, line in enumerate(_without_fences(page), 1):
            if line.startswith("#"):
                inside = line.rstrip().endswith(".csv")
            elif inside and line.startswith("|"):
                for name in line.split("|")[1].split(","):
                    if re.fullmatch(r"[a-z][a-z0-9_]*", name.strip()) and name.strip() != "column":
                        found[name.strip()] = (page.path, number)
    return found


def columns(tree):
    """Every column of a CSV file stands in a table of docs/ below a heading NAME.csv; each one there is written."""
    documented = _documented_columns(tree)
    declared = {}
    for file in _programs(tree):
        if file.path.startswith("common/geometry/"):
            continue  # trajectories: people write them
        for name, line in _columns(file):
            declared.setdefault(name, (file.path, line))
    for name, (path, line) in declared.items():
        if name not in documented:
            yield Finding(
                path, line, "columns",
                f"{name} stands in no table of docs/ below a heading that ends with .csv",
            )
    for name, (path, line) in documented.items():
        if name not in declared and name not in tables.FOREIGN_COLUMNS:
            yield Finding(path, line, "columns", f"no table of columns has {name}")


# ---- links and paths -------------------------------------------------------------------------------------------------

_LINK = re.compile(r"\[[^\]]*\]\(\s*<?([^)\s>]+)>?[^)]*\)")


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    found, seen = set(), {}
    for line in _without_fences(page):
        match = re.match(r"#{1,6}\s+(.*?)\s*#*$", line)
        if match:
            text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", match[1])
            anchor = re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")
            count = seen.get(anchor, 0)
            seen[anchor] = count + 1
            found.add(f"{anchor}-{count}" if count else anchor)
    return found


def links(tree):
    """Links between pages lead to files and headings that are there."""
    for page in pages(tree):
        for number, line in enumerate(_without_fences(page), 1):
            for match in _LINK.finditer(re.sub(r"`[^`]*`", lambda m: " " * len(m[0]) if "](" in m[0] else m[0], line)):
                target, _, anchor = match[1].partition("#")
                if re.match(r"[a-z]+:", target):
                    continue
                path = os.path.normpath(os.path.join(page.folder, target)) if target else page.path
                if not tree.exists(path):
                    yield Finding(page.path, number, "links", f"{match[1]}: there is no {path}")
                elif anchor and path.endswith(".md") and anchor not in anchors(tree.file(path)):
                    yield Finding(page.path, number, "links", f"{match[1]}: {path} has no heading #{anchor}")


# A sentence's end with another sentence behind it; list marks and bold words at the beginning of a line do not count.
_SENTENCE_END = re.compile(r"(\S+[.?!])[)*\"]*\s+(?=[A-Z`*\[\"(])")
_LINE_BEGIN = re.compile(r"^\s*(?:[-*]\s+|\d+\.\s+)?(?:\*\*[^*]+\*\*\s+)?")
_ABBREVIATIONS = ("al.", "eq.", "cf.", "vs.", "e.g.", "i.e.")


def sentences(tree):
    """Pages have one sentence a line, so that a change of one shows as one."""
    for page in pages(tree):
        if page.folder not in ("", "docs") or page.name == "CHANGELOG.md":
            continue
        for number, line in enumerate(_without_fences(page), 1):
            if line.startswith(("|", "#", "!")):
                continue
            text = line[_LINE_BEGIN.match(line).end() :]
            text = re.sub(r"`[^`]*`|\([^()]*\)", lambda m: re.sub(r"[.?!]", "_", m[0]), text)
            ends = [m for m in _SENTENCE_END.finditer(text) if m[1].split("(")[-1] not in _ABBREVIATIONS]
            if ends:
                yield Finding(page.path, number, "sentences", f'a second sentence begins behind "{ends[0][1]}"')


_TOPS = "|".join(["cmake", "client", "common", "compose", "docs", "examples", "services", "tests", "tools"])
_PAGE_PATH = re.compile(rf"`((?:{_TOPS})/[\w./*{{}},-]+|[\w/-]+\.(?:h|cpp))`")
_COMMENT_PATH = re.compile(r"(?<![\w/.<-])((?:[\w-]+/)*[\w-]+\.(?:h|cpp|md))\b")


def _stands(tree, path, suffixes):
    if path in tables.FOREIGN_FILES or any(word in path for word in tables.PLACEHOLDERS):
        return True
    if "*" in path or "{" in path:
        braces = re.search(r"\{([^}]*)\}", path)
        options = [path.replace(braces[0], part) for part in braces[1].split(",")] if braces else [path]
        return all(glob.glob(str(tree.root / option)) for option in options)
    return tree.exists(path) or path in suffixes


def paths(tree):
    """Files and folders that documents and comments name are there."""
    suffixes = set()
    for file in tree.files(*(".h", ".cpp", ".md")):
        parts = file.path.split("/")
        suffixes.update("/".join(parts[i:]) for i in range(len(parts)))
    for page in pages(tree):
        if page.name == "CHANGELOG.md":
            continue  # tells of the past, too
        for number, line in enumerate(_without_fences(page), 1):
            for match in _PAGE_PATH.finditer(line):
                if not _stands(tree, match[1].rstrip("/"), suffixes):
                    yield Finding(page.path, number, "paths", f"there is no {match[1]}")
    for file in tree.sources():
        for number, comment in file.comments:
            for match in _COMMENT_PATH.finditer(comment):
                if not _stands(tree, match[1], suffixes):
                    yield Finding(file.path, number, "paths", f"there is no {match[1]}")


RULES = (messages, version, flags, columns, links, paths, sentences)
