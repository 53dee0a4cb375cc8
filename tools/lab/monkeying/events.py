"""What a monkey does next: drawn from its seed and the number of the event alone, never from what happened."""
import hashlib
import random

BUTTONS = (1, 1, 1, 1, 2, 3)
MODIFIERS = ((), (), (), (), ("Shift_L",), ("Control_L",), ("Alt_L",), ("Control_L", "Shift_L"))
OTHER_KEYS = (
    list("abcdefghijklmnoprstuvwxyz0123456789")
    + [f"F{i}" for i in range(2, 11)]
    + "Up Down Left Right Home End Prior Next Insert Delete BackSpace Return space minus equal comma period".split()
    + "slash bracketleft KP_Add KP_Subtract KP_Enter Menu Caps_Lock".split()
)
TEXTS = ["", "julia", "/", "/tmp", "is not there.ply", "50%", "nan", "inf", "1/0", "...", "+3", "*2"] + (
    "0 1 -1 5 127.5 -1000 3000 1e9 -1e9 1e30 1e308 9e999 99999999999999999999 0.0000001 2147483647 -2147483648"
).split()
NAMES = ["", "nothing", "c.x", "c.y", "c.w", "slice.offset", "iterations", "palette", "colour.scale", "shadow"] + [
    "volume." + name for name in ("step", "steps-per-s", "range.lo", "size.x")
]
PRESETS = ("plain", "bone", "skin", "ct-angio", "mr", "fire", "grey")
MAPS = ("viridis", "plasma", "turbo", "cool-warm_r", "rainbow", "nothing")


def number(chance):
    wrong = ["nan", "inf", "-1e30", "1e30", "1e31", "1e999", "", "x", "-0"]
    low, high, digits = chance.choice([(-1100, 3200, 1), (0, 255, 0), (-1, 1, 3)])
    plain, share = f"{chance.uniform(low, high):.{digits}f}", f"{chance.uniform(-20, 120):.0f}%"
    return chance.choice([plain, share, chance.choice(wrong)])


def function(chance):
    """A transfer function: most are valid, some are wrong in one of many ways."""
    points = chance.choice([1, 2, 2, 3, 4, 5, 8, 30])
    low, high = chance.choice([(0, 255), (-1000, 3000), (0, 1), (-1e30, 1e30), (1000, 1100), (0, 100), (7, 7)])
    values = sorted(chance.uniform(low, high) for _ in range(points))
    unit = "%" if (low, high) == (0, 100) else ""
    if chance.random() < 0.15:
        chance.shuffle(values)
    out = [f"{v:.6g}{unit}:#{chance.randrange(1 << 24):06x}:{chance.random():.3f}" for v in values]
    if chance.random() < 0.25:
        odd = [f"{number(chance)}:#ffffff:0.5", "1:red:1", "1:#fff:1", "1:#ffffff:2", "1:1/0/2:1", "::", ""]
        out[chance.randrange(points)] = chance.choice(odd)
    return ",".join(out)


def order(chance):
    """Arguments of `telesplat ctl`; stop is the last event's."""
    pick, some = chance.choice, number(chance)
    share = f"{chance.uniform(-10, 110):.0f}%"
    plane = f"plane {pick('xyzw')}{pick(['>=', '<=', '='])}{some}"
    arrays = ["temperature", "wind", "wind.x", "none", "nothing", "temperature:0:0", f"temperature:{some}:40"]
    clips = ["off", plane, f"{plane}; {plane}", f"plane 1,0,0,{some}", "plane 0,0,0,0"]
    clips += ["box 0,0,0,1,1,1", "box 1,1,1,0,0,0", "nothing"]
    timelines = ["on", "off", "c.x=-0.5:0.5:2", "c.w=@0s:-0.2@2s:0.1", "nothing", f"c.y={some}:1:3"]
    orders = {
        "tf": [*[f"-- {function(chance)}"] * 3, pick(PRESETS), "is not there.json", "nothing", ""],
        "colour": [pick(arrays), f"map {pick(MAPS)}", f"{pick(arrays)} map {pick(MAPS)}"],
        "coupling": ["async", "sync", "loose", f"loose --buffers {pick('01389')}", "nothing"],
        "set": [f"{pick(NAMES)}={some}"],
        "play": ["play", "pause", "step 1", "step -1", "step 100000", "step x"],
        "overlay": [f"{pick(['axes', 'scale', 'cursor', 'fps', 'all', 'nothing'])} {pick(['on', 'off', 'x'])}"],
        "pick": [f"{share},50%", f"{share},50% 40%,40%", f"{share},50% 40%,40% 60%,60%", "x"],
        "measure": ["list", f"add {share},50%", f"add {share},50% 40%,40%", "remove 1", "clear", ""],
        "bookmark": ["list", "add a", "go a", "go nothing", "remove a", ""],
        "notes": ["list", "add a --at 50%,50%", "add b", "remove 1", "remove 90", ""],
        "splat": ["square", "disc", "ellipse", "ewa", "nothing"],
        "finish": ["on", "off", "fill,smooth", "nothing"],
        "shading": ["lit", "head", "unlit", "nothing"],
        "background": ["white", "#203040", "transparent", "nothing"],
        "sampling-size": ["auto", "640x400", "16x16", "9x", "0x0"],
        "stereo": ["off", "off", "side-by-side", "anaglyph-dubois", "rows", "autostereo", "quad-buffer", "nothing"],
        "samplers": ["1", "2", "3", "0", "65", "x"],
        "up": ["x", "-y", "z", "w"],
        "iso": [some, "100", "x"],
        "room-size": ["1", "0.5", "0", "x"],
        "open": ["julia", "is not there.ply"],
        "epoch": [""],
        "status": ["", "--json"],
        "list": [""],
    }
    orders |= {name: ["on", "off", "x"] for name in ("lighting", "panel", "fullscreen", "legend", "swap-eyes")}
    numbers = ("z-scale", "detail", "least-sampling", "eye-separation", "screen-distance")
    orders |= {name: [some, "0.5", "1"] for name in numbers}
    whole = {"clip": clips, "animate": timelines}  # one argument with blanks
    name = pick(["tf", "tf", *orders, *whole])
    return [name, pick(whole[name])] if name in whole else [name, *pick(orders[name]).split()]


def any_order(chance, orders):
    """Of the orders that `ctl --help` has; those that order() does not know get arguments of all sorts."""
    known = order(chance)
    other = chance.choice(sorted(orders))
    if chance.random() < 0.8 or other == "stop":
        return known
    words = ["on", "off", "0", "1", "-1", "0.5", "nothing", "list", "add", "a", "reset", "50%", number(chance)]
    return [other, *chance.choices(words, k=chance.randrange(3))]


def follows(chance, keys, orders, drops):
    """An event as a list: its kind, then what it needs. keys: those with a meaning that do not quit, as Control_L+z."""
    share = lambda: round(chance.uniform(-0.02, 1.02), 3)  # noqa: E731
    kinds = ["widget"] * 50 + ["choice", "key"] * 12 + ["ctl"] * 12 + ["drag"] * 8 + ["click"] * 6 + ["wheel"] * 5
    kinds += ["move", "other-key"] * 4 + ["type", "resize"] * 3 + ["drop", "focus", "close-dialog"] * 2
    kinds += ["fly", "measure"]
    kind = chance.choice(kinds)
    if kind in ("widget", "choice"):
        places = [round(chance.random(), 3) for _ in range(4)]
        return [kind, chance.getrandbits(32), places, chance.choice(TEXTS), chance.randrange(6)]
    if kind == "key":
        *modifiers, key = chance.choice(sorted(keys)).split("+")
        return ["key", key, modifiers if chance.random() < 0.7 else list(chance.choice(MODIFIERS))]
    if kind == "other-key":
        return ["key", chance.choice(OTHER_KEYS), list(chance.choice(MODIFIERS))]
    if kind == "fly":
        return ["fly", chance.choices("wasde", k=3), share(), share()]
    if kind == "type":
        return ["type", chance.choice(TEXTS)]
    if kind == "click":
        return ["click", chance.choice(BUTTONS), share(), share(), chance.choice([1, 1, 2, 3])]
    if kind == "drag":
        return ["drag", chance.choice(BUTTONS), share(), share(), share(), share(), list(chance.choice(MODIFIERS))]
    if kind == "wheel":
        return ["wheel", chance.choice([4, 5]), chance.randrange(1, 12), share(), share()]
    if kind == "move":
        return ["move", share(), share()]
    if kind == "measure":  # most likely what the middle shows
        return ["measure", round(chance.uniform(0.3, 0.7), 3), round(chance.uniform(0.3, 0.7), 3)]
    if kind == "ctl":
        return ["ctl", *any_order(chance, orders)]
    if kind == "drop":
        return ["drop", chance.choice(sorted(drops))]
    if kind == "resize":
        sizes = [(1, 1), (60, 40), (300, 200), (200, 900), (1200, 160)]
        return ["resize", *chance.choice(sizes + [(1000, 760)] + [(640, 560)] * 5)]
    if kind == "focus":
        return ["focus", chance.random() < 0.5]
    return [kind]


def last(chance, quits):
    return chance.choice([["close"], ["ctl", "stop"], *(["quit", *keys] for keys in quits)])


def is_last(event):
    return event[0] in ("close", "quit") or event == ["ctl", "stop"]


def event(seed, index, keys, orders, drops):
    """The event of that number, and how long the monkey waits after it, seconds."""
    chance = random.Random(f"{seed}/{index}")
    if index == 2:  # for volumes: begins far below the data and ends within them, as presets of a CT do
        return ["ctl", "tf", "--", "-3000:#000000:0, 100:#a07040:0.05, 200:#40a040:0.4"], 1
    return follows(chance, keys, orders, drops), chance.choice([0, 0, 0.02, 0.05, 0.1, 0.2])


def chosen(names, number):
    """One of the names: the same whichever others there are, as far as it is there."""
    return max(names, key=lambda name: hashlib.md5(f"{number}/{name}".encode()).digest())
