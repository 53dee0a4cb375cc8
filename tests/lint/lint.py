#!/usr/bin/env python3
"""Holds the house rules: prints each violation as FILE:LINE: RULE: what, and exits 1 if there is one.

usage: lint.py [--root DIR] [--list] [RULE...]     without RULE: all of them
"""

import argparse
import pathlib
import sys

import class_rules
import document_rules
import include_rules
import text_rules
from tree import Tree

MODULES = (include_rules, class_rules, text_rules, document_rules)
RULES = {rule.__name__: rule for module in MODULES for rule in module.RULES}


def main():
    parser = argparse.ArgumentParser(description="Holds the house rules.")
    parser.add_argument("--root", default=pathlib.Path(__file__).resolve().parents[2], help="of the repository")
    parser.add_argument("--list", action="store_true", help="print the rules and end")
    parser.add_argument("rules", nargs="*", metavar="RULE", help="which rules; without: all")
    options = parser.parse_args()
    if options.list:
        for name, rule in RULES.items():
            print(f"{name:16} {rule.__doc__.splitlines()[0]}")
        return 0
    unknown = [name for name in options.rules if name not in RULES]
    if unknown:
        parser.error(f"there is no rule {unknown[0]}; there are: {', '.join(RULES)}")
    tree = Tree(options.root)
    findings = sorted(finding for name in options.rules or RULES for finding in RULES[name](tree))
    for finding in findings:
        print(finding)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
