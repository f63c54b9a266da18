"""Closed solids from rings of points, in whole micrometres: what the gearbox is made of.

A surface is a list of triangles of integer points, so that neighbouring pieces meet exactly
and the same file comes out on every machine. `check` proves a solid closed: every edge has
exactly two opposite triangles.
"""

import math

MICROMETRES = 1000  # per millimetre; lengths below are millimetres


def point(x, y, z):
    return (round(x * MICROMETRES), round(y * MICROMETRES), round(z * MICROMETRES))


def angles(count, first=0.0):
    """`count` even angles, radians, counter-clockwise."""
    return [first + 2 * math.pi * i / count for i in range(count)]


def ring(radius, z, at):
    """A loop around the z axis; `radius` and `z` are numbers or functions of the angle."""
    r_of = radius if callable(radius) else lambda _: radius
    z_of = z if callable(z) else lambda _: z
    return [point(r_of(a) * math.cos(a), r_of(a) * math.sin(a), z_of(a)) for a in at]


def pole(z):
    """A loop shrunk to a point of the axis: the end of a path."""
    return [point(0, 0, z)]


def circle(cx, cy, radius, z, count, first=0.0):
    """A loop around an axis parallel to z."""
    return [point(cx + radius * math.cos(a), cy + radius * math.sin(a), z) for a in angles(count, first)]


def strip(a, b):
    """Triangles between two loops: point by point when they have the same count, else by
    angle, which suits loops around the z axis that see each other radially."""
    if len(a) == 1 or len(b) == 1:
        n = max(len(a), len(b))
        if len(a) == 1:
            return [(a[0], b[(i + 1) % n], b[i]) for i in range(n)]
        return [(a[i], a[(i + 1) % n], b[0]) for i in range(n)]
    if len(a) == len(b):
        n = len(a)
        triangles = []
        for i in range(n):
            j = (i + 1) % n
            triangles += [(a[i], a[j], b[j]), (a[i], b[j], b[i])]
        return triangles

    def turns(loop):
        base = [math.atan2(p[1], p[0]) for p in loop]
        first = base[0]
        return [(t - first) % (2 * math.pi) for t in base] + [2 * math.pi]

    start = min(range(len(b)), key=lambda i: (b[i][0] - a[0][0]) ** 2 + (b[i][1] - a[0][1]) ** 2)
    b = b[start:] + b[:start]
    shift = math.atan2(b[0][1], b[0][0]) - math.atan2(a[0][1], a[0][0])
    shift = (shift + math.pi) % (2 * math.pi) - math.pi
    ta, tb = turns(a), [t + shift for t in turns(b)]
    triangles, i, j = [], 0, 0
    while i < len(a) or j < len(b):
        if j == len(b) or (i < len(a) and ta[i + 1] <= tb[j + 1]):
            triangles.append((a[i], a[(i + 1) % len(a)], b[j % len(b)]))
            i += 1
        else:
            triangles.append((a[i % len(a)], b[(j + 1) % len(b)], b[j]))
            j += 1
    return triangles


def path(*loops, closed=False):
    """The surface swept through loops; closed: back to the first one."""
    triangles = []
    for a, b in zip(loops, loops[1:] + (loops[:1] if closed else ())):
        triangles += strip(a, b)
    return triangles


def revolve(profile, count, closed=True):
    """A solid of revolution about z from (r, z) pairs; r = 0 makes a pole."""
    at = angles(count)
    return path(*[pole(z) if r == 0 else ring(r, z, at) for r, z in profile], closed=closed)


def triangulate(outer, holes=()):
    """Ear clipping of a flat polygon (x, y of its points; counter-clockwise, holes clockwise)
    into index triples over outer + holes."""
    points = list(outer)
    loop = list(range(len(outer)))
    area = lambda a, b, c: (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    def crosses(p, q, a, b):
        if {p[:2], q[:2]} & {a[:2], b[:2]}:
            return False
        d1, d2, d3, d4 = area(p, q, a), area(p, q, b), area(a, b, p), area(a, b, q)
        return ((d1 > 0) != (d2 > 0) or d1 == 0 or d2 == 0) and ((d3 > 0) != (d4 > 0) or d3 == 0 or d4 == 0)

    pending = []
    for hole in holes:
        pending.append(list(range(len(points), len(points) + len(hole))))
        points += hole
    edges = []
    for indices in [loop] + pending:
        edges += [(points[i], points[j]) for i, j in zip(indices, indices[1:] + indices[:1])]
    while pending:  # a bridge to the hole that is nearest to the loop
        best = None
        for hole in pending:
            for k, h in enumerate(hole):
                for i, v in enumerate(loop):
                    d = (points[h][0] - points[v][0]) ** 2 + (points[h][1] - points[v][1]) ** 2
                    if (best is None or d < best[0]) and not any(
                            crosses(points[h], points[v], *edge) for edge in edges):
                        best = (d, hole, k, i)
        _, hole, k, i = best
        pending.remove(hole)
        edges.append((points[hole[k]], points[loop[i]]))
        loop = loop[:i + 1] + hole[k:] + hole[:k + 1] + loop[i:]

    triangles = []
    while len(loop) > 3:
        best = None
        for i in range(len(loop)):
            ia, ib, ic = loop[i - 1], loop[i], loop[(i + 1) % len(loop)]
            a, b, c = points[ia], points[ib], points[ic]
            twice = area(a, b, c)
            if twice <= 0:
                continue
            longest = max((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2, (b[0] - c[0]) ** 2 + (b[1] - c[1]) ** 2,
                          (c[0] - a[0]) ** 2 + (c[1] - a[1]) ** 2)
            if best is not None and twice / longest <= best[0]:
                continue
            inside = any(area(a, b, p) >= 0 and area(b, c, p) >= 0 and area(c, a, p) >= 0
                         for p in (points[v] for v in loop) if p[:2] not in (a[:2], b[:2], c[:2]))
            if not inside:
                best = (twice / longest, i, (ia, ib, ic))
        assert best is not None, "no ear: the polygon crosses itself"
        triangles.append(best[2])
        del loop[best[1]]
    if area(points[loop[0]], points[loop[1]], points[loop[2]]) > 0:
        triangles.append(tuple(loop))
    return triangles


def face(outer, inner, holes, sectors, up):
    """A flat ring between two loops of one count around the z axis, with one group of holes
    for each of `sectors` equal runs of points, all alike: holes[s] lists sector s's loops,
    counter-clockwise. `up`: seen from +z."""
    run = len(outer) // sectors

    def corner(loop, sector):
        return [loop[(sector * run + i) % len(loop)] for i in range(run + 1)]

    def polygon(sector):
        return corner(outer, sector) + corner(inner, sector)[::-1] + [p for h in holes[sector] for p in h[::-1]]

    first = polygon(0)
    boundary = 2 * (run + 1)
    starts, loops = boundary, []
    for h in holes[0]:
        loops.append(first[starts:starts + len(h)])
        starts += len(h)
    triples = triangulate(first[:boundary], loops)
    triangles = []
    for sector in range(sectors):
        corners = polygon(sector)
        triangles += [(corners[a], corners[b], corners[c]) for a, b, c in triples]
    return triangles if up else flipped(triangles)


def cap(loop, up):
    """A flat lid on a simple loop that runs counter-clockwise seen from +z."""
    triangles = [(loop[a], loop[b], loop[c]) for a, b, c in triangulate(loop)]
    return triangles if up else flipped(triangles)


def flipped(triangles):
    return [(a, c, b) for a, b, c in triangles]


def mirrored(triangles):
    """z to -z, still facing outward."""
    return [tuple((x, y, -z) for x, y, z in (a, c, b)) for a, b, c in triangles]


def volume6(triangles):
    """Six times the signed volume, cubic micrometres."""
    total = 0
    for a, b, c in triangles:
        total += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
                  + a[2] * (b[0] * c[1] - b[1] * c[0]))
    return total


def solid(triangles):
    """The triangles of a closed solid, facing outward, those without area left out.
    Raises ValueError unless every edge has exactly two opposite triangles."""
    triangles = [t for t in triangles if t[0] != t[1] and t[1] != t[2] and t[2] != t[0]]
    if volume6(triangles) < 0:
        triangles = flipped(triangles)
    edges = set()
    for a, b, c in triangles:
        for edge in ((a, b), (b, c), (c, a)):
            if edge in edges:
                raise ValueError(f"two triangles run the same way along {edge}")
            edges.add(edge)
    for a, b in edges:
        if (b, a) not in edges:
            raise ValueError(f"an open edge {a} {b}")
    for t in triangles:
        if normal_of(t) is None:
            raise ValueError(f"a triangle without area: {t}")
    return triangles


def normal_of(triangle):
    """Unit normal, or None without area."""
    a, b, c = triangle
    u = [b[i] - a[i] for i in range(3)]
    v = [c[i] - a[i] for i in range(3)]
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    length = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    return None if length == 0 else (n[0] / length, n[1] / length, n[2] / length)


def corner_angle(p, q, r):
    """The angle at p of triangle p q r, radians."""
    u = [q[i] - p[i] for i in range(3)]
    v = [r[i] - p[i] for i in range(3)]
    dot = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    lengths = math.sqrt(sum(c * c for c in u)) * math.sqrt(sum(c * c for c in v))
    return math.acos(max(-1.0, min(1.0, dot / lengths)))


def shaded(triangles, crease_deg=32.0):
    """Vertices (position, normal) and index triples: normals are averaged, weighted by angle,
    over the triangles around a point that meet at less than the crease angle."""
    cos_crease = math.cos(math.radians(crease_deg))
    normals = [normal_of(t) for t in triangles]
    around = {}
    for f, t in enumerate(triangles):
        for i in range(3):
            around.setdefault(t[i], []).append((f, corner_angle(t[i], t[(i + 1) % 3], t[(i + 2) % 3])))
    vertices, index_of, triples = [], {}, []
    for f, t in enumerate(triangles):
        n = normals[f]
        triple = []
        for p in t:
            s = [0.0, 0.0, 0.0]
            for g, weight in around[p]:
                m = normals[g]
                if n[0] * m[0] + n[1] * m[1] + n[2] * m[2] >= cos_crease:
                    s = [s[i] + weight * m[i] for i in range(3)]
            length = math.sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2])
            # Rounded, so that the last bits of a machine's sin and cos do not show in the file.
            normal = tuple(round(c / length * 8192) for c in s)
            key = (p, normal)
            if key not in index_of:
                index_of[key] = len(vertices)
                vertices.append(key)
            triple.append(index_of[key])
        triples.append(tuple(triple))
    return vertices, triples
