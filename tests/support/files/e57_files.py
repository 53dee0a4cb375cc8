#!/usr/bin/env python3
"""Writes an E57 file of made-up points, the seed in tests/fuzz/corpus/e57.

npm's web-e57 1.2.0 reads the same places from it.

usage: e57_files.py DIR
"""

import math
import pathlib
import struct
import sys


def crc32c(data):
    value = 0xFFFFFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    return value ^ 0xFFFFFFFF


def paged(data):
    data += bytes(-len(data) % 1020)
    pages = (data[i : i + 1020] for i in range(0, len(data), 1020))
    return b"".join(page + struct.pack(">I", crc32c(page)) for page in pages)


def physical(at):
    return at // 1020 * 1024 + at % 1020


def bits(values, least, most):
    width = (most - least).bit_length()
    whole = sum(value - least << i * width for i, value in enumerate(values))
    return whole.to_bytes((width * len(values) + 7) // 8, "little")


def section(at, streams, cuts):
    """The section of points at this place: one packet up to each cut, a part of each stream's bytes."""
    packets, begin = b"", 0.0
    for cut in cuts:
        parts = [stream[int(begin * len(stream)) : int(cut * len(stream))] for stream in streams]
        body = struct.pack(f"<{len(parts) + 1}H", len(parts), *map(len, parts)) + b"".join(parts)
        body += bytes(-len(body) % 4)
        packets += struct.pack("<BBH", 1, 0, len(body) + 3) + body
        begin = cut
    packets += struct.pack("<BxHII4x", 0, 15, 0, 0)  # an index, which tells nothing
    return struct.pack("<B7xQQQ", 1, 32 + len(packets), physical(at + 32), 0) + packets


def e57():
    n, m = 120, 40
    first = [
        bits([1000 * (i % 12) - 4000 for i in range(n)], -5000, 100000),
        struct.pack(f"<{n}f", *(0.25 * (i // 12) for i in range(n))),
        struct.pack(f"<{n}d", *(2 + 0.01 * (i % 5) for i in range(n))),
        bits([i % 101 for i in range(n)], 0, 100),
        bits([2 * (i % 100) for i in range(n)], 0, 255),
        bits([255 - i for i in range(n)], 0, 255),
        bits([7] * n, 0, 255),
        bits([2 * (i == 50) for i in range(n)], 0, 2),
        b"",
        bits([3 * i - (1 << 40) for i in range(n)], -(1 << 62), 1 << 62),
    ]
    second = [
        struct.pack(f"<{m}f", *(8 + i % 3 for i in range(m))),
        bits([round(1e4 * (-1 + 0.05 * (i % 20))) for i in range(m)], -31416, 31416),
        struct.pack(f"<{m}d", *(0.1 * (i // 20) for i in range(m))),
    ]
    data = bytearray(48)
    places = []
    for streams, cuts in ((first, (0.37, 0.8, 1.0)), (second, (1.0,))):
        data += bytes(-len(data) % 4)
        places.append(physical(len(data)))
        data += section(len(data), streams, cuts)
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<e57Root type="Structure" xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0">
<formatName type="String"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>
<guid type="String"><![CDATA[made]]></guid>
<versionMajor type="Integer">1</versionMajor><versionMinor type="Integer">0</versionMinor>
<data3D type="Vector" allowHeterogeneousChildren="1">
<vectorChild type="Structure"><guid type="String"><![CDATA[one]]></guid>
<pose type="Structure">
<rotation type="Structure"><w type="Float">{math.sqrt(0.5)}</w><x type="Float"/><y type="Float"/>
<z type="Float">{math.sqrt(0.5)}</z></rotation>
<translation type="Structure"><x type="Float">100</x><y type="Float">200</y><z type="Float">1.5</z></translation></pose>
<points type="CompressedVector" fileOffset="{places[0]}" recordCount="{n}"><prototype type="Structure">
<cartesianX type="ScaledInteger" minimum="-5000" maximum="100000" scale="0.0005" offset="1"/>
<cartesianY type="Float" precision="single"/><cartesianZ type="Float"/>
<intensity type="Integer" minimum="0" maximum="100"/>
<colorRed type="Integer" minimum="0" maximum="255"/><colorGreen type="Integer" minimum="0" maximum="255"/>
<colorBlue type="Integer" minimum="0" maximum="255"/>
<cartesianInvalidState type="Integer" minimum="0" maximum="2"/>
<returnIndex type="Integer" minimum="3" maximum="3"/>
<timeStamp type="Integer" minimum="{-(1 << 62)}" maximum="{1 << 62}"/>
</prototype><codecs type="Vector" allowHeterogeneousChildren="1"/></points></vectorChild>
<vectorChild type="Structure"><guid type="String"><![CDATA[two]]></guid>
<points type="CompressedVector" fileOffset="{places[1]}" recordCount="{m}"><prototype type="Structure">
<sphericalRange type="Float" precision="single"/>
<sphericalAzimuth type="ScaledInteger" minimum="-31416" maximum="31416" scale="0.0001"/>
<sphericalElevation type="Float"/>
</prototype><codecs type="Vector" allowHeterogeneousChildren="1"/></points></vectorChild>
</data3D><images2D type="Vector" allowHeterogeneousChildren="1"/></e57Root>
""".encode()
    data += bytes(-len(data) % 4)
    at = len(data)
    data += text
    whole = (len(data) + 1019) // 1020 * 1024
    struct.pack_into("<8sIIQQQQ", data, 0, b"ASTM-E57", 1, 0, whole, physical(at), len(text), 1024)
    return paged(bytes(data))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    (pathlib.Path(sys.argv[1]) / "two-scans.e57").write_bytes(e57())
