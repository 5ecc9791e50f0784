"""The steam: a small simulation of warm, moist air that rises from the tub's water, and its refinement to the grid that is rendered.

Two stages, both from "Stable Fluids" (Stam 1999):
1. On a coarse grid velocity and steam are carried along backwards, buoyancy and vorticity confinement (Fedkiw, Stam, Jensen
   2001) push, and a projection in Fourier space makes the flow divergence-free. Steam evaporates with time.
2. The coarse steam is too blurred to look at: every carrying along averages. So each fine voxel is followed backwards through
   the last seconds' velocities in one go, and takes what steam is there and what the water gave off on its way: nothing is
   averaged on this way, and the flow draws the steam out into sheets and wisps.

Only sums, products, square roots and FFTs of arrays: the same bytes on every run. Arrays are [x, y, z]; lengths metres.
"""
import numpy as np

from furniture import TUB, TUB_A, TUB_B, WATER
from hall import BACK, FRONT, HEIGHT, LEFT, RIGHT
from images import fractal, mix, smoothstep
from vdb import write_vdb
from vol import write_vol

ORIGIN = np.array((LEFT, 0.0, BACK))
SIZE = np.array((RIGHT - LEFT, HEIGHT, FRONT - BACK))
STEP = 0.07  # seconds
LIFE = 9.0  # seconds until steam has thinned out to a third
BUOYANCY, CONFINEMENT, STIRRING = 0.75, 0.5, 1.3
SIGMA, HAZE = 2.2, (0.024, 0.09)  # extinction of fresh steam, and of the moist air far from the tub and above it, per metre


MOIST = TUB + (.35, 1.5, -.35)  # where the air is moistest


class Flow:
    """Velocity (metres per second) and steam (1 where it leaves the water) on cells of edge h."""

    def __init__(self, cells_high):
        self.h = HEIGHT / cells_high
        self.n = tuple(int(round(s / self.h)) for s in SIZE)
        axes = [(np.arange(n) + .5) * self.h for n in self.n]
        self.centres = np.stack(np.meshgrid(*axes, indexing="ij"), -1) + ORIGIN
        k = [np.fft.fftfreq(n) for n in self.n[:2]] + [np.fft.rfftfreq(self.n[2])]
        self.k = np.meshgrid(*k, indexing="ij")
        k2 = sum(a * a for a in self.k)
        k2[0, 0, 0] = 1
        self.k_over_k2 = [a / k2 for a in self.k]
        # Within a cell of a wall nothing moves; air is slow next to it.
        inside = [np.minimum(a, a[::-1]) / self.h for a in axes]
        x, y, z = np.meshgrid(*inside, indexing="ij")
        self.open = smoothstep(.2, 1.4, np.minimum(np.minimum(x, y), z))[..., None].astype(np.float32)
        self.open *= 1 - tub_body(self.centres)[..., None].astype(np.float32)
        self.velocity = self.draught(1, .9, .30)
        self.stirring = self.draught(21, 2.4, 1.0)
        self.steam = self.before()

    def draught(self, seed, per_metre, strength):
        """Eddies, from the curl of noise."""
        at = [per_metre * self.centres[..., c] + 9 for c in range(3)]
        potential = np.stack([fractal(seed + c, *at, octaves=3) for c in range(3)], -1)
        return self.project((strength / self.h / per_metre * curl(potential.astype(np.float32))) * self.open)

    def before(self):
        """Steam that the tub gave off earlier: banks of it around and above, which the flow then draws out."""
        p = self.centres
        x, y, z = p[..., 0] - TUB[0], p[..., 1], p[..., 2] - TUB[2]
        away = (x / 1.7) ** 2 + (z / 1.5) ** 2 + ((y - 1.2) / 1.3) ** 2
        banks = fractal(4, 1.5 * p[..., 0] + 9, 1.5 * p[..., 1] + 9, 1.5 * p[..., 2] + 9, octaves=3)
        return (.95 * smoothstep(.44, .66, banks) / (1 + away * away)).astype(np.float32)

    def project(self, velocity):
        # In float64: numpy 2 would transform float32 in float32, with other bytes than numpy 1
        hat = [np.fft.rfftn(velocity[..., c].astype(np.float64)) for c in range(3)]
        along = sum(k * f for k, f in zip(self.k, hat))
        return np.stack([np.fft.irfftn(f - k * along, self.n) for f, k in zip(hat, self.k_over_k2)], -1).astype(np.float32)

    def step(self, time):
        v, h = self.velocity, self.h
        fields = np.concatenate([v, self.steam[..., None]], -1)
        back = ((self.centres - ORIGIN) / h - .5).astype(np.float32) - v * np.float32(STEP / h)
        fields = sample(fields, back.reshape(-1, 3)).reshape(self.n + (4,))
        v, steam = fields[..., :3], fields[..., 3] * np.float32(1 - STEP / LIFE)
        rate = source(self.centres, time, h)
        steam = np.maximum(steam, rate.astype(np.float32))
        v[..., 1] += np.float32(STEP * BUOYANCY) * steam
        # Warm air is unsteady: eddies that rise with it push it about.
        v += np.float32(STEP * STIRRING) * steam[..., None] * np.roll(self.stirring, int(.35 * time / h), 1)
        v += np.float32(STEP * CONFINEMENT * h) * confinement(v, h)
        self.velocity = self.project(v * self.open) * self.open
        self.steam = steam


def curl(v):
    d = lambda c, axis: (np.roll(v[..., c], -1, axis) - np.roll(v[..., c], 1, axis)) * np.float32(.5)
    return np.stack([d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1)], -1)


def norm(v):
    return np.sqrt(v[..., 0] ** 2 + v[..., 1] ** 2 + v[..., 2] ** 2)


def confinement(v, h):
    """Pushes around the middles of eddies, against their being smoothed away."""
    vorticity = curl(v) / np.float32(h)
    strength = norm(vorticity)
    towards = np.stack([np.roll(strength, -1, a) - np.roll(strength, 1, a) for a in range(3)], -1)
    towards /= norm(towards)[..., None] + np.float32(1e-4)
    (ax, ay, az), (bx, by, bz) = (np.moveaxis(a, -1, 0) for a in (towards, vorticity))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def sample(field, at):
    """Trilinear look-up of field[x, y, z, :] at points in cells; outside, the outermost values."""
    n = field.shape[:3]
    flat = np.ascontiguousarray(field).reshape(-1, field.shape[3])
    at = np.clip(at, 0, np.array(n, np.float32) - np.float32(1.001))
    cell = at.astype(np.int32)
    f = at - cell
    base = (cell[:, 0] * n[1] + cell[:, 1]) * n[2] + cell[:, 2]
    fx, fy, fz = f[:, 0], f[:, 1], f[:, 2]
    total = None
    for dx, wx in ((0, 1 - fx), (n[1] * n[2], fx)):
        for dy, wy in ((0, 1 - fy), (n[2], fy)):
            wxy = wx * wy
            for dz, wz in ((0, 1 - fz), (1, fz)):
                term = flat[base + (dx + dy + dz)] * (wxy * wz)[:, None]
                total = term if total is None else total + term
    return total


def plan(p):
    """1 at the rim of the tub's water, 0 at its middle."""
    return np.sqrt(((p[..., 0] - TUB[0]) / (TUB_A - .05)) ** 2 + ((p[..., 2] - TUB[2]) / (TUB_B - .05)) ** 2)


def tub_body(p):
    """1 within the tub's water and walls, where no air moves."""
    return ((plan(p) < 1.15) & (p[..., 1] < WATER - .02)).astype(float)


def source(p, time, blur):
    """What the water gives off: patches that wander over it, in a thin layer above; blur widens the layer to what a grid can hold."""
    out = np.zeros(p.shape[:-1])
    layer = .05 + .5 * blur
    near = (p[..., 1] > WATER - layer) & (p[..., 1] < WATER + 2 * layer) & (plan(p) < 1)
    q = p[near]
    patches = fractal(7, 3.6 * q[:, 0] + 30, 3.6 * q[:, 2] + 30, np.full(len(q), .55 * time + 3), octaves=3)
    height = 1 - smoothstep(.2 * layer, 2 * layer, q[:, 1] - WATER)
    out[near] = height * smoothstep(.32, .62, patches) * (1 - smoothstep(.7, 1, plan(q)))
    return out


def refine(points, frames, start, flow):
    """Steam at points [n, 3]: back through the frames (time, velocity), then into the coarse steam at their start.

    Also returns where the points came from.
    """
    h = flow.h
    p, steam = points.astype(np.float32), np.zeros(len(points), np.float32)
    origin = ORIGIN.astype(np.float32)
    kept = np.float32(1)
    for time, velocity in reversed(frames):
        low = np.flatnonzero((p[:, 1] < WATER + .2) & (steam < .95))
        given = source(p[low].astype(float), time, .02).astype(np.float32) * kept
        steam[low] = np.maximum(steam[low], given)
        p = p - sample(velocity, (p - origin) / np.float32(h) - np.float32(.5)) * np.float32(STEP)
        kept *= np.float32(1 - STEP / LIFE)
    older = sample(start[..., None], (p - origin) / np.float32(h) - np.float32(.5))[:, 0] * kept
    return np.maximum(steam, older), p


def simulate(cells_high, seconds, remembered):
    """The flow after some seconds, the last frames, and the steam at their start."""
    flow = Flow(cells_high)
    steps, kept, start = int(seconds / STEP), int(remembered / STEP), None
    frames = []
    for k in range(steps):
        if k == steps - kept:
            start = flow.steam.copy()
        flow.step(k * STEP)
        if start is not None:
            frames.append(((k + 1) * STEP, flow.velocity))
    return flow, frames, start


def density(voxel, cells_high, seconds=13.0, remembered=2.8):
    """Extinction per metre of voxels whose centres begin half a voxel inside the hall's lower corner."""
    flow, frames, start = simulate(cells_high, seconds, remembered)
    n = [int(s / voxel) for s in SIZE]
    axes = [(np.arange(k) + .5) * voxel + o for k, o in zip(n, ORIGIN)]
    out = np.zeros(n, np.float32)
    slab = max(1, 300000 // (n[1] * n[2]))
    for x in range(0, n[0], slab):
        points = np.stack(np.meshgrid(axes[0][x:x + slab], axes[1], axes[2], indexing="ij"), -1)
        shape = points.shape[:3]
        steam, came = refine(points.reshape(-1, 3), frames, start, flow)
        came = came.astype(float)
        veil = fractal(9, 1.1 * came[:, 0] + 20, 2.2 * came[:, 1] + 20, 1.1 * came[:, 2] + 20, octaves=3)
        near = 1 / (1 + ((points.reshape(-1, 3) - MOIST) ** 2).sum(-1) ** 2 / 12)
        haze = mix(*HAZE, near) * (.35 + 1.3 * smoothstep(.3, .75, veil))
        value = SIGMA * steam * np.sqrt(steam) * (1.5 - .5 * steam) + haze  # thin steam is clear: droplets evaporate
        value[tub_body(points.reshape(-1, 3)) > 0] = 0
        out[x:x + slab] = value.reshape(shape)
    return out


def write(path, voxel, cells_high):
    """Writes the steam as OpenVDB or, if the path ends in .vol, for Mitsuba."""
    values = density(voxel, cells_high)
    if path.suffix == ".vol":
        write_vol(path, values, ORIGIN, ORIGIN + voxel * np.array(values.shape))
    else:
        write_vdb(path, values, "density", ORIGIN + voxel / 2, voxel)
