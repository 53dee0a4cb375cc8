"""Code blocks of Markdown pages, and the commands in them."""

import re
import shlex
from dataclasses import dataclass, field


@dataclass
class Command:
    text: str  # as a shell takes it: continuation lines joined, without the comment at its end
    line: int  # in the page, from 1
    words: list = field(default_factory=list)  # without settings of the environment in front of the program


@dataclass
class Block:
    language: str  # "" for commands
    line: int  # its first line inside the block
    lines: list
    beside: str = ""  # a command that runs meanwhile, from a comment above the block

    @property
    def text(self):
        return "".join(line + "\n" for line in self.lines)


_BESIDE = re.compile(r"<!-- beside: (.+) -->$")


def blocks(page):
    """Every fenced block of a page's text, in order. Error: a fence that does not end."""
    found, begin, language = [], None, ""
    lines = page.splitlines()
    for number, line in enumerate(lines, 1):
        if not line.startswith("```"):
            continue
        if begin is None:
            begin, language = number, line[3:].strip()
        else:
            beside = _BESIDE.match(lines[begin - 2]) if begin > 1 else None
            found.append(Block(language, begin + 1, lines[begin : number - 1], beside[1] if beside else ""))
            begin = None
    if begin is not None:
        raise ValueError(f"line {begin}: the code block does not end")
    return found


def _without_comment(line):
    """A line without the shell comment at its end."""
    quote = ""
    for at, letter in enumerate(line):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter == "#" and (at == 0 or line[at - 1].isspace()):
            return line[:at].rstrip()
    return line.rstrip()


def commands(block):
    """The commands of a block; lines that end in a backslash, and loops, are one with what follows."""
    found, text, begin = [], "", 0
    for number, line in enumerate(block.lines, block.line):
        line = _without_comment(line)
        if not text:
            begin = number
        text += line
        if not text:
            continue
        if text.endswith("\\"):
            text = text[:-1]
            continue
        if re.match(r"(for|while|if)\b", text) and not re.search(r"\b(done|fi)$", text):
            text += "\n"
            continue
        found.append(Command(text, begin, _words(text)))
        text = ""
    if text:
        raise ValueError(f"line {begin}: the command does not end")
    return found


def _words(text):
    words = shlex.split(text)
    while words and re.match(r"\w+=", words[0]):
        words.pop(0)
    return words
