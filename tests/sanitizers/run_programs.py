#!/usr/bin/python3
"""Runs test programs of a sanitized tree, each once with all its tests: a process a test would take half a second more.

usage: run_programs.py PRESET [--jobs N] [--minutes N] [--logs FOLDER] [CTEST ARGUMENTS that choose tests, as -L LABEL]
  --jobs N      programs at a time (the cores)
  --minutes N   that a program may take (20)
  --logs DIR    what they print (build/PRESET/sanitized)
  Other tests (scripts) run as ctest runs them.
  Exit code: 0 all is well, 1 a test failed, a finding, or a program over its time, 2 no tests are chosen.
"""
import argparse
import concurrent.futures
import json
import os
import re
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
FINDING = re.compile(rb"WARNING: ThreadSanitizer|ERROR: \w+Sanitizer|runtime error:")


def programs(preset, choice):
    """{name: (command, working folder)} of what ctest would run, test programs without the filters of single tests."""
    listed = subprocess.run(["ctest", "--preset", preset, "--show-only=json-v1", *choice], cwd=ROOT, check=True,
                            capture_output=True)
    out = {}
    for test in json.loads(listed.stdout)["tests"]:
        command = [a for a in test["command"] if not a.startswith("--gtest_")]
        whole = len(command) < len(test["command"])
        folder = next((p["value"] for p in test["properties"] if p["name"] == "WORKING_DIRECTORY"), ROOT)
        out[os.path.basename(command[0]) if whole else test["name"]] = (command, folder)
    return out


def run(name, command, folder, options):
    """What became of it, in a line; whether that is well."""
    log = os.path.join(options.logs, name + ".log")
    begin_s = time.monotonic()
    with open(log, "wb") as out:
        try:
            code = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT,
                                  timeout=60 * options.minutes).returncode
        except subprocess.TimeoutExpired:
            code = f"over {options.minutes:g} minutes"
    with open(log, "rb") as file:
        text = file.read()
    passed = text.count(b"[       OK ]")
    what = [f"{passed} passed"] if passed else []
    failed = re.findall(rb"^\[  FAILED  \] (\S+)(?: \(|, where)", text, re.MULTILINE)
    what += [f"FAILED {t.decode()}" for t in sorted(set(failed))]
    findings = len(FINDING.findall(text))
    if findings:
        what.append(f"{findings} findings")
    well = code in (0, 77)
    what += ["skipped"] if code == 77 else [] if well else [f"code {code}", log]
    return f"{name:<28}{time.monotonic() - begin_s:>6.0f} s  {', '.join(what) or 'passed'}", well


def main():
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("preset")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--minutes", type=float, default=20)
    parser.add_argument("--logs")
    options, choice = parser.parse_known_args()
    options.logs = options.logs or os.path.join(ROOT, "build", options.preset, "sanitized")
    os.makedirs(options.logs, exist_ok=True)
    wanted = programs(options.preset, choice)
    if not wanted:
        print("sanitize: no tests are chosen by these arguments", file=sys.stderr)
        return 2
    well = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        under_way = [pool.submit(run, name, *what, options) for name, what in wanted.items()]
        for one in concurrent.futures.as_completed(under_way):
            line, good = one.result()
            well += good
            print(line, flush=True)
    print(f"{well} of {len(wanted)} programs are clean; what they printed is in {options.logs}")
    return 0 if well == len(wanted) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
