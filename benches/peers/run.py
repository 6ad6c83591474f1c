#!/usr/bin/env python3
"""Compares Sunfleck's neighbour search with other libraries on one CPU thread: see README.md beside this file."""

import argparse
import datetime
import json
import os
import pathlib
import platform
import shutil
import statistics
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
OUT = HERE.parents[1] / "target" / "peers"

# Library: what runs it, and where its version is said if it does not say it itself.
RUST = ["sunfleck", "sunfleck-single", "sunfleck-median", "sunfleck-median-single", "sunfleck-grid"]
RUST += ["kiddo", "obvhs-ploc", "obvhs-medium", "rstar"]
CPP = ["embree", "flann", "nanoflann"]
LIBRARIES = RUST + CPP + ["scipy"]
TITLES = {
    "sunfleck": "Sunfleck, `PointBvh`, batch",
    "sunfleck-single": "Sunfleck, `PointBvh`, query by query",
    "sunfleck-median": "Sunfleck, `PointBvh`, median order, batch",
    "sunfleck-median-single": "Sunfleck, `PointBvh`, median order, query by query",
    "sunfleck-grid": "Sunfleck, `HashGrid`, sorted queries",
    "kiddo": "kiddo, `ImmutableKdTree`",
    "obvhs-ploc": "obvhs, PLOC, boxes grown by r",
    "obvhs-medium": "obvhs, medium quality, boxes grown by r",
    "rstar": "rstar, bulk load",
    "embree": "Embree, point query, tight boxes",
    "flann": "FLANN, single kd-tree",
    "nanoflann": "nanoflann",
    "scipy": "SciPy `cKDTree`, lists stored",
}
RADII = ["0.005", "0.01", "0.02", "0.05"]
KS = [1, 4, 8]
KNN_RADIUS = "0.02"
# Queries of the first round; all libraries give their sums of these.
WARM_UP = 4096
# Neighbours at the very edge of the ball may fall on either side: fused multiply-add, or double precision.
TOLERANCE = 2e-5


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="timed rounds after the warm-up (default 5)")
    parser.add_argument("--only", help="libraries, comma-separated")
    parser.add_argument("--sets", default="photons,uniform", help="point sets: photons, uniform (default both)")
    parser.add_argument("--portable", action="store_true", help="build for any x86-64 instead of this processor")
    parser.add_argument("--limit", type=int, default=0, help="ask only so many queries of a case (for trying out)")
    parser.add_argument("--shuffled", type=int, default=0, help="ask only so many of the shuffled queries")
    parser.add_argument("--output", type=pathlib.Path, default=OUT / "results.json", help="all measurements, as JSON")
    args = parser.parse_args()

    wanted = args.only.split(",") if args.only else LIBRARIES
    if unknown := set(wanted) - set(LIBRARIES):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(LIBRARIES)}")
    programs, versions, missing = build(wanted, args.portable)
    sets = {name: make for name, make in point_sets(programs, args.shuffled).items() if name in args.sets.split(",")}

    lines, report = [], {}
    for number in range(args.rounds + 1):
        for name, (points, cases) in sets.items():
            for library in [w for w in wanted if w in programs]:
                limit = WARM_UP if number == 0 else args.limit
                print(f"round {number}/{args.rounds} {name} {library}", file=sys.stderr, flush=True)
                found, error = measure(programs[library], limit, points, cases)
                for line in found:
                    versions.setdefault(library, line.get("version", ""))
                    lines.append(line | {"library": library, "round": number, "threads": 1})
                if error:
                    missing[library] = error
                    del programs[library]
        report = {
            "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="minutes"),
            "command": " ".join([os.path.relpath(__file__), *sys.argv[1:]]),
            "device": device(),
            "target": "portable" if args.portable else "native",
            "rounds": number,
            "versions": versions,
            "missing": missing,
            "disagreements": check(lines),
            "measurements": [line for line in lines if line["round"] > 0],
        }
        args.output.parent.mkdir(parents=True, exist_ok=True)
        args.output.write_text(json.dumps(report, indent=1) + "\n")
    print(markdown(report, wanted))
    return 1 if report["disagreements"] else 0


def build(wanted, portable):
    """Builds what can be built: programs (argument lists), versions, and why the others are missing."""
    target = "portable" if portable else "native"
    programs, versions, missing = {}, {}, {}
    rust_out, cpp_out = OUT / f"rust-{target}", OUT / f"cpp-{target}"
    env = os.environ | {"CARGO_TARGET_DIR": str(rust_out)}
    if not portable:
        env["RUSTFLAGS"] = "-C target-cpu=native"
    manifest = ["--manifest-path", str(HERE / "rust" / "Cargo.toml")]
    # Also the generator of the points: without it there is nothing to do.
    subprocess.run(["cargo", "build", "--release", *manifest], env=env, check=True)
    metadata = subprocess.run(["cargo", "metadata", "--format-version=1", *manifest], check=True, capture_output=True)
    head = subprocess.run(["git", "-C", str(HERE), "rev-parse", "--short", "HEAD"], capture_output=True, text=True)
    crates = {package["name"]: package["version"] for package in json.loads(metadata.stdout)["packages"]}
    for library in RUST:
        programs[library] = [str(rust_out / "release" / "sunfleck-peers"), "run", library]
        versions[library] = crates[library.split("-")[0]]
        if library.startswith("sunfleck") and head.returncode == 0:
            versions[library] += f" ({head.stdout.strip()})"
    arch = "ARCH=" if portable else "ARCH=-march=native"
    for library in [c for c in CPP if c in wanted]:
        program = cpp_out / library
        make = ["make", "-s", "-C", str(HERE / "cpp"), f"OUT={cpp_out}", arch, str(program)]
        made = subprocess.run(make, capture_output=True, text=True) if shutil.which("make") else None
        if made is not None and made.returncode == 0:
            programs[library] = [str(program)]
        else:
            missing[library] = first_error(made.stderr) if made else "no make"
    if "scipy" in wanted:
        probe = subprocess.run([sys.executable, "-c", "import scipy.spatial"], capture_output=True, text=True)
        if probe.returncode == 0:
            programs["scipy"] = [sys.executable, str(HERE / "scipy_peer.py")]
        else:
            missing["scipy"] = probe.stderr.strip().splitlines()[-1]
    return programs, versions, missing


def first_error(text):
    return next((line.strip() for line in text.splitlines() if "error" in line), text.strip()[-200:])


def point_sets(programs, n_shuffled):
    """Writes the points: name, to file of points and cases `name,queries,radius,k`."""
    data = OUT / "data"
    subprocess.run([programs["sunfleck"][0], "generate", str(data)], check=True)
    if n_shuffled:
        os.truncate(data / "shuffled.f32", 12 * n_shuffled)
    radius = (data / "radius").read_text()
    photons = [f"{order},{data / order}.f32,{radius},0" for order in ["camera", "shuffled"]]
    queries = data / "queries.f32"
    uniform = [f"r {r},{queries},{r},0" for r in RADII]
    uniform += [f"k {k} r {KNN_RADIUS},{queries},{KNN_RADIUS},{k}" for k in KS]
    uniform += [f"k {k},{queries},inf,{k}" for k in KS]
    return {"photons": (data / "photons.f32", photons), "uniform": (data / "samples.f32", uniform)}


def measure(program, limit, points, cases):
    env = os.environ | {"RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run([*program, str(limit), str(points), *cases], env=env, capture_output=True, text=True)
    lines = [json.loads(line) for line in run.stdout.splitlines()]
    return lines, None if run.returncode == 0 else run.stderr.strip()[-200:] or f"exit status {run.returncode}"


def check(lines):
    """Every library must find what the median of them finds."""
    wrong = set()
    for key in {(line["case"], line["queries"]) for line in lines}:
        group = [line for line in lines if (line["case"], line["queries"]) == key]
        for field in ["neighbours", "sum"]:
            having = [line for line in group if line[field] is not None]
            middle = statistics.median(line[field] for line in having)
            for line in having:
                if abs(line[field] - middle) > TOLERANCE * abs(middle):
                    wrong.add(f"{line['library']}, {line['case']}: {field} {line[field]}, the others {middle}")
    return sorted(wrong)


def device():
    names = {}
    try:
        for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
            key, _, value = line.partition(":")
            names.setdefault(key.strip(), value.strip())
    except OSError:
        pass
    load = os.getloadavg()[0]
    return f"{names.get('model name', platform.machine())}, {os.cpu_count()} CPUs, load {load:.1f} at the end"


def markdown(report, wanted):
    text = [f"{report['device']}; {report['date']}; {report['target']} build, medians of {report['rounds']} rounds; "
        f"`{report['command']}`.", ""]
    text += tables(report["measurements"], wanted)
    text += ["Versions: " + ", ".join(f"{k} {v}" for k, v in report["versions"].items() if k in wanted) + "."]
    text += [f"Missing: {library}: {why}" for library, why in report["missing"].items()]
    text += [f"DISAGREEMENT: {line}" for line in report["disagreements"]]
    text += [] if report["disagreements"] else ["Totals of neighbours and sums agree."]
    return "\n".join(text)


def tables(lines, wanted):
    cases = list(dict.fromkeys(line["case"] for line in lines))
    photons = [case for case in cases if case in ("camera", "shuffled")]
    radius = [case for case in cases if case.startswith("r ")]
    truncated = [case for case in cases if case.startswith("k ") and " r " in case]
    knn = [case for case in cases if case.startswith("k ") and " r " not in case]
    text = []
    for group, full in [(photons, True), (radius, True), (truncated, False), (knn, False)]:
        if group:
            text += [*table(lines, group, wanted, full), ""]
    return text


def table(lines, cases, wanted, full):
    """Medians, with the least and the largest, of CPU time; the peak of memory is that of the first case."""
    found = {case: statistics.median(e["neighbours"] / e["queries"] for e in lines if e["case"] == case) for case in cases}
    heads = [f"{case} ({found[case]:.3g} found), ns a query" for case in cases]
    total = full and len(cases) == 2
    heads += ["build + camera, s"] * total + ["peak MB"] * full
    text = ["| library | build ms | " + " | ".join(heads) + " |", "|---" * (len(heads) + 2) + "|"]
    for library in wanted:
        mine = {case: [e for e in lines if e["library"] == library and e["case"] == case] for case in cases}
        if not any(mine.values()):
            continue
        some = next(group for group in mine.values() if group)
        row = [TITLES[library], spread([e["build_ms"] for e in some])]
        row += [spread([e["ns_per_query"] for e in group]) if group else "not offered" for group in mine.values()]
        if total:
            both = [1e-3 * e["build_ms"] + 1e-9 * e["ns_per_query"] * e["queries"] for e in mine[cases[0]]]
            row += [f"{statistics.median(both):.2f}"]
        if full:
            row += [f"{statistics.median(e['memory_mb'] for e in some):.0f}"]
        text += ["| " + " | ".join(row) + " |"]
    return text


def spread(values):
    middle = statistics.median(values)
    return f"{middle:.0f} ({min(values):.0f}–{max(values):.0f})" if len(values) > 1 else f"{middle:.0f}"


if __name__ == "__main__":
    sys.exit(main())
