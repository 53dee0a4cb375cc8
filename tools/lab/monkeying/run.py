"""One run of a monkey: a session with a window, what is done to it, and what may not become of it."""

import collections
import glob
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time

import data
import display
import events

BAD = re.compile(
    r"Assertion|ERROR: (?:Address|Leak|Thread)Sanitizer|runtime error:|terminate called|\bdied \(|CHECK failed"
    r"|Segmentation fault|ended with code (?!2\b)"
)
WHOLE = (640, 560)  # pixels of the window
WHEEL = 80  # pixels that a list scrolls at most in a step of the wheel
ENOUGH = 3  # uses of a widget in earlier runs; above that it is chosen no less often than others
NEVER = ("messages_rejected", "digests_different", "tiles_refused", "tiles_unsealed", "keys_refused")  # must stay 0


def known_as(name):
    """A widget's name in the coverage: files are as good as one another, and so are measured places."""
    return re.sub(r"^(Measurements/remove) \d+$", r"\1 *", re.sub(r"^(Open/(?:file|recent))=.*", r"\1=*", name))


class Fault(Exception):
    """What went wrong."""


class Run:
    """One seed's session and its window."""

    def __init__(self, options, scene, preset, folder):
        self.options, self.folder = options, folder
        self.patience_s = 30 * (5 if options.sanitized else 1)
        shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(os.path.join(folder, "work"))
        os.makedirs(os.path.join(folder, "tmp"))
        at = lambda name: os.path.join(folder, name)  # noqa: E731
        self.log, self.widget_file = at("view.log"), at("widgets")
        reports = f"log_path={at('sanitizer')}"
        self.environment = os.environ | {
            "TELESPLAT_RUNTIME": at("runtime"),
            "TELESPLAT_WIDGET_LOG": self.widget_file,
            "TELESPLAT_MONKEY": folder,
            "TMPDIR": at("tmp"),
            "XDG_CONFIG_HOME": at("config"),
            "XDG_CACHE_HOME": os.path.join(options.out, "cache"),
            "ASAN_OPTIONS": f"{reports}:detect_leaks=0",
            "UBSAN_OPTIONS": f"{reports}:print_stacktrace=1:halt_on_error=1",
        }
        for name in ("WAYLAND_DISPLAY", "TELESPLAT_MASTER", "TELESPLAT_KEYS"):
            self.environment.pop(name, None)
        self.hands = display.Hands(self.environment)
        self.environment["DISPLAY"] = self.hands.name
        path, more = options.scenes[scene]
        self.shows = bool(path)
        size = f"{WHOLE[0]}x{WHOLE[1]}"
        command = [options.program("telesplat"), "view", *([path] if path else []), *more, "--size", size]
        if preset and data.is_volume(scene):
            command += ["--tf", preset]
        with open(self.log, "w") as log:
            self.session = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                            env=self.environment, cwd=at("work"), start_new_session=True)
        self.orders, self.keys, self.acted = collections.Counter(), collections.Counter(), set()
        self.tried, self.flying, self.beside = collections.Counter(), False, None
        self.before, self.openers, self.opens = (None, set()), options.openers, False

    # ---- what became of it ----
    def alive(self):
        return self.session.poll() is None

    def check(self):
        with open(self.log, errors="replace") as file:
            told = file.read()
        for name in os.listdir(self.folder):
            if name.startswith("sanitizer"):
                with open(os.path.join(self.folder, name), errors="replace") as file:
                    told += file.read()
        bad = BAD.search(told)
        if bad:
            raise Fault(told[told.rfind("\n", 0, bad.start()) + 1:][:600].strip())
        if not self.alive():
            raise Fault(f"the session ended with code {self.session.returncode}: {told.strip()[-300:]}")

    def check_counters(self):
        """Nobody of the session may have said what another refuses, or hold other points than the packer."""
        self.ctl(["status", "--json"])
        status = json.loads(self.told() or "{}")
        for p in status.get("processes", []):
            for name in NEVER:
                if p.get("values", {}).get(name, 0) > 0:  # a process that has just joined has sent no values
                    raise Fault(f"{p['name']} counts {p['values'][name]} {name}{self.dropped()}")

    def dropped(self):
        """What the processes' logs, which go when the session ends, say of messages."""
        out = ""
        for path in glob.glob(os.path.join(self.folder, "tmp", "**", "*.log"), recursive=True):
            with open(path, errors="replace") as file:
                out += "".join(f"\n  {os.path.basename(path)}: {line.rstrip()}" for line in file if "dropped" in line)
        return out

    def mine(self):
        """Processes of this run that go on."""
        out = {}
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{pid}/environ", "rb") as file:
                    ours = f"TELESPLAT_MONKEY={self.folder}".encode() + b"\0" in file.read()
                with open(f"/proc/{pid}/stat") as file:
                    state = file.read().rsplit(")", 1)[1].split()[0]
                with open(f"/proc/{pid}/comm") as file:
                    name = file.read().strip()
            except (OSError, IndexError):
                continue
            if ours and state != "Z" and int(pid) != self.hands.server.pid:
                out[int(pid)] = name
        return out

    def begin(self):
        until_s = time.monotonic() + 6 * self.patience_s
        while not self.opened() or (self.shows and " fps" not in self.hands.title()):
            self.check()
            if time.monotonic() > until_s:
                raise Fault("the window does not show the data")
            time.sleep(0.05)
        self.hands.focus(True)
        self.answer()

    def opened(self):
        try:  # a window whose OpenGL is too old makes room for another
            return self.hands.find() and self.hands.answers(5, self.alive) and self.hands.size()[0] > 1
        except display.error.XError:
            return False

    def answer(self):
        if not self.hands.answers(self.patience_s, self.alive):
            self.check()
            raise Fault(f"the window has not answered for {self.patience_s} s")

    def finish(self, event):
        """The last event, after which the session ends and leaves nothing behind."""
        self.act(event)
        try:
            code = self.session.wait(self.patience_s)
            self.told()
        except subprocess.TimeoutExpired:
            raise Fault(f"{' '.join(event)} did not end the session in {self.patience_s} s") from None
        if code != 0:
            raise Fault(f"{' '.join(event)} ended the session with code {code}")
        until_s = time.monotonic() + self.patience_s
        while self.mine() and time.monotonic() < until_s:
            time.sleep(0.1)
        if self.mine():
            raise Fault(f"left behind: {', '.join(self.mine().values())}")

    def end(self):
        for number in (signal.SIGTERM, signal.SIGKILL):
            until_s = time.monotonic() + 5
            for pid in self.mine():
                try:
                    os.kill(pid, number)
                except ProcessLookupError:
                    pass
            while (self.mine() or self.session.poll() is None) and time.monotonic() < until_s:
                time.sleep(0.05)
        self.hands.end()

    # ---- widgets ----
    def widgets(self):
        """{name: (kind, left, top, right, bottom, here, reachable, uses)}"""
        try:
            with open(self.widget_file) as file:
                rows = [line.rstrip("\n").split("\t") for line in file]
        except OSError:
            return {}
        return {r[0]: (r[1], *(int(v) for v in r[2:])) for r in rows}

    def settle(self):
        """Waits for a build of the panel that knows of what was done: the window answers once a frame."""
        self.answer()
        self.answer()

    def click_on(self, w, x=0.5, y=0.5, button=1, count=1):
        self.hands.move(w[1] + x * (w[3] - w[1]), w[2] + y * (w[4] - w[2]))
        for n in range(count):  # the panel takes one click a frame
            if n:
                self.settle()
            self.hands.click(button)

    def scroll_to(self, name):
        top, tries = None, 0
        while tries < 3:
            w = self.widgets().get(name)
            if not w or not w[5] or w[6]:
                return w if w and w[6] else None
            tries, top = tries + 1 if w[2] == top else 0, w[2]
            height = self.hands.size()[1]
            part = name.split("=")[0] + "="
            beside = [o for n, o in self.widgets().items() if n.startswith(part) and o[6]]  # in the open list
            middle = (beside[0][2] + beside[0][4]) / 2 if beside else height / 2
            self.hands.move((w[1] + w[3]) / 2, middle)
            way = (w[2] + w[4]) / 2 - middle
            self.hands.click(4 if way < 0 else 5, max(1, min(20, int(abs(way) / WHEEL))))
            self.settle()
        return None

    def reach(self, name):
        """The widget where it can be clicked, after what leads to it: a window that is large enough and not in flight,
        Tab, a closed section, the wheel. Or None."""
        all_here = lambda: {n: w for n, w in self.widgets().items() if w[5]}  # noqa: E731
        if self.flying:
            self.hands.tap("Escape")
            self.flying = False
        if self.hands.size()[0] < 400 or self.hands.size()[1] < 300:
            self.hands.resize(*WHOLE)
            self.settle()
        if self.widgets() and not all_here():
            self.hands.tap("Tab")
            self.settle()
        header = f"panel/{name.split('/')[0]}"
        if name not in all_here() and "=" not in name and header in all_here():
            w = self.scroll_to(header)
            if w:
                self.click_on(w)
                self.settle()
        if name not in all_here() and "=" in name and name.split("=")[0] in self.widgets():
            self.open_list(name.split("=")[0])
            self.settle()  # the list is laid out in its second frame
        if name not in all_here() and name in self.openers and not self.opens:
            self.opens = True
            self.do(self.openers[name])
            self.settle()
            self.opens = False
        return self.scroll_to(name)

    def use(self, name, w, places, text, how):
        a, b, c, d = places
        kind = w[0]
        inside = lambda x, y: self.hands.move(w[1] + x * (w[3] - w[1]), w[2] + y * (w[4] - w[2]))  # noqa: E731
        self.acted.add(name)
        if kind == "slider" and how == 0:
            self.hands.key("Control_L", True)
            self.click_on(w)
            self.hands.key("Control_L", False)
            self.enter(text)
        elif kind in ("slider", "drag") or (kind == "plot" and how < 3):
            inside(a, b)
            self.hands.button(1, True)
            for share in (0.5, 1):
                self.answer()
                inside(a + (c - a) * share, b + (d - b) * share)
            self.answer()
            self.hands.button(1, False)
        elif kind == "plot":
            self.click_on(w, a, b, 3 if how == 3 else 1, 2 if how == 4 else 1)
        elif kind in ("text", "number"):
            self.click_on(w, a * 0.5, 0.5)
            self.enter(text)
        else:
            self.click_on(w)
        if kind == "drag" and how < 2:
            self.click_on(w, a, 0.5, 1, 2)
            self.enter(text)
        if kind == "colour":  # a palette opens below it
            width, height = self.hands.size()
            for x, y in ((w[1] + 30 + a * 150, w[4] + 20 + b * 150), (width * 0.9, height * 0.9)):
                self.settle()
                self.hands.move(x, y)
                self.hands.click(1)
        self.settle()

    def enter(self, text):
        self.settle()
        self.hands.tap("a", ["Control_L"])
        self.hands.type(text)
        self.hands.tap("Return")

    # ---- events ----
    def act(self, event):
        """Does it. Returns it as it can be repeated: with the widget's name. Learns what opens which widget."""
        here = {n for n, w in self.widgets().items() if w[5]}
        opener, were = self.before
        if opener and opener[0] in ("widget", "choice", "key"):
            self.openers |= {n: opener for n in here - were if n not in self.openers}
        done = self.do(event)
        self.before = done, here
        return done

    def do(self, event):
        kind, *rest = event
        hands, (width, height) = self.hands, self.hands.size()
        at = lambda x, y: hands.move(x * width, y * height)  # noqa: E731
        if kind in ("widget", "choice"):
            return self.act_on_widget(event)
        if kind == "key":
            self.press(*rest)
        elif kind == "fly":  # flies and comes back: in flight the panel is out of reach
            self.press("f", [])
            for key in rest[0]:
                hands.key(key, True)
                at(*rest[1:])
                self.answer()
                hands.key(key, False)
            self.press("f", [])
            self.keys.update(rest[0])
        elif kind == "type":
            hands.type(rest[0])
        elif kind == "click":
            at(rest[1], rest[2])
            hands.click(rest[0], rest[3])
        elif kind == "drag":
            for m in rest[5]:
                hands.key(m, True)
            at(rest[1], rest[2])
            hands.button(rest[0], True)
            for share in (0.25, 0.5, 0.75, 1):
                at(rest[1] + (rest[3] - rest[1]) * share, rest[2] + (rest[4] - rest[2]) * share)
                self.answer()
            hands.button(rest[0], False)
            for m in rest[5]:
                hands.key(m, False)
        elif kind == "wheel":
            at(rest[2], rest[3])
            hands.click(*rest[:2])
        elif kind == "move":
            at(*rest)
        elif kind == "measure":
            at(*rest)
            self.press("x", [])
        elif kind == "ctl":
            self.ctl(rest)
        elif kind == "drop":
            hands.drop(self.options.drops[rest[0]], self.patience_s, self.alive)
        elif kind == "resize":
            hands.resize(*rest)
        elif kind == "focus":
            hands.focus(rest[0])
        elif kind == "close-dialog":
            name = next((n for n, w in self.widgets().items() if n.endswith("/close") and w[5]), None)
            if name:
                self.click_on(self.widgets()[name])
        elif kind == "close":
            hands.close()
        elif kind == "quit":
            hands.focus(True)
            for _ in range(2):  # a field's focus or a dialog, then flight
                self.settle()
                hands.tap("Escape")
            field = self.widgets().get("Open/path")  # an empty window has this field: it takes all letters
            for name in ["Control_L+q"] if field and field[5] else rest:
                self.settle()
                *modifiers, key = name.split("+")
                self.press(key, modifiers)
        return event

    def press(self, key, modifiers):
        self.keys["+".join([*modifiers, key])] += 1
        self.flying = self.flying != (key == "f" and not modifiers)
        self.hands.tap(key, modifiers)

    def act_on_widget(self, event):
        kind, name, places, text, how = event
        if not isinstance(name, str):
            name = self.name_of(kind, name)
        w = self.reach(name) if name else None
        if w:
            self.use(name, w, places, text, how)
        return [kind, name, places, text, how] if name else event

    def name_of(self, kind, number):
        """The widget that a number means: one that was ever here, three times of four one of those that were tried
        least; for a choice, one of a list, which is opened: one of earlier runs, too, or of a list that was never
        open."""
        every = self.widgets()
        if kind == "choice":
            lists = {n for n, w in every.items() if w[0] == "list"}
            choices = {n for n in (*every, *self.options.uses) if "=" in n and n.split("=")[0] in lists}
            name = self.one_of([*choices, *lists - {n.split("=")[0] for n in choices}], number)
            if name not in lists:
                return name
            self.open_list(name)
            return self.one_of([n for n, w in self.widgets().items() if w[5] and w[0] == "choice"], number)
        opened = {n for n, opener in self.openers.items() if opener[0] == "widget" and opener[1] in every}
        return self.one_of([n for n in {*every, *opened} if "=" not in n or n.startswith("Open/")], number)

    def one_of(self, names, number):
        if not names:
            return None
        if number % 4:
            tries = {n: self.tried[n] + min(ENOUGH, self.options.uses.get(known_as(n), 0)) for n in names}
            names = [n for n in names if tries[n] == min(tries.values())]
        name = events.chosen(names, number)
        self.tried[name] += 1
        return name

    def open_list(self, name):
        w = self.reach(name)
        if w:
            self.click_on(w)
            self.settle()

    def ctl(self, arguments):
        """Begins an order, which goes on beside the next events, until the next order."""
        self.told()
        out = tempfile.TemporaryFile("w+", errors="replace")
        command = [self.options.program("telesplat"), "ctl", *arguments]
        order = subprocess.Popen(command, env=self.environment, stdin=subprocess.DEVNULL, stdout=out,
                                 stderr=subprocess.STDOUT, cwd=os.path.join(self.folder, "work"))
        self.beside = arguments, order, out

    def told(self):
        """Waits for the order that goes on. What it printed, if it was obeyed."""
        if not self.beside:
            return ""
        (arguments, order, out), self.beside = self.beside, None
        code = order.wait(2 * self.patience_s)
        out.seek(0)
        text = out.read()
        self.orders[arguments[0], code == 0] += 1
        if code not in (0, 1, 2):
            raise Fault(f"ctl {' '.join(arguments)} ended with code {code}: {text.strip()[-300:]}")
        return text if code == 0 else ""
