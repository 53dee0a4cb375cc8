"""An X server without a screen, and a monkey's hands on the one window in it."""
import os
import select
import subprocess
import time

from Xlib import X, XK, display, error
from Xlib.ext import xtest
from Xlib.protocol import event

SCREEN = "1280x1024x24"


class Hands:
    """Starts an Xvfb. Positions are shares of the window's width and height, or its pixels."""

    def __init__(self, environment):
        ours, theirs = os.pipe()
        self.server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(theirs), "-screen", "0", SCREEN, "-nolisten", "tcp", "-noreset"],
            pass_fds=[theirs], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True, env=environment)
        os.close(theirs)
        number = b""
        while not number.endswith(b"\n"):
            if not select.select([ours], [], [], 30)[0]:
                break
            more = os.read(ours, 16)
            if not more:
                break
            number += more
        os.close(ours)
        if not number.strip():
            raise OSError("Xvfb did not start")
        self.name = ":" + number.decode().strip()
        self.x = display.Display(self.name)
        self.x.set_error_handler(lambda *_: None)  # windows come and go while the loop looks at them
        self.root = self.x.screen().root
        self.root.change_attributes(event_mask=X.SubstructureNotifyMask)
        self.window, self.pings, self.answered = None, 0, 0

    def end(self):
        try:
            self.x.close()
        except (error.ConnectionClosedError, OSError):
            pass
        self.server.terminate()
        self.server.wait()

    def find(self):
        """Whether the window is on display."""
        for w in self.root.query_tree().children:
            attributes = w.get_attributes()
            if attributes.map_state == X.IsViewable and not attributes.override_redirect and w.get_geometry().width > 1:
                self.window = w
                return True
        return False

    def size(self):
        geometry = self.window.get_geometry()
        return max(1, geometry.width), max(1, geometry.height)

    def title(self):
        told = self.window.get_full_property(self.x.intern_atom("_NET_WM_NAME"), X.AnyPropertyType)
        return bytes(told.value).decode(errors="replace") if told else ""

    def say(self, window, what, data):
        window.send_event(event.ClientMessage(window=window, client_type=self.x.intern_atom(what), data=(32, data)))

    def answers(self, patience_s, alive):
        """Whether the window handles its events; it is asked as window managers do. alive(): whether to wait on."""
        self.pings += 1
        self.say(self.window, "WM_PROTOCOLS", [self.x.intern_atom("_NET_WM_PING"), self.pings, self.window.id, 0, 0])
        self.x.flush()
        until_s = time.monotonic() + patience_s
        while self.answered < self.pings and time.monotonic() < until_s and alive():
            while self.x.pending_events():
                e = self.x.next_event()
                if e.type == X.ClientMessage and e.client_type == self.x.intern_atom("WM_PROTOCOLS"):
                    self.answered = max(self.answered, e.data[1][1])
            time.sleep(0.005)
        return self.answered >= self.pings

    def move(self, x, y):
        at = self.window.translate_coords(self.root, 0, 0)
        xtest.fake_input(self.x, X.MotionNotify, x=int(x) - at.x, y=int(y) - at.y)
        self.x.flush()

    def button(self, number, down):
        xtest.fake_input(self.x, X.ButtonPress if down else X.ButtonRelease, number)
        self.x.flush()

    def click(self, number, count=1):
        for _ in range(count):
            self.button(number, True)
            self.button(number, False)

    def key(self, keysym, down):
        code = self.x.keysym_to_keycode(XK.string_to_keysym(keysym))
        if code:
            xtest.fake_input(self.x, X.KeyPress if down else X.KeyRelease, code)
        self.x.flush()

    def tap(self, keysym, modifiers=()):
        for m in modifiers:
            self.key(m, True)
        self.key(keysym, True)
        self.key(keysym, False)
        for m in reversed(modifiers):
            self.key(m, False)

    def type(self, text):
        names = {" ": "space", "/": "slash", "-": "minus", ".": "period", ",": "comma", "+": "plus", "*": "asterisk",
                 "%": "percent", "=": "equal", ":": "colon", "#": "numbersign", "_": "underscore"}
        for c in text:
            name = names.get(c, c)
            code = self.x.keysym_to_keycode(XK.string_to_keysym(name))
            shifted = code and self.x.keycode_to_keysym(code, 0) != XK.string_to_keysym(name)
            self.tap(name, ["Shift_L"] if shifted else [])

    def resize(self, width, height):
        self.window.configure(width=width, height=height)
        self.x.flush()

    def focus(self, focused):
        self.x.set_input_focus(self.window if focused else X.PointerRoot, X.RevertToPointerRoot, X.CurrentTime)
        self.x.flush()

    def close(self):
        self.say(self.window, "WM_PROTOCOLS", [self.x.intern_atom("WM_DELETE_WINDOW"), 0, 0, 0, 0])
        self.x.flush()

    def drop(self, path, patience_s, alive):
        """Drops a file, as file managers do (XDND). False: the window did not ask for it."""
        atom = self.x.intern_atom
        source = self.root.create_window(0, 0, 1, 1, 0, X.CopyFromParent)
        source.set_selection_owner(atom("XdndSelection"), X.CurrentTime)
        self.say(self.window, "XdndEnter", [source.id, 5 << 24, atom("text/uri-list"), 0, 0])
        self.say(self.window, "XdndPosition", [source.id, 0, 100 << 16 | 100, 0, atom("XdndActionCopy")])
        self.say(self.window, "XdndDrop", [source.id, 0, 0, 0, 0])
        self.x.flush()
        until_s, asked = time.monotonic() + patience_s, False
        while not asked and time.monotonic() < until_s and alive():
            if not self.x.pending_events():
                time.sleep(0.005)
                continue
            e = self.x.next_event()
            if e.type != X.SelectionRequest:
                continue
            e.requestor.change_property(e.property, e.target, 8, b"file://" + os.fsencode(path) + b"\r\n")
            e.requestor.send_event(event.SelectionNotify(time=e.time, requestor=e.requestor, selection=e.selection,
                                                         target=e.target, property=e.property))
            asked = True
        source.destroy()
        self.x.flush()
        return asked

    def picture(self, path):
        """What the window shows, as a PPM file."""
        width, height = self.size()
        image = self.window.get_image(0, 0, width, height, X.ZPixmap, 0xffffffff)
        with open(path, "wb") as out:
            out.write(b"P6 %d %d 255\n" % (width, height))
            data = image.data
            out.write(bytes(b for i in range(0, len(data), 4) for b in (data[i + 2], data[i + 1], data[i])))
