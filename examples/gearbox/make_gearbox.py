#!/usr/bin/env python3
"""Writes gearbox.glb, the demo model: a planetary gearbox in a thick-walled housing.

    make_gearbox.py [FILE]          write it (default: gearbox.glb beside this file)
    make_gearbox.py --check FILE    exit 1 unless FILE is, byte for byte, what would be written

Sun 18, planets 27, ring 72 teeth, module 2.2 mm; input at the front (+z), output at the back.
Every part is a closed solid, checked as it is made; parts that touch in life keep a few
hundredths of a millimetre apart. Only Python's standard library is used. Lengths are
millimetres until they are written as metres.
"""

import argparse
import json
import math
import pathlib
import struct
import sys

from solids import angles, cap, circle, face, mirrored, path, point, pole, revolve, ring, shaded, solid

MODULE = 2.2
SUN, PLANET, RING = 18, 27, 72
PLANETS = 3
CENTRES = MODULE * (SUN + PLANET) / 2  # sun to planet
PRESSURE = math.radians(20)

# Linear base colour, metallic, roughness.
MATERIALS = {
    "housing paint": ((0.30, 0.40, 0.50), 0.0, 0.45),
    "cover paint": ((0.13, 0.19, 0.26), 0.0, 0.45),
    "gear steel": ((0.46, 0.48, 0.51), 0.6, 0.32),
    "planet steel": ((0.34, 0.40, 0.47), 0.6, 0.32),
    "ring steel": ((0.38, 0.38, 0.39), 0.6, 0.40),
    "brass": ((0.80, 0.52, 0.16), 0.6, 0.28),
    "bronze": ((0.52, 0.27, 0.11), 0.6, 0.38),
    "carrier steel": ((0.20, 0.21, 0.23), 0.5, 0.45),
    "shaft steel": ((0.55, 0.55, 0.56), 0.7, 0.28),
    "bearing steel": ((0.68, 0.69, 0.71), 0.8, 0.15),
    "key steel": ((0.13, 0.15, 0.21), 0.5, 0.40),
    "zinc": ((0.62, 0.62, 0.58), 0.7, 0.35),
    "black oxide": ((0.05, 0.05, 0.055), 0.4, 0.40),
    "rubber": ((0.03, 0.03, 0.03), 0.0, 0.80),
    "gasket": ((0.10, 0.22, 0.16), 0.0, 0.80),
}


# ---------------------------------------------------------------- gears

def gear_outline(teeth, addendum, dedendum, phase, thicker):
    """Radius and angle of an involute gear's outline, counter-clockwise, a tooth centred on
    `phase`; `thicker`: added to half the tooth's thickness at the pitch circle, mm."""
    pitch = MODULE * teeth / 2
    base, tip, root = pitch * math.cos(PRESSURE), pitch + addendum, pitch - dedendum
    involute = lambda a: math.tan(a) - a

    def half_angle(r):
        a = math.acos(min(1.0, base / max(r, base)))
        return math.pi / (2 * teeth) + involute(PRESSURE) - involute(a) + thicker / pitch

    flank = [root] if root < base else []
    foot = max(base, root)
    flank += [foot + (tip - foot) * (i / 5) ** 1.2 for i in range(6)]
    outline = []
    for tooth in range(teeth):
        centre = phase + 2 * math.pi * tooth / teeth
        outline += [(r, centre - half_angle(r)) for r in flank]
        outline.append((tip, centre))
        outline += [(r, centre + half_angle(r)) for r in reversed(flank)]
        # Two points on the root circle between this tooth and the next.
        gap = math.pi / teeth - half_angle(flank[0])
        outline += [(root, centre + half_angle(flank[0]) + gap * s) for s in (0.66, 1.34)]
    return outline


def gear_loop(outline, z, clamp):
    return [point(min(r, clamp) * math.cos(a), min(r, clamp) * math.sin(a), z) for r, a in outline]


def external_gear(teeth, half_width, phase, bore, recess=None):
    """A gear with chamfered teeth. `bore(z)`: the loop of its bore, one count for all z.
    `recess`: (r from, r to, depth) of a groove in both faces."""
    outline = gear_outline(teeth, MODULE, 1.25 * MODULE, phase, -0.05)
    root = MODULE * (teeth / 2 - 1.25)
    tip, chamfer = MODULE * (teeth / 2 + 1), 0.9

    def upper():
        w = half_width
        rim = [gear_loop(outline, w - chamfer, tip), gear_loop(outline, w, tip - chamfer),
               gear_loop(outline, w, root - 0.5)]
        at = angles(96)
        if recess:
            r0, r1, depth = recess
            rim += [ring(r1, w, at), ring(r1 - 0.4 * depth, w - depth, at), ring(r0 + 0.4 * depth, w - depth, at),
                    ring(r0, w, at)]
        return rim

    top = upper()
    bottom = [[(x, y, -z) for x, y, z in loop] for loop in upper()][::-1]
    return solid(path(*(top + [bore(half_width), bore(-half_width)] + bottom), closed=True))


def ring_gear(half_width, outer_radius, phase):
    """Teeth inside, a plain cylinder outside."""
    # The outline of the spaces: an external gear with the clearances swapped.
    outline = gear_outline(RING, 1.25 * MODULE, MODULE, phase + math.pi / RING, 0.05)
    root = MODULE * (RING / 2 + 1.25)
    low, chamfer = MODULE * (RING / 2 - 1), 0.9
    at = angles(160)

    def inner(z, least):
        return [point(max(r, least) * math.cos(a), max(r, least) * math.sin(a), z) for r, a in outline]

    w, c = half_width, 1.0
    loops = [inner(w - chamfer, low), inner(w, low + chamfer), inner(w, root + 0.4),
             ring(outer_radius - c, w, at), ring(outer_radius, w - c, at)]
    below = [[(x, y, -z) for x, y, z in loop] for loop in reversed(loops)]
    return solid(path(*(loops + below), closed=True))


def slotted(radius, half_width, bottom, count=89):
    """Two ways around a keyway at the top (+y) of a shaft (bottom < radius) or a bore (bottom >
    radius): the loop that follows the notch, and the plain circle, point for point. Each is a
    function of z."""
    mouth = math.asin(half_width / radius)
    arc = [math.pi / 2 + mouth + (2 * math.pi - 2 * mouth) * i / (count - 1) for i in range(count)]
    around = [(radius * math.cos(a), radius * math.sin(a)) for a in arc]
    lid = [(radius * math.cos(a), radius * math.sin(a)) for a in
           (math.pi / 2 - mouth / 2, math.pi / 2, math.pi / 2 + mouth / 2)]
    notch = [(half_width, bottom), (0, bottom), (-half_width, bottom)]
    return (lambda z: [point(x, y, z) for x, y in around + notch],
            lambda z: [point(x, y, z) for x, y in around + lid])


# ---------------------------------------------------------------- small parts

def chamfered(r0, r1, z0, z1, c, count):
    """A tube (or, with r0 = 0, a cylinder) with its outer edges broken by c."""
    outer = [(r1 - c, z0), (r1, z0 + c), (r1, z1 - c), (r1 - c, z1)]
    if r0 == 0:
        return solid(revolve([(0, z0)] + outer + [(0, z1)], count, closed=False))
    b = c / 2
    return solid(revolve(outer + [(r0 + b, z1), (r0, z1 - b), (r0, z0 + b), (r0 + b, z0)], count))


def ball(radius):
    rows, columns = 16, 28
    profile = [(0, -radius)]
    profile += [(radius * math.sin(math.pi * i / rows), -radius * math.cos(math.pi * i / rows))
                for i in range(1, rows)]
    return solid(revolve(profile + [(0, radius)], columns, closed=False))


def hexagon(across):
    """Angles that meet the corners of a hexagon, and its radius by angle."""
    step = math.pi / 3
    return angles(48), lambda a: across / 2 / math.cos(a % step - step / 2)


def hex_chamfer(across, z_top, z_bottom, both):
    """Loops of a hexagonal prism from bottom to top whose corners are turned off at 30 degrees."""
    at, r_hex = hexagon(across)
    turned = 0.475 * across
    drop = lambda a: max(0.0, r_hex(a) - turned) * math.tan(math.radians(30))
    loops = [ring(lambda a: min(r_hex(a), turned), z_bottom, at),
             ring(r_hex, lambda a: z_bottom + drop(a), at)] if both else [ring(r_hex, z_bottom, at)]
    return loops + [ring(r_hex, lambda a: z_top - drop(a), at), ring(lambda a: min(r_hex(a), turned), z_top, at)]


def hex_bolt(across, head, shank, length):
    """Head from z = 0 up, shank down."""
    at = angles(48)
    return solid(path(pole(-length), ring(shank - 0.6, -length, at), ring(shank, 0.6 - length, at),
                      ring(shank, 0, at), *hex_chamfer(across, head, 0, False), pole(head)))


def hex_nut(across, height, bore):
    at = angles(48)
    return solid(path(*hex_chamfer(across, height, 0, True), ring(bore + 0.4, height, at),
                      ring(bore, height - 0.4, at), ring(bore, 0.4, at), ring(bore + 0.4, 0, at), closed=True))


def cap_screw(shank, length, head_radius, head):
    """A socket head screw: head from z = 0 up, shank down."""
    at, r_hex = hexagon(1.55 * shank)
    c = 0.4
    return solid(path(pole(-length), ring(shank - c, -length, at), ring(shank, c - length, at), ring(shank, 0, at),
                      ring(head_radius, 0, at), ring(head_radius, head - c, at), ring(head_radius - c, head, at),
                      ring(r_hex, head, at), ring(r_hex, head - 2.2, at), pole(head - 2.2)))


def race(land, groove_centre, groove_radius, back, half_width):
    """A ball bearing's ring: `land` is its radius beside the groove, `back` the other side."""
    c = 0.6
    towards = 1 if back > land else -1
    reach = math.acos(abs(groove_centre - land) / groove_radius)
    profile = [(land, c - half_width)]
    profile += [(groove_centre + towards * groove_radius * math.cos(reach * i / 6),
                 groove_radius * math.sin(reach * i / 6)) for i in range(-6, 7)]
    profile += [(land, half_width - c), (land + towards * c, half_width), (back - towards * c, half_width),
                (back, half_width - c), (back, c - half_width), (back - towards * c, -half_width),
                (land + towards * c, -half_width)]
    return solid(revolve(profile, 80))


def seal(r0, r1, width):
    """A radial shaft seal from z = 0: case, lip and spring groove."""
    return solid(revolve([(r1 - 0.5, 0), (r1, 0.5), (r1, width - 0.5), (r1 - 0.5, width), (r0 + 3.0, width),
                          (r0 + 2.4, width - 2.2), (r0 + 1.2, width - 2.6), (r0, 0.45 * width), (r0 + 1.6, 0.2 * width),
                          (r0 + 3.2, 0.25 * width), (r0 + 3.6, 0)], 64))


def box_key(width, height, length):
    """A parallel key with broken edges and round ends, centred; height along y."""
    def outline(z, inset):
        h, w = height / 2 - inset, width / 2 - inset
        return [point(x, y, z) for x, y in ((w - .3, -h), (w, .3 - h), (w, h - .3), (w - .3, h),
                                            (.3 - w, h), (-w, h - .3), (-w, .3 - h), (.3 - w, -h))]
    half = length / 2
    loops = [outline(-half, 0.4), outline(0.4 - half, 0), outline(half - 0.4, 0), outline(half, 0.4)]
    return solid(cap(loops[0], False) + path(*loops) + cap(loops[-1], True))


# ---------------------------------------------------------------- shafts

def keyed_shaft(stations, keyways):
    """A shaft from (radius, z) stations in rising z, both ends on the axis; keyways: (half
    width, bottom, z0, z1), each between two stations of one radius."""
    at = angles(96)
    loops = []
    for (r, z), following in zip(stations, stations[1:] + [None]):
        loops.append(pole(z) if r == 0 else ring(r, z, at))
        for half_width, bottom, z0, z1 in keyways:
            if following and following[0] == r and z < z0 and z1 < following[1]:
                notch, lid = slotted(r, half_width, bottom)
                loops += [lid(z0), notch(z0), notch(z1), lid(z1)]
    return solid(path(*loops))


# ---------------------------------------------------------------- carrier

PIN_HOLE, POST_CIRCLE, POST_HOLE = 8.5, 58.0, 6.12


def pin_angle(i):
    return math.pi / 2 + 2 * math.pi * i / PLANETS


def carrier_angles():
    # They begin 90 degrees before the first pin, so that each third holds one pin and one post.
    return angles(36 * PLANETS, pin_angle(0) - math.pi / 2)


def carrier_plate(z0, z1, radius, neck):
    """A plate between z0 and z1 with holes for the pins and the posts; `neck`: the loops from
    its upper inner edge to its lower one."""
    at, c = carrier_angles(), 1.2
    outline = lambda a: radius + 2.5 * math.cos(PLANETS * (a - pin_angle(0)))
    rim = [ring(lambda a: outline(a) - c, z0, at), ring(outline, z0 + c, at), ring(outline, z1 - c, at),
           ring(lambda a: outline(a) - c, z1, at)]

    def holes(z):
        groups = []
        for i in range(PLANETS):
            p, q = pin_angle(i), pin_angle(i) - math.pi / PLANETS
            groups.append([circle(CENTRES * math.cos(p), CENTRES * math.sin(p), PIN_HOLE, z, 32, p),
                           circle(POST_CIRCLE * math.cos(q), POST_CIRCLE * math.sin(q), POST_HOLE, z, 24, q)])
        return groups

    triangles = path(*rim) + path(*neck)
    triangles += face(rim[-1], neck[0], holes(z1), PLANETS, True)
    triangles += face(rim[0], neck[-1], holes(z0), PLANETS, False)
    for low, high in zip(holes(z0), holes(z1)):
        for a, b in zip(low, high):
            triangles += path(b, a)
    return solid(triangles)


def carrier_front():
    at, z0, z1 = carrier_angles(), 22.0, 32.0
    return carrier_plate(z0, z1, 69.0, [ring(30.6, z1, at), ring(30, z1 - 0.6, at), ring(30, z0 + 0.6, at),
                                        ring(30.6, z0, at)])


def carrier_rear():
    """With a hub whose bore is keyed to the output shaft."""
    at, z0, z1, end = carrier_angles(), -32.0, -22.0, -45.0
    notch, _ = slotted(18.06, 5.0, 21.3)
    return carrier_plate(z0, z1, 69.0, [ring(30, z1, at), notch(z1), notch(end), ring(29, end, at),
                                        ring(30, end + 1, at), ring(30, z0, at)])


# ---------------------------------------------------------------- housing

BOLTS, BOLT_CIRCLE = 12, 115.5
SECTOR = [-15, -13.3, -12.5, -11, -9, -7.5, -6, -4.5, -3, -1.5, 0, 1.5, 3, 4.5, 6, 7.5, 9, 11, 12.5, 13.3]


def housing_angles():
    return [math.radians(30 * s + d) for s in range(BOLTS) for d in SECTOR]


def from_bolt(a):
    """Degrees from the nearest flange bolt."""
    d = math.degrees(a) % 30
    return min(d, 30 - d)


def flange_outline(a):
    t = min(1.0, max(0.0, (from_bolt(a) - 2.0) / 7.5))
    return 113 + 6.0 * (1 + math.cos(math.pi * t))


def on_rib(a):
    """1 on top of a rib, which stand between the bolts, 0 beside it."""
    return min(1.0, max(0.0, (from_bolt(a) - 12.4) / 0.8))


def bolt_holes(z, radius, count=24):
    groups = []
    for s in range(BOLTS):
        a = math.radians(30 * s)
        groups.append([circle(BOLT_CIRCLE * math.cos(a), BOLT_CIRCLE * math.sin(a), radius, z, count, a)])
    return groups


def blind_holes(z, circle_radius, radius, n=6):
    return [[circle(circle_radius * math.cos(a), circle_radius * math.sin(a), radius, z, 16, a)]
            for a in [2 * math.pi * s / n for s in range(n)]]


def housing_half(hub, bearing, shoulder, screw_circle):
    """The front half, flange at z = 0.5: hub radius, bearing seat, shaft hole, cover screws."""
    at = housing_angles()
    flange_top = 12.2
    # Outside, from the flange to the hub: beside the ribs, and on top of them.
    skin = [(106.0, flange_top + 2), (105.4, 34.0), (104.6, 48.0), (102.0, 53.0), (97.0, 56.5), (80.0, 59.5),
            (hub + 14, 63.0), (hub + 5, 65.0), (hub + 1.6, 67.5), (hub, 71.5)]
    ribs = [(111.0, flange_top + 2), (110.4, 34.0), (109.6, 48.0), (108.0, 53.5), (105.0, 58.0), (86.0, 66.0),
            (hub + 16, 74.2), (hub + 8, 77.2), (hub + 3.0, 78.4), (hub, 79.0)]
    foot = (107.2, flange_top), (111.4, flange_top)

    def station(low, high):
        mix = lambda i: lambda a: low[i] + (high[i] - low[i]) * on_rib(a)
        return ring(mix(0), mix(1), at)

    front = 81.0
    outside = [ring(lambda a: flange_outline(a) - 0.9, 0.5, at), ring(flange_outline, 1.4, at),
               ring(flange_outline, flange_top - 1.4, at), ring(lambda a: flange_outline(a) - 1.4, flange_top, at)]
    body = [station(*foot)] + [station(low, high) for low, high in zip(skin, ribs)]
    body += [ring(hub, front - 1, at), ring(hub - 1, front, at)]
    inside = [ring(bearing + 0.8, front, at), ring(bearing, front - 0.8, at), ring(bearing, 51.5, at),
              ring(shoulder + 0.6, 51.5, at), ring(shoulder, 50.9, at), ring(shoulder, 46.6, at),
              ring(shoulder + 0.6, 46.0, at), ring(80.0, 46.0, at), ring(85.0, 44.6, at), ring(87.4, 41.0, at),
              ring(88.0, 37.0, at), ring(88.0, 21.6, at), ring(94.9, 21.6, at), ring(94.9, 1.1, at),
              ring(95.5, 0.5, at)]

    # Loops begin 15 degrees before a bolt, so that each twelfth holds one hole.
    triangles = path(*outside) + path(*body) + path(*inside)
    triangles += face(outside[-1], body[0], bolt_holes(flange_top, 4.3), BOLTS, True)
    triangles += face(outside[0], inside[-1], bolt_holes(0.5, 4.3), BOLTS, False)
    for low, high in zip(bolt_holes(0.5, 4.3), bolt_holes(flange_top, 4.3)):
        triangles += path(high[0], low[0])
    # The hub's face has blind holes for the cover's screws, every 60 degrees from 0.
    half = len(SECTOR) // 2
    turn = lambda loop: loop[-half:] + loop[:-half]
    tops = blind_holes(front, screw_circle, 2.1)
    triangles += face(turn(body[-1]), turn(inside[0]), tops, 6, True)
    for top, bottom in zip(tops, blind_holes(front - 12.5, screw_circle, 2.1)):
        triangles += path(top[0], bottom[0]) + cap(bottom[0], True)
    return solid(triangles)


def gasket():
    at = housing_angles()
    z = 0.42
    outer = [ring(lambda a: flange_outline(a) - 1.2, s * z, at) for s in (-1, 1)]
    inner = [ring(96.0, s * z, at) for s in (-1, 1)]
    low, high = bolt_holes(-z, 4.6), bolt_holes(z, 4.6)
    triangles = path(*outer) + path(*inner[::-1])
    triangles += face(outer[1], inner[1], high, BOLTS, True) + face(outer[0], inner[0], low, BOLTS, False)
    for a, b in zip(low, high):
        triangles += path(b[0], a[0])
    return solid(triangles)


def cover(outer, spigot, lip, seat, screw_circle):
    """A bearing cover on a hub's face at z = 81: plate, spigot towards the bearing, seat of
    the seal, six holes."""
    at = angles(120, -math.pi / 6)
    z0, z1 = 81.08, 88.0
    rim = [ring(outer, z0, at), ring(outer, z1 - 1.2, at), ring(outer - 1.2, z1, at)]
    middle = [ring(lip + 2.5, z1, at), ring(lip + 1.0, z1 + 2.0, at), ring(lip, z1 + 2.0, at), ring(lip, 84.0, at),
              ring(seat, 84.0, at), ring(seat, 68.8, at), ring(seat + 0.5, 68.3, at), ring(spigot - 0.5, 68.3, at),
              ring(spigot, 68.8, at), ring(spigot, z0, at)]
    low, high = blind_holes(z0, screw_circle, 2.3), blind_holes(z1, screw_circle, 2.3)
    triangles = path(*rim) + path(*middle)
    triangles += face(rim[-1], middle[0], high, 6, True) + face(rim[0], middle[-1], low, 6, False)
    for a, b in zip(low, high):
        triangles += path(b[0], a[0])
    return solid(triangles)


def cradle():
    """A foot: a saddle under the ribs, 28 mm wide, on a base plate."""
    hug = 111.5
    arch = [(62 * math.cos(a), -150 + 13 * math.sin(a) ** 0.7) for a in [math.pi - math.pi * i / 20 for i in range(1, 20)]]
    outline = [(-96, -150), (-62, -150), *arch, (62, -150), (96, -150), (96, -141), (93, -138), (80, -134)]
    outline += [(hug * math.cos(a), hug * math.sin(a)) for a in
                [math.radians(-47 - 86 * i / 40) for i in range(41)]]
    outline += [(-80, -134), (-93, -138), (-96, -141)]

    def inset(distance, z):
        loop = []
        n = len(outline)
        for i in range(n):
            (ax, ay), (bx, by), (cx, cy) = outline[i - 1], outline[i], outline[(i + 1) % n]
            ux, uy, vx, vy = bx - ax, by - ay, cx - bx, cy - by
            ul, vl = math.hypot(ux, uy), math.hypot(vx, vy)
            nx, ny = -uy / ul - vy / vl, ux / ul + vx / vl
            scale = 2 * distance / (nx * nx + ny * ny)
            loop.append(point(bx + nx * scale, by + ny * scale, z))
        return loop

    c = 1.2
    loops = [inset(c, -14), inset(0, c - 14), inset(0, 14 - c), inset(c, 14)]
    return solid(cap(loops[0], False) + path(*loops) + cap(loops[-1], True))


# ---------------------------------------------------------------- the assembly

class Model:
    """A glTF scene in the making: meshes are written once, nodes place them."""

    def __init__(self):
        self.nodes, self.meshes, self.accessors, self.views = [], [], [], []
        self.materials = list(MATERIALS)
        self.blob = bytearray()

    def view(self, data, target):
        self.blob += bytes(-len(self.blob) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), "target": target})
        self.blob += data
        return len(self.views) - 1

    def mesh(self, name, material, triangles):
        """Adds a closed solid (from solid()) and returns its mesh index."""
        vertices, triples = shaded(triangles)
        # Micrometres to metres; the division of integers rounds the same everywhere.
        positions = [tuple(c / 1000000 for c in p) for p, _ in vertices]
        normals = []
        for _, n in vertices:
            length = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
            normals.append(tuple(c / length for c in n))
        floats = lambda rows: struct.pack(f"<{3 * len(rows)}f", *(c for row in rows for c in row))
        single = lambda v: struct.unpack("<f", struct.pack("<f", v))[0]
        base = len(self.accessors)
        self.accessors += [
            {"bufferView": self.view(floats(positions), 34962), "componentType": 5126, "count": len(positions),
             "type": "VEC3", "min": [single(min(c)) for c in zip(*positions)],
             "max": [single(max(c)) for c in zip(*positions)]},
            {"bufferView": self.view(floats(normals), 34962), "componentType": 5126, "count": len(normals),
             "type": "VEC3"}]
        flat = [i for t in triples for i in t]
        wide = len(vertices) > 65535
        self.accessors.append({"bufferView": self.view(struct.pack(f"<{len(flat)}{'I' if wide else 'H'}", *flat), 34963),
                               "componentType": 5125 if wide else 5123, "count": len(flat), "type": "SCALAR"})
        self.meshes.append({"name": name, "primitives": [{
            "attributes": {"POSITION": base, "NORMAL": base + 1}, "indices": base + 2,
            "material": self.materials.index(material)}]})
        return len(self.meshes) - 1

    def node(self, parent, name, mesh=None, at=None, turn=0.0):
        """Adds a node under `parent` (None: a root) at `at` mm, turned about z by `turn` radians."""
        node = {"name": name}
        if mesh is not None:
            node["mesh"] = mesh
        if at is not None:
            node["translation"] = [round(c * 1000) / 1000000 for c in at]
        if turn:
            node["rotation"] = [0, 0, round(math.sin(turn / 2), 7), round(math.cos(turn / 2), 7)]
        self.nodes.append(node)
        index = len(self.nodes) - 1
        if parent is not None:
            self.nodes[parent].setdefault("children", []).append(index)
        return index

    def glb(self):
        materials = [{"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": metal,
                                                              "roughnessFactor": rough}}
                     for name, (color, metal, rough) in MATERIALS.items()]
        self.blob += bytes(-len(self.blob) % 4)
        document = {"asset": {"version": "2.0", "generator": "porthole make_gearbox.py"}, "scene": 0,
                    "scenes": [{"name": "gearbox", "nodes": [0]}], "nodes": self.nodes, "meshes": self.meshes,
                    "materials": materials, "accessors": self.accessors, "bufferViews": self.views,
                    "buffers": [{"byteLength": len(self.blob)}]}
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self.blob)
        return (struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text
                + struct.pack("<I4s", len(self.blob), b"BIN\0") + bytes(self.blob))


def gear_phases():
    """Angles of a tooth of each planet and of the ring, so that they mesh with the sun's at 0."""
    planets, ring_phase = [], None
    for i in range(PLANETS):
        a = pin_angle(i)
        sun_tooth = a * SUN / (2 * math.pi)  # in teeth, where the sun faces the planet
        planet = a + math.pi - (0.5 - sun_tooth) * 2 * math.pi / PLANET
        planets.append(planet)
        outward = (a - planet) * PLANET / (2 * math.pi)
        phase = a - (outward + 0.5) * 2 * math.pi / RING
        if ring_phase is None:
            ring_phase = phase
        off = (phase - ring_phase) * RING / (2 * math.pi)
        assert abs(off - round(off)) < 1e-9, "these tooth numbers cannot be assembled"
    return planets, ring_phase


def on_circle(radius, angle, z):
    return (radius * math.cos(angle), radius * math.sin(angle), z)


def add_housing(m, root):
    group = m.node(root, "housing")
    m.node(group, "housing_front", m.mesh("housing_front", "housing paint", housing_half(38.0, 28.06, 24.0, 32.6)))
    m.node(group, "housing_rear", m.mesh("housing_rear", "housing paint", mirrored(housing_half(48.0, 36.06, 33.0, 41.6))))
    m.node(group, "gasket", m.mesh("gasket", "gasket", gasket()))
    foot = m.mesh("foot", "cover paint", cradle())
    m.node(group, "foot_front", foot, (0, 0, 37.5))
    m.node(group, "foot_rear", foot, (0, 0, -37.5))

    flange = m.node(group, "flange_fasteners")
    bolt = m.mesh("bolt", "zinc", hex_bolt(13.0, 5.6, 3.95, 36.0))
    nut = m.mesh("nut", "zinc", hex_nut(13.0, 6.6, 4.02))
    washer = m.mesh("washer", "zinc", chamfered(4.25, 7.4, 0, 1.5, 0.25, 32))
    for i in range(BOLTS):
        a = 2 * math.pi * i / BOLTS
        place = lambda z: on_circle(BOLT_CIRCLE, a, z)
        m.node(flange, f"bolt_{i + 1:02}", bolt, place(13.8), 0.7 * i + 0.2)
        m.node(flange, f"washer_front_{i + 1:02}", washer, place(12.25))
        m.node(flange, f"washer_rear_{i + 1:02}", washer, place(-13.75))
        m.node(flange, f"nut_{i + 1:02}", nut, place(-20.4), 1.1 * i + 0.5)


def add_bearing(m, parent, name, bore, outer, ball_radius, ball_circle, balls, z):
    group = m.node(parent, name)
    clearance = 0.04
    play = ball_radius + clearance
    inner_land, outer_land = ball_circle - 0.62 * ball_radius, ball_circle + 0.62 * ball_radius
    m.node(group, f"{name}_inner_ring",
           m.mesh(f"{name}_inner_ring", "bearing steel", race(inner_land, ball_circle, play, bore, 8.0)), (0, 0, z))
    m.node(group, f"{name}_outer_ring",
           m.mesh(f"{name}_outer_ring", "bearing steel", race(outer_land, ball_circle, play, outer, 8.0)), (0, 0, z))
    mesh = m.mesh(f"{name}_ball", "bearing steel", ball(ball_radius))
    for i in range(balls):
        m.node(group, f"{name}_ball_{i + 1:02}", mesh, on_circle(ball_circle, 2 * math.pi * i / balls + 0.3, z))


def add_cover(m, parent, name, plate, screw_circle, front):
    group = m.node(parent, f"{name}_cover")
    m.node(group, f"{name}_cover_plate",
           m.mesh(f"{name}_cover_plate", "cover paint", plate if front else mirrored(plate)))
    screw = cap_screw(2.0, 18.0, 3.6, 4.0)
    mesh = m.mesh(f"{name}_cover_screw", "black oxide", screw if front else mirrored(screw))
    for i in range(6):
        place = on_circle(screw_circle, 2 * math.pi * i / 6, 88.06 if front else -88.06)
        m.node(group, f"{name}_cover_screw_{i + 1}", mesh, place, 0.4 * i)


def add_input(m, root):
    group = m.node(root, "input")
    shaft = keyed_shaft([(0, -40), (8, -40), (9, -39), (9, -20), (12, -20), (12, 96), (11, 97), (11, 141), (10, 142),
                         (0, 142)], [(4.0, 8.0, -13.1, 13.1), (3.0, 7.5, 104.0, 136.0)])
    m.node(group, "input_shaft", m.mesh("input_shaft", "shaft steel", shaft))
    bore, _ = slotted(12.06, 4.0, 15.3)
    m.node(group, "sun_gear", m.mesh("sun_gear", "brass", external_gear(SUN, 18.0, 0.0, bore)))
    m.node(group, "sun_key", m.mesh("sun_key", "key steel", box_key(7.9, 7.1, 26.0)), (0, 11.65, 0))
    m.node(group, "input_key", m.mesh("input_key", "key steel", box_key(5.9, 6.0, 31.8)), (0, 10.6, 120))
    m.node(group, "spacer_sleeve", m.mesh("spacer_sleeve", "shaft steel", chamfered(12.06, 15.2, 18.1, 51.9, 0.5, 56)))
    m.node(group, "pilot_bush", m.mesh("pilot_bush", "bronze", chamfered(9.06, 11.96, -38.8, -21.2, 0.4, 56)))
    add_bearing(m, group, "input_bearing", 12.05, 28.0, 4.5, 20.0, 9, 60.0)
    m.node(group, "input_seal", m.mesh("input_seal", "rubber", seal(12.12, 21.9, 9.0)), (0, 0, 74.5))
    add_cover(m, group, "input", cover(37.0, 27.9, 13.4, 22.0, 32.6), 32.6, True)


def add_planets(m, root):
    group = m.node(root, "planet_stage")
    planet_phases, ring_phase = gear_phases()
    m.node(group, "ring_gear", m.mesh("ring_gear", "ring steel", ring_gear(20.0, 94.8, ring_phase)))
    carrier = m.node(group, "carrier")
    m.node(carrier, "carrier_plate_front", m.mesh("carrier_plate_front", "carrier steel", carrier_front()))
    m.node(carrier, "carrier_plate_rear", m.mesh("carrier_plate_rear", "carrier steel", carrier_rear()))
    post = m.mesh("carrier_post", "shaft steel", solid(revolve(
        [(0, -34), (5.4, -34), (6, -33.4), (6, -21.95), (8, -21.95), (8, 21.95), (6, 21.95), (6, 33.4), (5.4, 34),
         (0, 34)], 40, closed=False)))
    for i in range(PLANETS):
        m.node(carrier, f"carrier_post_{i + 1}", post, on_circle(POST_CIRCLE, pin_angle(i) - math.pi / PLANETS, 0))

    at = angles(72)
    bore = lambda z: ring(11.6, z, at)
    gear = m.mesh("planet_gear", "planet steel", external_gear(PLANET, 18.0, 0.0, bore, (15.5, 24.0, 2.5)))
    pin = m.mesh("planet_pin", "shaft steel", chamfered(2.6, 8.42, -34.5, 34.5, 0.8, 48))
    needle = m.mesh("needle", "bearing steel", chamfered(0, 1.5, -16.5, 16.5, 0.35, 16))
    thrust = m.mesh("thrust_washer", "bronze", chamfered(8.6, 17.0, -1.7, 1.7, 0.4, 56))
    for i in range(PLANETS):
        centre = on_circle(CENTRES, pin_angle(i), 0)
        planet = m.node(group, f"planet_{i + 1}", at=centre)
        m.node(planet, f"planet_gear_{i + 1}", gear, turn=math.remainder(planet_phases[i], 2 * math.pi))
        m.node(planet, f"planet_pin_{i + 1}", pin)
        m.node(planet, f"thrust_washer_front_{i + 1}", thrust, (0, 0, 20.0))
        m.node(planet, f"thrust_washer_rear_{i + 1}", thrust, (0, 0, -20.0))
        bearing = m.node(planet, f"needle_bearing_{i + 1}")
        for k in range(18):
            m.node(bearing, f"needle_{i + 1}_{k + 1:02}", needle, on_circle(10.0, 2 * math.pi * k / 18, 0))


def add_output(m, root):
    group = m.node(root, "output")
    shaft = keyed_shaft([(0, -152), (15, -152), (16, -151), (16, -101), (18, -100), (18, -20.6), (17.5, -20.1),
                         (12.4, -20.1), (12.06, -20.5), (12.06, -43), (0, -43)],
                        [(5.0, 12.8, -43.6, -23.4), (5.0, 11.0, -144.0, -108.0)])
    m.node(group, "output_shaft", m.mesh("output_shaft", "shaft steel", shaft))
    m.node(group, "output_carrier_key", m.mesh("output_carrier_key", "key steel", box_key(9.9, 8.3, 20.0)),
           (0, 17.05, -33.5))
    m.node(group, "output_key", m.mesh("output_key", "key steel", box_key(9.9, 8.0, 35.8)), (0, 15.1, -126))
    add_bearing(m, group, "output_bearing", 18.05, 36.0, 5.5, 27.0, 11, -60.0)
    m.node(group, "output_seal", m.mesh("output_seal", "rubber", mirrored(seal(18.12, 29.9, 9.0))), (0, 0, -74.5))
    add_cover(m, group, "output", cover(47.0, 35.9, 19.4, 30.0, 41.6), 41.6, False)


def make():
    m = Model()
    root = m.node(None, "gearbox")
    add_housing(m, root)
    add_input(m, root)
    add_planets(m, root)
    add_output(m, root)
    return m


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", nargs="?", type=pathlib.Path, default=pathlib.Path(__file__).parent / "gearbox.glb")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    model = make()
    data = model.glb()
    if arguments.check:
        if arguments.file.read_bytes() != data:
            sys.exit(f"{arguments.file} is not what make_gearbox.py writes; run it and commit the result")
        return
    arguments.file.write_bytes(data)
    count = [model.accessors[mesh["primitives"][0]["indices"]]["count"] // 3 for mesh in model.meshes]
    placed = [node["mesh"] for node in model.nodes if "mesh" in node]
    print(f"{arguments.file}: {len(placed)} parts, {len(count)} meshes, {sum(count)} triangles, "
          f"{sum(count[i] for i in placed)} drawn, {len(data)} bytes")


if __name__ == "__main__":
    main()
