"""One library, one thing, one mesh: arguments and output as those of rust/src/mesh.rs, with a small mesh to warm up on."""

import json
import os
import sys
import time

import numpy


def read(path):
    with open(path, "rb") as file:
        n, m = numpy.fromfile(file, "<u8", 2)
        vertices = numpy.fromfile(file, "<f8", 3 * int(n)).reshape(-1, 3)
        return vertices, numpy.fromfile(file, "<u4", 3 * int(m)).reshape(-1, 3).astype(numpy.int64)


def rays(vertices, faces):
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    normals = numpy.cross(b - a, c - a)
    normals /= numpy.linalg.norm(normals, axis=1)[:, None]
    size = (vertices.max(axis=0) - vertices.min(axis=0)).max()
    return (a + b + c) / 3 + size * normals, -normals


class Peer:
    """`prepare` is not timed. `ask` returns what is compared: a number, and a sum."""


class PolyhedralGravity(Peer):
    def prepare(self, vertices, faces):
        from polyhedral_gravity import Polyhedron, PolyhedronIntegrity

        self.n = len(faces)
        self.mesh = Polyhedron((vertices, faces), 1.0, integrity_check=PolyhedronIntegrity.DISABLE)

    def ask(self):
        from polyhedral_gravity import NormalOrientation

        most, others = self.mesh.check_normal_orientation()
        inward = others if most == NormalOrientation.OUTWARDS else set(range(self.n)) - others
        return len(inward), float(sum(inward))


class TrimeshNormals(Peer):
    """No rays: the way neighbours run along their edge, and the sign of the volume."""

    def prepare(self, vertices, faces):
        import trimesh

        self.mesh = trimesh.Trimesh(vertices, faces, process=False)

    def ask(self):
        import trimesh

        before = self.mesh.faces.copy()
        closed = self.mesh.is_watertight
        trimesh.repair.fix_normals(self.mesh, multibody=False)
        turned = numpy.flatnonzero((self.mesh.faces != before).any(axis=1))
        return len(turned) if closed else -1, float(turned.sum())


class Scikdtree(Peer):
    def prepare(self, vertices, faces):
        self.vertices, self.faces = vertices.tolist(), faces.tolist()
        self.rays = [(o.tolist(), d.tolist()) for o, d in zip(*rays(vertices, faces))]

    def ask(self):
        from scikdtree import KDTree

        tree = KDTree(self.vertices, self.faces)
        return sum(tree.countIntersections(o, d) for o, d in self.rays), 0.0


class ScikdtreeCalls(Scikdtree):
    """A single triangle far away: what the calls alone cost."""

    def prepare(self, vertices, faces):
        super().prepare(vertices, faces)
        size = float(numpy.abs(vertices).max())
        self.vertices = [[9e3 * size, 0.0, 0.0], [9e3 * size, 1e-3 * size, 0.0], [9e3 * size, 0.0, 1e-3 * size]]
        self.faces = [[0, 1, 2]]


class TrimeshEmbree(Peer):
    """Single precision, all rays in one call."""

    def prepare(self, vertices, faces):
        self.vertices, self.faces, self.rays = vertices, faces, rays(vertices, faces)

    def ask(self):
        import trimesh
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        tree = RayMeshIntersector(trimesh.Trimesh(self.vertices, self.faces, process=False))
        return len(tree.intersects_id(*self.rays, multiple_hits=True)[0]), 0.0


PEERS = {
    "polyhedral-gravity": PolyhedralGravity,
    "trimesh-normals": TrimeshNormals,
    "scikdtree": Scikdtree,
    "scikdtree-calls": ScikdtreeCalls,
    "trimesh-embree": TrimeshEmbree,
}


def main(what, mesh, small):
    # scikdtree writes a line there for each ray.
    output = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for path in [small, mesh]:
        peer = PEERS[what]()
        peer.prepare(*read(path))
        began = time.process_time(), time.perf_counter()
        answer, total = peer.ask()
        spent = time.process_time() - began[0], time.perf_counter() - began[1]
    os.dup2(output, 1)
    print(json.dumps({"cpu_s": spent[0], "wall_s": spent[1], "answer": int(answer), "sum": total}))


main(*sys.argv[1:])
