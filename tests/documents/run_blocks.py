#!/usr/bin/env python3
"""Runs every command of the pages given, as it stands there, so that what the documents say cannot drift.

A block without a language holds commands. They run in a folder of their own, one after the other, and each must end
with exit code 0. These things differ from what a person does:
- data sets with the names that a page uses are small and made up (files.py);
- runs, and those of sweeps, are short, their displays small, and few of their frames are verified; `compare` draws one
  pose once;
- windows open on an Xvfb;
- the addresses of other machines are this machine's;
- `telesplat ctl` talks to what the last `run` or `view` of its block started, or the command of a comment above the
  block, <!-- beside: COMMAND -->; a service goes to the background until `telesplat ctl stop`, or the page's end.
Scene files (toml) and head movements (csv) run, too, and Python beside a run's record; blocks of the language text are
looked at by nobody.
Commands that need a network, root or a long time are told and left out (SKIPPED).
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import blocks
from files import Files

# The begins of commands that are not run, and the reasons.
SKIPPED = {
    r"tools/(demo|test|setup)\b": "it sets up and builds this tree",
    r"(cmake|ctest)\b": "it builds this tree",
    r"(tools/lab/gpu-check|tar -xf gpu-check)\b": "it packs this build for another machine",
    r"(compose/prepare|cp .* compose/files|(\w+=\S+ )*docker|for s in master)\b":
        "it needs docker; compose/test runs it",
    r"(apt-get|debootstrap|tar -C|rm -rf /tmp/bookworm)\b": "it needs root and a network",
}
SERVICES = {f"telesplat-{name}" for name in ("master", "data", "packer", "sampler", "viewer", "wan-relay")}
OTHER_MACHINES = re.compile(r"\b192\.168\.\d+\.\d+\b")
PATIENCE_S = 180  # for one command
SECONDS, WIDTH, HEIGHT, VERIFY_EVERY = 0.7, 320, 240, 100  # for runs


def small(size):
    """A size of the same shape, at most WIDTH wide."""
    width, height = (int(n) for n in size.split("x"))
    times = max(1, -(-width // WIDTH))
    return f"{width // times}x{height // times}"


def shortened(text, seconds=SECONDS):
    """A `telesplat run` or `view`, made short and small."""
    text = re.sub(r"--verify[ =]\d+", f"--verify {VERIFY_EVERY}", text)
    text = re.sub(r"--size[ =](\d+x\d+)", lambda found: f"--size {small(found[1])}", text)
    if re.search(r"--duration[ =]", text):
        text = re.sub(r"--duration[ =]\S+", f"--duration {seconds}", text)
    else:
        text += f" --duration {seconds}"
    return text if re.search(r"--size[ =]|--wall \S+\.toml", text) else f"{text} --size {WIDTH}x{HEIGHT}"


def shortened_sweep(text):
    """A `telesplat sweep`, of one short and small run for each configuration."""
    own, behind, flags = text.partition(" -- ")
    if not behind:
        return text  # the command goes on
    return f"{own} --repeat 1 -- {shortened(flags)}"


class Screen:
    """An X server without a screen, where one is installed."""

    def __init__(self):
        self.display, self._server = "", None
        if not shutil.which("Xvfb"):
            return
        ours, theirs = os.pipe()
        command = ["Xvfb", "-displayfd", str(theirs), "-noreset", "-screen", "0", "1280x1024x24"]
        self._server = subprocess.Popen(command, pass_fds=[theirs], stderr=subprocess.DEVNULL)
        os.close(theirs)
        with os.fdopen(ours) as said:
            number = said.readline().strip()
        self.display = f":{number}" if number else ""

    def close(self):
        if self._server:
            self._server.terminate()
            self._server.wait()


class Page:
    """Runs the blocks of one page in `folder`."""

    def __init__(self, root, programs, folder, display):
        self._folder, self._programs, self._display = folder, programs, display
        self._files = Files(programs, folder)
        self._background = []  # (text, process, output) of services, or of a session for ctl
        self._beside = ""  # the command that must run while `telesplat ctl` does
        self.failures = 0
        self.ran = 0
        for name in ("examples", "tools"):
            os.symlink(os.path.join(root, name), os.path.join(folder, name))
        os.makedirs(os.path.join(folder, "build/release"))
        os.symlink(programs, os.path.join(folder, "build/release/bin"))
        self._environment = self._make_environment()

    def _make_environment(self):
        out = {k: v for k, v in os.environ.items() if not k.startswith("TELESPLAT_")}
        for name in ("HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR", "TELESPLAT_RUNTIME"):
            out[name] = os.path.join(self._folder, "." + name.lower())
            os.mkdir(out[name], 0o700)
        out["PATH"] = self._programs + os.pathsep + out["PATH"]
        out["DISPLAY"] = self._display
        return out

    # ---- blocks ----

    def run(self, text):
        for block in blocks.blocks(text):
            if block.language == "":
                self._run_commands(block)
            elif block.language == "toml":
                self._run_block_as("telesplat run {}", block, ".toml")
            elif block.language == "csv":
                self._run_block_as("telesplat run MY.ply --trajectory {}", block, ".csv")
            elif block.language == "python":
                self._run_python(block)
            elif block.language != "text":
                self._fail(f"line {block.line}: nobody knows how to try a block of the language {block.language}", "")

    def close(self):
        self._end_background(signal.SIGTERM)

    def _run_commands(self, block):
        self._beside = block.beside
        for command in blocks.commands(block):
            text = OTHER_MACHINES.sub("127.0.0.1", command.text)
            reason = self._reason_to_skip(text, command.words)
            if reason:
                print(f"  line {command.line}: left out, for {reason}: {text}")
                continue
            self._files.make_those_in(text)
            self._run_one(command, text)
        if self._background and not any(t.startswith("telesplat-") for t, _, _ in self._background):
            self._stop_session()

    def _run_block_as(self, command, block, ending):
        self._files.make_those_in(block.text + command)
        path = f"block-{block.line}{ending}"
        with open(os.path.join(self._folder, path), "w") as file:
            file.write(block.text)
        self._foreground(f"line {block.line}", shortened(command.format(path)))

    def _run_python(self, block):
        where, path = f"line {block.line}", f"block-{block.line}.py"
        if not os.path.exists(os.path.join(self._folder, "runs/latest")):
            self._files.make_those_in("MY.ply")
            self._foreground(where, shortened("telesplat run MY.ply"))
        with open(os.path.join(self._folder, path), "w") as file:
            file.write(block.text)
        self._foreground(where, f"{sys.executable} {path}")

    def _reason_to_skip(self, text, words):
        for pattern, reason in SKIPPED.items():
            if re.match(pattern, text):
                return reason
        if words[1:2] == ["view"] and not self._display:
            return "there is no Xvfb"
        if re.search(r"\.mp4\b", text) and not shutil.which("ffmpeg"):
            return "there is no ffmpeg"
        return ""

    # ---- commands ----

    def _run_one(self, command, text):
        program, verb = os.path.basename(command.words[0]), (command.words[1:] + [""])[0]
        where = f"line {command.line}"
        if program in SERVICES or (program == "telesplat-lab" and verb == "pose-replay"):
            self._start_service(where, text, program)
        elif program == "telesplat" and verb in ("run", "view"):
            self._beside = text
            self._foreground(where, shortened(text))
        elif program == "telesplat" and verb == "sweep":
            self._foreground(where, shortened_sweep(text))
        elif program == "telesplat" and verb == "compare" and "--poses" not in text:
            self._foreground(where, f"{text} --poses 1 --repeat 1")
        elif program == "telesplat" and verb == "ctl":
            self._control(where, text)
        else:
            self._foreground(where, text)

    def _control(self, where, text):
        if not self._background and self._beside:
            self._files.make_those_in(self._beside)
            self._start(shortened(self._beside, 0))
            self._wait_for_session(where)
        elif any(t.startswith("telesplat-viewer") for t, _, _ in self._background):
            self._wait_for_session(where)  # else the session may be stopped before its viewer has joined
        self._foreground(where, text)
        if re.search(r"\bctl stop\b", text):
            self._end_background(None)

    def _start_service(self, where, text, program):
        if program == "telesplat-master":
            self._end_background(signal.SIGTERM)
        print(f"  {where}: in the background: {text}")
        self._start(text)

    def _start(self, text):
        output = tempfile.TemporaryFile(mode="w+", dir=self._folder)
        process = subprocess.Popen(
            ["bash", "-c", "exec " + text], cwd=self._folder, env=self._environment, stdout=output, stderr=output,
            stdin=subprocess.DEVNULL)
        self._background.append((text, process, output))

    def _foreground(self, where, text):
        print(f"  {where}: {text}", flush=True)
        self.ran += 1
        begin = time.monotonic()
        try:
            done = subprocess.run(
                ["bash", "-c", text], cwd=self._folder, env=self._environment, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE_S)
        except subprocess.TimeoutExpired as late:
            return self._fail(f"{where}: not done after {PATIENCE_S} s: {text}", (late.stdout or b"").decode())
        if done.returncode:
            return self._fail(f"{where}: exit code {done.returncode} after {time.monotonic() - begin:.1f} s: {text}",
                              done.stdout.decode(errors="replace"))

    def _fail(self, what, output):
        self.failures += 1
        print(f"FAILED {what}\n" + "".join(f"    {line}\n" for line in output.splitlines()[-25:]), flush=True)

    # ---- what runs meanwhile ----

    def _wait_for_session(self, where):
        ask = [os.path.join(self._programs, "telesplat"), "ctl", "status", "--json"]
        for _ in range(120):
            asked = subprocess.run(ask, env=self._environment, cwd=self._folder, stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL)
            status = json.loads(asked.stdout) if asked.returncode == 0 else {}
            viewers = [p for p in status.get("processes", []) if p["role"] == "viewer"]
            if viewers and all(p.get("values", {}).get("frames", 0) > 0 for p in viewers):
                return
            time.sleep(0.5)
        self._fail(f"{where}: no viewer of the session shows anything after a minute", "")

    def _stop_session(self):
        ask = [os.path.join(self._programs, "telesplat"), "ctl", "stop"]
        subprocess.run(ask, env=self._environment, cwd=self._folder, stdout=subprocess.DEVNULL)
        self._end_background(None)

    def _end_background(self, signal_number):
        """Sends a signal, or none where they were told to stop; all must end with exit code 0."""
        if signal_number:
            for _, process, output in self._background:
                # A program without output may not handle signals yet.
                until_s = time.monotonic() + 20
                while process.poll() is None and not os.fstat(output.fileno()).st_size and time.monotonic() < until_s:
                    time.sleep(0.05)
                if process.poll() is None:
                    process.send_signal(signal_number)
        for text, process, output in self._background:
            try:
                code = process.wait(timeout=120)
            except subprocess.TimeoutExpired:
                code = "none within 120 s"
                process.terminate()
                try:
                    process.wait(timeout=10)
                except subprocess.TimeoutExpired:
                    process.kill()
            if code != 0:
                output.seek(0)
                self._fail(f"in the background, exit code {code}: {text}", output.read())
            output.close()
        self._background = []


def run_page(options, path, display):
    """(commands that ran, those that failed)"""
    folder = tempfile.mkdtemp(prefix="telesplat-blocks-")
    page = Page(os.path.abspath(options.root), os.path.abspath(options.bin), folder, display)
    print(path)
    try:
        with open(path, encoding="utf-8") as file:
            page.run(file.read())
    finally:
        page.close()
        if options.keep:
            print(f"  everything lies in {folder}")
        else:
            shutil.rmtree(folder, ignore_errors=True)
    return page.ran, page.failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="+", help="Markdown files")
    parser.add_argument("--root", default=os.path.join(os.path.dirname(__file__), "../.."), help="of the source tree")
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--keep", action="store_true", help="keep what the commands leave")
    options = parser.parse_args()
    screen = Screen()
    try:
        counts = [run_page(options, path, screen.display) for path in options.pages]
    finally:
        screen.close()
    ran, failed = (sum(column) for column in zip(*counts))
    print(f"{ran} commands ran, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
