#!/usr/bin/env python3
"""Writes LAZ files of made-up points, the seeds in tests/fuzz/corpus/las; prints a hash (FNV-1a) of the points of each.

npm's laz-perf 0.0.7 reads the same points from all but the one of version 4, which it takes for version 3.

usage: laz_files.py DIR
"""

import pathlib
import struct
import sys

COUNT, CHUNK = 150, 100
M32 = (1 << 32) - 1
RETURNS8 = ["fedcba98", "e0136aa9", "d1247bba", "c3458ccb", "b6789ddc", "aabcdeed", "9abcdefe", "89abcdef"]
RETURNS16 = (
    "0123453445555555 1013333333333333 2124444444433333 3345444444444444 4344544444444444 5344454444444444 "
    "3344445444444444 4344444544444444 4344444454444444 5344444445444444 5344444444544444 5334444444455444 "
    "5334444444455544 5334444444445554 5334444444444555 5334444444444455"
).split()


class Model:
    def __init__(self, symbols=256):
        self.counts, self.total, self.cycle = [1] * symbols, 0, symbols
        self.update()
        self.left = self.cycle = (symbols + 6) // 2

    def update(self):
        self.total += self.cycle
        if self.total > 1 << 15:
            self.counts = [(c + 1) // 2 for c in self.counts]
            self.total = sum(self.counts)
        scale, below, self.begins = (1 << 31) // self.total, 0, []
        for count in self.counts:
            self.begins.append(scale * below >> 16)
            below += count
        self.left = self.cycle = min(5 * self.cycle // 4, (len(self.counts) + 6) * 8)


class Bit:
    def __init__(self):
        self.zero, self.zeros, self.total, self.cycle, self.left = 1 << 12, 1, 2, 4, 4

    def update(self):
        self.total += self.cycle
        if self.total > 1 << 13:
            self.total, self.zeros = (self.total + 1) // 2, (self.zeros + 1) // 2
            self.total += self.zeros == self.total
        self.zero = self.zeros * ((1 << 31) // self.total) >> 18
        self.left = self.cycle = min(5 * self.cycle // 4, 64)


class Encoder:
    def __init__(self):
        self.out, self.base, self.length, self.used = bytearray(), 0, M32, False

    def narrow(self, begin, length):
        self.base += begin
        if self.base > M32:
            self.base &= M32
            at = len(self.out) - 1
            while self.out[at] == 255:
                self.out[at] = 0
                at -= 1
            self.out[at] += 1
        self.length = length
        while self.length < 1 << 24:
            self.out.append(self.base >> 24)
            self.base, self.length = self.base << 8 & M32, self.length << 8

    def symbol(self, model, symbol):
        part = self.length >> 15
        begin, last = model.begins[symbol] * part, symbol + 1 == len(model.counts)
        self.narrow(begin, (self.length if last else model.begins[symbol + 1] * part) - begin)
        model.counts[symbol] += 1
        model.left -= 1
        if model.left == 0:
            model.update()

    def bit(self, model, bit):
        part = model.zero * (self.length >> 13)
        model.zeros += not bit
        self.narrow(*(part, self.length - part) if bit else (0, part))
        model.left -= 1
        if model.left == 0:
            model.update()

    def bits(self, count, value):
        if count > 19:
            self.bits(16, value & 65535)
            count, value = count - 16, value >> 16
        part = self.length >> count
        self.narrow(value * part, part)

    def end(self):
        if self.length > 1 << 25:
            self.narrow(1 << 24, 1 << 23)
            return bytes(self.out) + b"\0\0\0"
        self.narrow(1 << 23, 1 << 15)
        return bytes(self.out) + b"\0\0"


class Numbers:
    def __init__(self, bits=32, contexts=1):
        self.size, self.k, self.sign = 1 << bits, 0, Bit()
        self.lengths = [Model(bits + 1) for _ in range(contexts)]
        self.differences = [None] + [Model(1 << min(n, 8)) for n in range(1, bits + 1)]

    def put(self, encoder, predicted, value, context=0):
        c = (value - predicted + self.size // 2) % self.size - self.size // 2
        k = self.k = (-c if c <= 0 else c - 1).bit_length()
        encoder.symbol(self.lengths[context], k)
        if k == 0:
            return encoder.bit(self.sign, c)
        if k == 32:
            return
        c += (1 << k) - 1 if c < 0 else -1
        low = max(k - 8, 0)
        encoder.symbol(self.differences[k], c >> low)
        if low:
            encoder.bits(low, c & (1 << low) - 1)


class Median:
    def __init__(self):
        self.five, self.drop_largest = [0] * 5, True

    def add(self, value):
        middle = self.five[2]
        self.five.pop(4 if self.drop_largest else 0)
        self.drop_largest = value < middle if self.drop_largest else value <= middle
        self.five = sorted(self.five + [value])


class Places:
    def __init__(self, height=0):
        self.steps = [[Median() for _ in range(2)] for _ in range(16)]
        self.heights, self.numbers = [height] * 8, [Numbers(32, 2), Numbers(32, 22), Numbers(32, 20)]

    def put(self, plan, heights, last, point, context, level, single):
        dx, dy, dz = self.numbers
        for axis, numbers in ((0, dx), (1, dy)):
            step, median = point[axis] - last[axis], self.steps[context][axis]
            numbers.put(plan, median.five[2], step, single | (min(dx.k, 20) & ~1 if axis else 0))
            median.add(step)
        dz.put(heights, self.heights[level], point[2], single | min((dx.k + dy.k) // 2, 18) & ~1)
        self.heights[level] = point[2]


class Times:
    def __init__(self, first, layered):
        self.layered, self.now, self.newest, self.numbers = layered, 0, 0, Numbers(32, 9)
        self.of = [[first, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]  # time, step, extremes
        self.no_step, self.steps = Model(5 if layered else 6), Model(515 if layered else 516)

    def put(self, encoder, time):
        def small(sequence):
            return -(1 << 31) <= time - sequence[0] < 1 << 31

        own = self.of[self.now]
        model, step = (self.steps, own[1]) if own[1] else (self.no_step, 0)
        more = [i for i in range(1, 4) if small(self.of[(self.now + i) % 4])]
        if time == own[0]:
            return encoder.symbol(model, 511 if step else 0)
        if not small(own):
            kind = (512 if step else 2) + (more[0] if more else 0)
            encoder.symbol(model, kind - self.layered)
            if more:
                self.now = (self.now + more[0]) % 4
                return self.put(encoder, time)
            self.numbers.put(encoder, own[0] >> 32, time >> 32, 8)
            encoder.bits(32, time & M32)
            self.now = self.newest = (self.newest + 1) % 4
            self.of[self.now] = [time, 0, 0]
            return
        difference, own[0] = time - own[0], time
        if not step:
            encoder.symbol(model, 1 - self.layered)
            self.numbers.put(encoder, 0, difference, 0)
            own[1:] = difference, 0
            return
        times = max(-10, min(500, int(difference / step + (0.5 if difference / step > 0 else -0.5))))
        encoder.symbol(model, times if times >= 0 else 500 - times)
        context = {0: 7, 1: 1, 500: 4, -10: 6}.get(times, 5 if times < 0 else 2 if times < 10 else 3)
        self.numbers.put(encoder, times * step, difference, context)
        if times == 1:
            own[2] = 0
        if context in (4, 6, 7):
            own[2] += 1
            if own[2] > 3:
                own[1:] = difference, 0


class Colours:
    def __init__(self):
        self.changed, self.bytes = Model(128), [Model() for _ in range(6)]

    def put(self, encoder, last, rgb):
        old, new = ([c >> 8 * b & 255 for c in of for b in (0, 1)] for of in (last, rgb))
        changed = sum((old[n] != new[n]) << n for n in range(6)) | (len(set(rgb)) > 1) << 6
        encoder.symbol(self.changed, changed)

        def put(n, step):
            if changed >> n & 1:
                encoder.symbol(self.bytes[n], new[n] - max(0, min(255, old[n] + step)) & 255)

        put(0, 0), put(1, 0)
        for b in (0, 1) if changed & 64 else ():
            red, green = new[b] - old[b], new[2 + b] - old[2 + b]
            put(2 + b, red), put(4 + b, int((red + green) / 2))


class Together:
    """A chunk of formats 0 to 3."""

    def __init__(self, form, first, extra):
        self.form, self.out, self.e, self.last = form, first, Encoder(), first
        self.changed, self.angles, self.intensities = Model(64), [Model(), Model()], [0] * 16
        self.bytes, self.extra = {}, [Model() for _ in range(extra)]
        self.intensity, self.source, self.places = Numbers(16, 4), Numbers(16), Places()
        self.times = Times(struct.unpack_from("<Q", first, 20)[0], False) if form in (1, 3) else None
        self.colours = Colours()

    def put(self, p):
        e, q, self.last = self.e, self.last, p
        r, n = p[14] & 7, p[14] >> 3 & 7
        m = int(RETURNS8[n][r], 16)
        (was,), (now,) = (struct.unpack_from("<H", of, 18) for of in (q, p))
        (intensity,) = struct.unpack_from("<H", p, 12)
        differ = [now != was, p[17] != q[17], p[16] != q[16], p[15] != q[15], intensity != self.intensities[m],
                  p[14] != q[14]]
        e.symbol(self.changed, sum(d << i for i, d in enumerate(differ)))

        def byte(at):
            e.symbol(self.bytes.setdefault((at, q[at]), Model()), p[at])

        if differ[5]:
            byte(14)
        if differ[4]:
            self.intensity.put(e, self.intensities[m], intensity, min(m, 3))
            self.intensities[m] = intensity
        if differ[3]:
            byte(15)
        if differ[2]:
            e.symbol(self.angles[p[14] >> 6 & 1], p[16] - q[16] & 255)
        if differ[1]:
            byte(17)
        if differ[0]:
            self.source.put(e, was, now)
        self.places.put(e, e, *(struct.unpack_from("<iii", of) for of in (q, p)), m, abs(n - r), n == 1)
        at = 20
        if self.times:
            self.times.put(e, struct.unpack_from("<Q", p, at)[0])
            at += 8
        if self.form > 1:
            self.colours.put(e, *(struct.unpack_from("<HHH", of, at) for of in (q, p)))
        for i, model in enumerate(self.extra, len(p) - len(self.extra)):
            e.symbol(model, p[i] - q[i] & 255)

    def end(self):
        return self.out + self.e.end()


def fields14(p):
    """x y z, intensity, return, returns, flags, channel, class, user, angle, source, time."""
    x, y, z, intensity, returns, flags, classes, user, angle, source, time = struct.unpack_from("<iiiHBBBBhHQ", p)
    six = flags & 15 | flags >> 2 & 48
    return (x, y, z), intensity, returns & 15, returns >> 4, six, flags >> 4 & 3, classes, user, angle, source, time


class Channel:
    def __init__(self, last):
        (_, _, height), intensity, *_, time = last
        self.last, self.time_changed, self.models = last, 0, {}
        self.intensities, self.places, self.times = [intensity] * 8, Places(height), Times(time, True)
        self.intensity, self.angle, self.source = Numbers(16, 4), Numbers(16, 2), Numbers(16)

    def symbol(self, encoder, symbols, symbol, *key):
        encoder.symbol(self.models.setdefault(key, Model(symbols)), symbol)


class Layers:
    """A chunk of formats 6 to 8."""

    def __init__(self, form, first, extra, version):
        self.form, self.first, self.extra, self.version, self.count = form, first, extra, version, 1
        self.e = [Encoder() for _ in range(9 + (form > 6) + (form > 7) + extra)]
        self.e[0].used = self.e[1].used = True
        self.now = self.beside_now = first[15] >> 4 & 3
        self.channels = {self.now: Channel(fields14(first))}
        self.beside = {self.now: (bytearray(first[30:]), Colours(), {})}

    def put(self, p):
        self.count += 1
        point = place, intensity, r, n, flags, channel, classes, user, angle, source, time = fields14(p)
        old = self.channels[self.now]
        new = self.channels.get(channel) or Channel(old.last)
        was, _, r_was, n_was, flags_was, _, classes_was, user_was, angle_was, source_was, time_was = new.last
        plan, height, e_class, e_flags, e_intensity, e_angle, e_user, e_source, e_time = self.e[:9]
        timed = int(time != time_was)
        step = (r - r_was) % 16
        kind = {0: 0, 1: 1, 15: 2}.get(step, 3)
        changed = (kind | (n != n_was) << 2 | (angle != angle_was) << 3 | timed << 4 | (source != source_was) << 5
                   | (channel != self.now) << 6)
        context = (old.last[2] == 1) | (old.last[2] >= old.last[3]) << 1 | old.time_changed << 2
        old.symbol(plan, 128, changed, "changed", context)
        if channel != self.now:
            old.symbol(plan, 3, (channel - self.now - 1) % 4, "channel")
        if n != n_was:
            new.symbol(plan, 16, n, "n", n_was)
        if kind == 3:
            new.symbol(plan, *((16, r, "r", r_was) if timed else (13, step - 2, "step")))
        new.places.put(plan, height, was, place, int(RETURNS16[n][r]) << 1 | timed, min(abs(n - r), 7), n == 1)
        first, end = r == 1, r >= n
        new.symbol(e_class, 256, classes, "class", (classes_was & 31) << 1 | (first and end))
        e_class.used |= classes != classes_was
        new.symbol(e_flags, 64, flags, "flags", flags_was)
        e_flags.used |= flags != flags_was
        at = (first | end << 1) << 1 | timed
        new.intensity.put(e_intensity, new.intensities[at], intensity, at >> 1)
        e_intensity.used |= intensity != new.last[1]
        new.intensities[at] = intensity
        if angle != angle_was:
            new.angle.put(e_angle, angle_was, angle, timed)
            e_angle.used = True
        new.symbol(e_user, 256, user, "user", user_was // 4)
        e_user.used |= user != user_was
        if source != source_was:
            new.source.put(e_source, source_was, source)
            e_source.used = True
        if timed:
            new.times.put(e_time, time)
            e_time.used = True
        self.put_beside(p[30:], channel if self.version == 4 or channel != self.now else 0)
        new.last, new.time_changed = point, timed
        self.channels[channel], self.now = new, channel

    def put_beside(self, p, channel):
        values = self.beside[self.beside_now][0]
        if channel not in self.beside:
            self.beside[channel] = (bytearray(values), Colours(), {})
            values = self.beside[channel][0]
        elif self.version == 4:
            values = self.beside[channel][0]
        self.beside_now = channel
        _, colours, models = self.beside[channel]
        at, layers = 0, self.e[9:]
        if self.form > 6:
            e, at = layers.pop(0), 6
            colours.put(e, *(struct.unpack_from("<HHH", of) for of in (values, p)))
            e.used |= values[:6] != p[:6]
        if self.form > 7:
            e, at = layers.pop(0), 8
            low, high = (values[i] != p[i] for i in (6, 7))
            e.symbol(models.setdefault("infrared", Model(4)), low | high << 1)
            for i, changed in ((6, low), (7, high)):
                if changed:
                    e.symbol(models.setdefault(i, Model()), p[i] - values[i] & 255)
                    e.used = True
        for i, e in enumerate(layers, at):
            e.symbol(models.setdefault(i, Model()), p[i] - values[i] & 255)
            e.used |= p[i] != values[i]
        values[:] = p

    def end(self):
        layers = [e.end() if e.used else b"" for e in self.e]
        return self.first + struct.pack(f"<{1 + len(layers)}I", self.count, *map(len, layers)) + b"".join(layers)


def noise(i, k):
    return ((i * 7919 + k * 104729 + 12345) * 2654435761 & M32) >> 16


def times():
    bases = [4607182418800017408 + (k << 40) for k in (0, 3, 1, 7, 5, 2)]
    steps = [0, 64, 64, 65, 130, 0, 64 * 30, 64 * 600, 64 * 700, 64 * 650, 64 * 600, -64 * 3, -64 * 40, -64 * 50,
             -64 * 60, -64 * 40, 3, 2, 1, 4, 700, 700]
    sums, time = [0] * 6, []
    for i in range(COUNT):
        base = 0 if i < 60 else (i // 9) % 6
        sums[base] += steps[i % len(steps)]
        time.append(bases[base] + sums[base])
    return time


def record(form, i, time):
    """Point i of a file."""
    layered = form >= 6
    x = 1000 * i + noise(i, 0) % 50 + (3 << 20) * (i % 11 == 5)
    y = 5000 - 300 * (i % 20) + noise(i, 1) % 30 - (1 << 30) * (i % 37 == 9)
    z = noise(i, 2) % 200 + 70000 * (i % 13 == 4)
    n = 1 + noise(i, 4) % (15 if layered and i % 3 else 5)
    r = 1 + i % n if i % 17 else 0
    intensity, source = noise(i // 2, 3) % 900 * (1 + 60 * (i % 19 == 3)), 7 + i // 40 * 300
    classes, user, angle = noise(i // 5, 6) % 20, 0 if form == 6 else i // 30, noise(i // 4, 7) % 60
    if layered:
        channel = (i // 5 * 3 + 2) % 4 if form != 6 else 1
        flags = i // 25 % 16 | channel << 4 | (i // 7 % 4) << 6
        angle = 400 - 13 * angle
        out = struct.pack("<iiiHBBBBhHQ", x, y, z, intensity, r | n << 4, flags, classes, user, angle, source, time)
    else:
        out = struct.pack("<iiiHBBbBH", x, y, z, intensity, r | n << 3 | (i // 7 % 4) << 6, classes, angle - 30, user,
                          source)
        out += struct.pack("<Q", time) if form in (1, 3) else b""
    if form in (2, 3, 7, 8):
        c = [noise(i // 3, 8 + k) >> (0 if i % 4 else 8) for k in range(3)]
        out += struct.pack("<HHH", *(c if i % 5 else c[:1] * 3))
    if form == 8:
        out += struct.pack("<H", noise(i // 2, 11))
    return out + bytes([i & 255, noise(i, 12) & 3, 9])


def laz(form, version, variable):
    """LAS 1.2 or 1.4, compressed, with three extra bytes."""
    layered, extra, time = form >= 6, 3, times()
    points = [record(form, i, time[i]) for i in range(COUNT)]
    items = [(10, 30)] if layered else [(6, 20)]
    items += [(7, 8)] * (form in (1, 3)) + [(8, 6)] * (form in (2, 3)) + [(11, 6)] * (form == 7)
    items += [(12, 8)] * (form == 8) + [(14 if layered else 0, extra)]
    chunk_size = M32 if variable else CHUNK
    about = struct.pack("<HHBBHIIqqH", 2 + layered, 0, 3, 4, 3, 0, chunk_size, -1, -1, len(items))
    about += b"".join(struct.pack("<HHH", *item, version) for item in items)
    chunks, at = [], 0
    for size in (60, 89, 1) if variable else (CHUNK, CHUNK):
        part = points[at : at + size]
        chunk = Layers(form, part[0], extra, version) if layered else Together(form, part[0], extra)
        for point in part[1:]:
            chunk.put(point)
        chunks.append((len(part), chunk.end()))
        at += size
    head = 375 if layered else 227
    begin = head + 54 + len(about)
    table, numbers, last = Encoder(), Numbers(32, 2), (0, 0)
    for count, body in chunks:
        if variable:
            numbers.put(table, last[0], count, 0)
        numbers.put(table, last[1], len(body), 1)
        last = count, len(body)
    body = b"".join(body for _, body in chunks)
    header = bytearray(head)
    struct.pack_into("<4s20xBB", header, 0, b"LASF", 1, 4 if layered else 2)
    struct.pack_into("<HIIBHI", header, 94, head, begin, 1, form | 128, len(points[0]), 0 if layered else COUNT)
    struct.pack_into("<3d", header, 131, 0.01, 0.01, 0.01)
    if layered:
        struct.pack_into("<Q", header, 247, COUNT)
    about = struct.pack("<2x16sHH32x", b"laszip encoded", 22204, len(about)) + about
    return (bytes(header) + about + struct.pack("<q", begin + 8 + len(body)) + body
            + struct.pack("<II", 0, len(chunks)) + table.end())


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for name, form, version, variable in (
        ("0", 0, 2, False), ("1", 1, 2, True), ("2", 2, 2, False), ("3", 3, 2, False),
        ("6", 6, 3, True), ("7", 7, 3, False), ("8", 8, 3, False), ("7-version-4", 7, 4, True),
    ):
        (pathlib.Path(sys.argv[1]) / f"format-{name}.laz").write_bytes(laz(form, version, variable))
        digest, time = 0xCBF29CE484222325, times()
        for byte in b"".join(record(form, i, time[i]) for i in range(COUNT)):
            digest = (digest ^ byte) * 0x100000001B3 & (1 << 64) - 1
        print(f"format-{name}.laz {digest:#x}")
