"""Rules about single files and folders: their size, and what they may not say."""

import re

import tables
from tree import Finding


def folders(tree):
    """A folder holds no more files than a person takes in at a glance, its CMake list aside."""
    for folder, names in tree.names.items():
        files = [name for name in names if name != "CMakeLists.txt"]
        most = tables.MORE_FILES.get(folder, tables.MOST_FILES)
        if len(files) > most and not set(folder.split("/")) & set(tables.DATA_FOLDERS):
            yield Finding(folder or ".", 1, "folders", f"{len(files)} files, more than {most}")


def cmake(tree):
    """A list of sources stands in one place: nothing is added to a target later."""
    for file in tree.cmake_lists():
        for number, line in enumerate(file.lines, 1):
            if re.search(r"\btarget_sources\b", line.split("#")[0]):
                yield Finding(file.path, number, "cmake", "target_sources: name the source where the target is made")


def widths(tree):
    """Comments, CMake lists and Python keep to the width of the page. clang-format sees to C++."""
    for file in tree.sources():
        for number in sorted({number for number, _ in file.comments}):
            if len(file.lines[number - 1]) > tables.MOST_COLUMNS:
                yield Finding(
                    file.path, number, "widths",
                    f"{len(file.lines[number - 1])} columns, more than {tables.MOST_COLUMNS}",
                )
    for file in [*tree.cmake_lists(), *tree.files(".py")]:
        for number, line in enumerate(file.lines, 1):
            if len(line) > tables.MOST_COLUMNS:
                yield Finding(file.path, number, "widths", f"{len(line)} columns, more than {tables.MOST_COLUMNS}")


_DEAD_REFERENCE = re.compile(r"\bDESIGN\b(\.md)?|\bissues? #?\d+\b", re.IGNORECASE)


def references(tree):
    """Nothing refers to what a reader of this repository does not have."""
    files = list(tree.sources()) + list(tree.cmake_lists()) + list(tree.files(".md", ".py", ".toml"))
    for file in files:
        if file.path.startswith("tests/lint/"):
            continue  # this rule's own words
        for number, line in enumerate(file.lines, 1):
            for match in _DEAD_REFERENCE.finditer(line):
                if match[0].upper().startswith("DESIGN") and not match[0].startswith("DESIGN"):
                    continue  # the common word
                yield Finding(file.path, number, "references", f'"{match[0]}" cannot be followed')


_TRANSPARENT = re.compile(
    r"^\s*(?:template\s*<.*>\s*)?(?:inline\s+)?(?:namespace|class|struct|union|enum|extern)\b", re.DOTALL
)
_NAME = re.compile(r"([~\w:]+|operator\S+)\s*(?:<[^<>()]*>)?\s*\(")


def code_without_directives(file):
    """The code with preprocessor lines blanked, so that braces in macros do not count."""
    lines, continued = [], False
    for line in file.code.split("\n"):
        directive = continued or line.lstrip().startswith("#")
        continued = directive and line.endswith("\\")
        lines.append(" " * len(line) if directive else line)
    return "\n".join(lines)


def function_extents(file):
    """(name, first line, last line) of each function that is defined at namespace or class scope.

    Works on formatted code: the brace that opens a body has a space before it, one that initialises a value has none.
    """
    code = code_without_directives(file)
    head = 0  # where the present declaration begins
    depth_in_body = 0  # braces open since the function's own, which counts as 1; 0: in no function
    begin = name = None
    skipped = 0  # braces open in an initialiser outside functions
    for match in re.finditer(r"[{};]", code):
        at, mark = match.start(), match[0]
        if depth_in_body:
            depth_in_body += {"{": 1, "}": -1, ";": 0}[mark]
            if depth_in_body == 0:
                yield name, begin, file.line_of(at)
                head = at + 1
        elif skipped:
            skipped += {"{": 1, "}": -1, ";": 0}[mark]
        elif mark == "{":
            text = code[head:at]
            if not text.strip() or (_TRANSPARENT.match(text) and not text.rstrip().endswith(")")):
                head = at + 1
            elif "(" in text and at > 0 and code[at - 1].isspace() and text.rstrip()[-1] not in "=,(":
                found = _NAME.search(text)
                name = found[1] if found else "?"
                begin = file.line_of(head + len(text) - len(text.lstrip()))
                depth_in_body = 1
            else:
                skipped = 1
        else:
            head = at + 1


def functions(tree):
    """A function fits on a screen."""
    for file in tree.sources():
        if file.path.startswith("tests/"):
            continue
        for name, first, last in function_extents(file):
            length = last - first + 1
            if length > tables.MOST_FUNCTION_LINES and (file.path, name) not in tables.LONG_FUNCTIONS:
                yield Finding(
                    file.path, first, "functions",
                    f"{name}: {length} lines, more than {tables.MOST_FUNCTION_LINES}",
                )


_LOGGED = re.compile(
    r"\bImGui::(?:(?:Small|Arrow)?Button|Checkbox|RadioButton|Selectable|(?:Begin)?Combo|CollapsingHeader)\("
)
_SEEN = re.compile(r"\bImGui::(?:InvisibleButton|(?:V?Slider|Drag|Input|ColorEdit|ColorPicker)\w*)\(")


def widgets(tree):
    """Widgets of the window are made by functions of panel/gui/widgets.h, or told to its seen()."""
    for file in tree.files(".cpp", below="client/displays/window/panel/gui"):
        for match in _LOGGED.finditer(file.code):
            line = file.line_of(match.start())
            yield Finding(file.path, line, "widgets", f"{match[0]}: widgets.h has a function for it")
        for match in _SEEN.finditer(file.code):
            if "seen(" not in file.code[max(0, match.start() - 60) : match.end() + 200]:
                line = file.line_of(match.start())
                yield Finding(file.path, line, "widgets", f"{match[0]}: seen() is not told of it")


# What a person or an order can reach in a window.
_WITHIN_REACH = ("displays/window", "viewer/display", "viewer/input", "viewer/hands")


def clamps(tree):
    """What a person can reach in a window uses within() for bounds: std::clamp ends the program where they cross."""
    for folder in _WITHIN_REACH:
        for file in tree.files(".cpp", ".h", below=f"client/{folder}"):
            for match in re.finditer(r"\bstd::clamp\(", file.code):
                line = file.line_of(match.start())
                yield Finding(file.path, line, "clamps", "std::clamp: common/core/within.h has within()")


def _texts(tree):
    """(file, line, text) of each line of comments and of pages, code in pages aside."""
    for file in tree.sources():
        for number, text in file.comments:
            yield file, number, text.strip()
    for file in tree.files(".py", ".cmake", "CMakeLists.txt", ".sh", ".glsl"):
        for number, line in enumerate(file.lines, 1):
            if match := re.search(r"(?:^|\s)(# .*)", line):
                yield file, number, match[1]
    for file in tree.files(".md"):
        fenced = False
        for number, line in enumerate(file.lines, 1):
            fenced ^= line.startswith("```")
            if not fenced:
                yield file, number, re.sub(r"`[^`]*`", "x", line.lstrip("# ").strip())


def english(tree):
    """Comments and pages begin with a verb or a noun, and name what they speak of."""
    for file, number, text in _texts(tree):
        if file.path.startswith("tests/lint/"):
            continue  # the rule's own words
        for pattern, advice in tables.ENGLISH:
            if match := re.search(pattern, text):
                yield Finding(file.path, number, "english", f'"{match[0].strip()}": {advice}')


RULES = (folders, cmake, widths, references, functions, widgets, clamps, english)
