#!/usr/bin/env python3
"""Compares Sunfleck's mesh check and kd-tree with what pip installs, on one processor: see README.md beside this file."""

import argparse
import datetime
import json
import os
import pathlib
import statistics
import struct
import subprocess
import sys

import run

HERE, OUT = run.HERE, run.OUT

# Tasks: entrants with their titles. The first is what the others are held against.
CHECK = {
    "check": "Sunfleck, whole check",
    "normals": "Sunfleck, without the search for intersections",
    "polyhedral-gravity": "polyhedral-gravity, `check_normal_orientation`",
    "trimesh-normals": "trimesh, `is_watertight` and `fix_normals`, no rays",
}
RAYS = {
    "tree": "Sunfleck, `KdTree`",
    "lazy": "Sunfleck, `LazyKd`",
    "scikdtree": "scikdtree, `KDTree`, `countIntersections`",
    "scikdtree-calls": "— its calls alone, on one triangle",
    "trimesh-embree": "trimesh with embreex, single precision, all rays in one call",
}
TASKS = {"normals of all faces": CHECK, "build and a ray a face": RAYS}
OURS = {"check", "normals", "tree", "lazy"}
# A face in so many is turned round, to be found.
TURNED = 97
PACKAGES = ["polyhedral-gravity", "scikdtree", "trimesh", "embreex", "numpy"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="rounds, in turns (default 3)")
    parser.add_argument("--mesh", type=pathlib.Path, help="an .obj of triangles in place of the asteroid made by code")
    parser.add_argument("--python", default=sys.executable, help="the Python that has the packages")
    parser.add_argument("--only", help="entrants, comma-separated")
    parser.add_argument("--portable", action="store_true", help="build for any x86-64 instead of this processor")
    parser.add_argument("--output", type=pathlib.Path, default=OUT / "mesh.json", help="all measurements, as JSON")
    args = parser.parse_args()
    known = [name for entrants in TASKS.values() for name in entrants]
    wanted = args.only.split(",") if args.only else known
    if unknown := set(wanted) - set(known):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(known)}")

    program, versions, _ = run.build(["sunfleck"], args.portable)
    program = program["sunfleck"][0]
    folder = OUT / "meshes"
    subprocess.run([program, "mesh", "write", str(folder)], check=True)
    meshes = {"asteroid": folder / "asteroid.mesh", "sphere": folder / "sphere.mesh"}
    if args.mesh:
        given = folder / "given.mesh"
        write(given, *read_obj(args.mesh))
        meshes = {args.mesh.stem: given, "sphere": meshes["sphere"]}

    lines, missing = [], {}
    for number in range(1, args.rounds + 1):
        for name, path in meshes.items():
            turned = folder / f"{name}-turned.mesh"
            n_faces = write(turned, *turn(*read(path)))
            for task, entrants in TASKS.items():
                for entrant in [e for e in entrants if e in wanted and e not in missing]:
                    print(f"round {number}/{args.rounds} {name} {entrant}", file=sys.stderr, flush=True)
                    file = turned if entrants is CHECK else path
                    if entrant in OURS:
                        command = [program, "mesh", "run", entrant, str(file)]
                    else:
                        peer, small = HERE / "mesh_peer.py", folder / "small.mesh"
                        command = [args.python, str(peer), entrant, str(file), str(small)]
                    found, error = measure(command)
                    if error:
                        missing[entrant] = error
                    else:
                        lines.append(found | {"mesh": f"{name}, {n_faces:,} faces", "task": task, "entrant": entrant})
    report = {
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="minutes"),
        "command": " ".join([os.path.relpath(__file__), *sys.argv[1:]]),
        "device": run.device(),
        "rounds": args.rounds,
        "versions": {"sunfleck": versions["sunfleck"]} | installed(args.python),
        "missing": missing,
        "disagreements": check(lines),
        "measurements": lines,
    }
    args.output.parent.mkdir(parents=True, exist_ok=True)
    args.output.write_text(json.dumps(report, indent=1) + "\n")
    print(markdown(report))
    return 1 if report["disagreements"] else 0


def read(path):
    data = path.read_bytes()
    n, m = struct.unpack_from("<QQ", data)
    return list(struct.iter_unpack("<3d", data[16 : 16 + 24 * n])), list(struct.iter_unpack("<3I", data[16 + 24 * n :]))


def write(path, vertices, faces):
    with path.open("wb") as file:
        file.write(struct.pack("<QQ", len(vertices), len(faces)))
        file.write(b"".join(struct.pack("<3d", *p) for p in vertices))
        file.write(b"".join(struct.pack("<3I", *f) for f in faces))
    return len(faces)


def read_obj(path):
    rows = [line.split() for line in path.read_text().splitlines()]
    vertices = [tuple(map(float, row[1:4])) for row in rows if row[:1] == ["v"]]
    faces = [tuple(int(word.split("/")[0]) - 1 for word in row[1:]) for row in rows if row[:1] == ["f"]]
    return vertices, faces


def turn(vertices, faces):
    return vertices, [(a, c, b) if i % TURNED == 5 else (a, b, c) for i, (a, b, c) in enumerate(faces)]


def measure(command):
    """On the last processor alone, so that no library has more threads than one."""
    last = max(os.sched_getaffinity(0))
    env = os.environ | {"RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    pin = lambda: os.sched_setaffinity(0, {last})
    made = subprocess.run(command, env=env, capture_output=True, text=True, preexec_fn=pin)
    if made.returncode != 0:
        return None, made.stderr.strip()[-200:] or f"exit status {made.returncode}"
    return json.loads(made.stdout.splitlines()[-1]), None


def installed(python):
    script = "import importlib.metadata as m, json, sys\nv = {}\nfor p in sys.argv[1:]:\n"
    script += "    try: v[p] = m.version(p)\n    except m.PackageNotFoundError: pass\nprint(json.dumps(v))"
    return json.loads(subprocess.run([python, "-c", script, *PACKAGES], check=True, capture_output=True).stdout)


def check(lines):
    """The same faces point inward; as many crossings, but for those that rounding decides."""
    wrong = set()
    for key in {(line["mesh"], line["task"]) for line in lines}:
        group = [line for line in lines if (line["mesh"], line["task"]) == key and line["entrant"] != "scikdtree-calls"]
        ours = [line for line in group if line["entrant"] in OURS]
        for line in group if ours else []:
            for field in ["answer", "sum"]:
                tolerance = 0 if line["task"] in TASKS and TASKS[line["task"]] is CHECK else 1e-3 * ours[0][field]
                if abs(line[field] - ours[0][field]) > tolerance:
                    wrong.add(f"{line['entrant']}, {key[0]}: {field} {line[field]}, ours {ours[0][field]}")
    return sorted(wrong)


def markdown(report):
    lines = report["measurements"]
    meshes = list(dict.fromkeys(line["mesh"] for line in lines))
    text = [f"{report['device']}; {report['date']}; CPU seconds, one processor, medians of {report['rounds']} rounds in turns "
        f"(least – most), and times of ours; `{report['command']}`.", ""]
    for task, entrants in TASKS.items():
        text += [f"| {task} | " + " | ".join(meshes) + " |", "|---" * (len(meshes) + 1) + "|"]
        base = {}
        for entrant, title in entrants.items():
            row = [title]
            for mesh in meshes:
                times = [e["cpu_s"] for e in lines if (e["mesh"], e["entrant"]) == (mesh, entrant)]
                if not times:
                    row.append("–")
                    continue
                middle = statistics.median(times)
                base.setdefault(mesh, middle)
                ratio = f", {middle / base[mesh]:.1f} ×" if middle != base[mesh] else ""
                row.append(f"{middle:.3g} ({min(times):.3g} – {max(times):.3g}){ratio}")
            if any(cell != "–" for cell in row[1:]):
                text.append("| " + " | ".join(row) + " |")
        text.append("")
    text.append("Versions: " + ", ".join(f"{k} {v}" for k, v in report["versions"].items()) + ".")
    text += [f"Missing: {entrant}: {why}" for entrant, why in report["missing"].items()]
    text += [f"DISAGREEMENT: {line}" for line in report["disagreements"]]
    return "\n".join(text)


if __name__ == "__main__":
    sys.exit(main())
