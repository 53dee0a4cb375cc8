"""What soak shows: a mesh with thin parts, a Julia set, a volume; and what people change of each meanwhile."""
import math
import os
import struct
import subprocess


class Scene:
    """trajectory: of the display that is watched; a file begins again at its end."""

    def __init__(self, name, arguments, change, points, trajectory="orbit"):
        self.name, self.arguments, self.change, self.points = name, arguments, change, points
        self.trajectory = trajectory


def clip(chance):
    axis, at = chance.choice("xyz"), chance.randrange(10, 60)
    return ("clip", chance.choice((f"plane {axis}>={at}%", f"plane {axis}<={at + 35}%", "off", "off")))


def write_fence(path, side=140, poles=240, seed=5):
    """A bumpy ground on which thin poles stand, with wires between them, as binary PLY with an array "height"."""
    points, faces = [], []
    height = lambda x, y: 0.05 * math.sin(9 * x) * math.cos(7 * y) + 0.012 * math.sin(31 * x + 17 * y)
    for j in range(side):
        for i in range(side):
            x, y = i / (side - 1), j / (side - 1)
            points.append((x, y, height(x, y)))
    for j in range(side - 1):
        for i in range(side - 1):
            a = j * side + i
            faces += [(a, a + 1, a + side + 1), (a, a + side + 1, a + side)]

    def rod(p, q, radius, sides=5):
        along = [b - a for a, b in zip(p, q)]
        length = math.sqrt(sum(v * v for v in along)) or 1
        along = [v / length for v in along]
        across = (0, 0, 1) if abs(along[2]) < 0.9 else (1, 0, 0)
        u = (along[1] * across[2] - along[2] * across[1], along[2] * across[0] - along[0] * across[2],
             along[0] * across[1] - along[1] * across[0])
        norm = math.sqrt(sum(v * v for v in u))
        u = [v / norm for v in u]
        v = (along[1] * u[2] - along[2] * u[1], along[2] * u[0] - along[0] * u[2], along[0] * u[1] - along[1] * u[0])
        first = len(points)
        for end in (p, q):
            for k in range(sides):
                c, s = radius * math.cos(2 * math.pi * k / sides), radius * math.sin(2 * math.pi * k / sides)
                points.append(tuple(end[n] + c * u[n] + s * v[n] for n in range(3)))
        for k in range(sides):
            a, b = first + k, first + (k + 1) % sides
            faces.extend([(a, b, b + sides), (a, b + sides, a + sides)])

    columns = max(2, int(math.sqrt(poles)))
    tops = {}
    for j in range(columns):
        for i in range(columns):
            x, y = (i + 0.5) / columns, (j + 0.5) / columns
            ground = height(x, y)
            tops[i, j] = (x, y, ground + 0.08)
            rod((x, y, ground - 0.01), tops[i, j], 0.0012)
    for (i, j), top in tops.items():
        if (i + 1, j) in tops:
            rod(top, tops[i + 1, j], 0.0004, 3)
    with open(path, "wb") as out:
        out.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\n"
                   "property float y\nproperty float z\nproperty float height\n"
                   f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n").encode())
        for x, y, z in points:
            out.write(struct.pack("<ffff", x, y, z, z))
        for face in faces:
            out.write(struct.pack("<Biii", 3, *face))


def write_circles_and_rests(path, circle_s=12, rest_s=4):
    """A head that goes once around the room's centre, looking at it, and then rests."""
    with open(path, "w") as out:
        out.write("t_s,px,py,pz,qw,qx,qy,qz\n")
        steps = 10 * circle_s
        for i in [*range(steps + 1), steps + 10 * rest_s]:
            turn = 2 * math.pi * min(i, steps) / steps
            out.write(f"{i / 10:.3f},{0.7 * math.sin(turn):.6f},0.25,{0.7 * math.cos(turn):.6f},"
                      f"{math.cos(turn / 2):.6f},0,{math.sin(turn / 2):.6f},0\n")


def mesh(options):
    path, heads = os.path.join(options.out, "fence.ply"), os.path.join(options.out, "heads.csv")
    write_fence(path)
    write_circles_and_rests(heads)

    def change(chance):
        return chance.choice((clip, lambda c: ("colour", "map", c.choice(("viridis", "plasma", "turbo", "grey"))),
                              lambda c: ("epoch",)))(chance)
    # Points have errors, and become exact while heads rest.
    errors = ["--depth-error", "1/32", "--normal-error", "1", "--colour-error", "1"]
    arguments = [path, "--colour-by", "height", "--cache", os.path.join(options.out, "cache")]
    return Scene("mesh", [*arguments, *errors], change, True, heads)


def julia(options):
    def change(chance):
        if chance.random() < 0.15:
            return ("epoch",)
        return ("set", f"c.y={chance.uniform(-0.5, 0.5):.3f}")
    return Scene("julia", ["julia"], change, True)


def volume(options):
    path = os.path.join(options.out, "tree.nrrd")
    subprocess.run([os.path.join(options.build, "bin/make-volume"), "--size", "96", "-o", path], check=True,
                   stdout=subprocess.DEVNULL, timeout=600)

    def change(chance):
        low = chance.randrange(5, 40)
        return chance.choice((clip, lambda c: ("tf", f"{low}%:#204060:0, {low + 20}%:#c08040:0.3, 100%:#ffffff:0.8"),
                              lambda c: ("epoch",)))(chance)
    return Scene("volume", [path], change, False)


def make(name, options):
    return {"mesh": mesh, "julia": julia, "volume": volume}[name](options)
