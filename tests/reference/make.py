"""Makes the reference pictures of tests/it/reference.rs with another renderer: Mitsuba 3's path tracer.

    pip install mitsuba numpy          # 3.9.1 made the committed files; the LLVM variant needs an LLVM library
    python tests/reference/make.py     # all of them, some minutes on two cores
    python tests/reference/make.py cornell --renders 4

Each NAME.json beside this file describes a scene once, for Mitsuba here and for Sunfleck in the test; NAME.exr is the
result: R, G, B, the mean of `renders` independent pictures of `spp` samples a pixel, and variance.R, variance.G,
variance.B, the estimated variance of that mean. No roulette, no clamping, no denoising, box filter one pixel wide.

The scene
    width, height, segments         picture; longest path from lamp to lens, counted in straight pieces
    camera                          position, target, up, vfov in degrees; square pixels
    meshes[]                        vertices and faces (counter-clockwise seen from the front), or sphere: center, radius;
                                    material; emission, the radiance of the front
    materials, by "type"            diffuse (rgb, both sides), glass (ior, absorption in 1/m; smooth), mirror (white)
    lights[]                        point (position, intensity in cd), directional (direction of travel, illuminance in lux)
    environment                     width, height, rotation (radians about +y), rgb (row 0 is +y): bilinear between texel
                                    centres, u = 1/2 + atan2(z, x)/2pi before the rotation, v = acos(y)/pi

Only materials that mean exactly the same to both programs are here. Rough metal, coats and rough glass are not: Sunfleck
has Schlick's Fresnel term with glTF's colours, makes up for multiple scattering and correlates masking with shadowing.
"""

import argparse
import json
import math
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent


def rgb(value):
    return {"type": "rgb", "value": [float(v) for v in value]}


def bsdf(m):
    if m["type"] == "diffuse":
        return {"type": "twosided", "nested": {"type": "diffuse", "reflectance": rgb(m["rgb"])}}
    if m["type"] == "glass":
        return {"type": "dielectric", "int_ior": float(m["ior"]), "ext_ior": 1.0}
    if m["type"] == "mirror":
        return {"type": "twosided", "nested": {"type": "conductor", "material": "none"}}
    raise SystemExit(f"unknown material {m['type']!r}")


def ply(mi, path, mesh):
    """Corners are split: faces stay flat."""
    faces = np.asarray(mesh["faces"], np.uint32)
    corners = np.asarray(mesh["vertices"], np.float32)[faces.ravel()]
    out = mi.Mesh("mesh", vertex_count=len(corners), face_count=len(faces))
    parameters = mi.traverse(out)
    parameters["vertex_positions"] = corners.ravel()
    parameters["faces"] = np.arange(faces.size, dtype=np.uint32)
    parameters.update()
    out.write_ply(str(path))


def environment(mi, e):
    """The map as Sunfleck defines it, so finely that Mitsuba's own interpolation and placing of texels do not matter."""
    width, height = 1024, 513
    coarse = np.asarray(e["rgb"], float).reshape(e["height"], e["width"], 3)
    # Mitsuba: texel (i, j) at u = (i + 1/2)/w, v = j/(h - 1), and direction (sin 2pi u, cos pi v, -cos 2pi u).
    phi = 2 * math.pi * (np.arange(width) + 0.5) / width
    theta = math.pi * np.arange(height) / (height - 1)
    x, z = np.sin(phi), -np.cos(phi)
    c, s = math.cos(e["rotation"]), math.sin(e["rotation"])
    u = 0.5 + np.arctan2(s * x + c * z, c * x - s * z) / (2 * math.pi)
    px, py = u * e["width"] - 0.5, theta / math.pi * e["height"] - 0.5
    i, j = np.floor(px).astype(int), np.floor(py).astype(int)
    fx, fy = (px - i)[None, :, None], (py - j)[:, None, None]

    def texel(i, j):
        return coarse[np.clip(j, 0, e["height"] - 1)][:, i % e["width"]]

    low = texel(i, j) * (1 - fx) + texel(i + 1, j) * fx
    high = texel(i, j + 1) * (1 - fx) + texel(i + 1, j + 1) * fx
    fine = low * (1 - fy) + high * fy
    return {"type": "envmap", "bitmap": mi.Bitmap(fine.astype(np.float32))}


def build(mi, scene, folder):
    T = mi.ScalarTransform4f
    camera = scene["camera"]
    absorbs = any("absorption" in m["material"] for m in scene["meshes"])
    out = {
        "type": "scene",
        "integrator": {
            "type": "volpath" if absorbs else "path",
            "max_depth": scene["segments"],
            "rr_depth": 1 << 20,
            "hide_emitters": False,
        },
        "sensor": {
            "type": "perspective",
            "fov": float(camera["vfov"]),
            "fov_axis": "y",
            "near_clip": 1e-4,
            "far_clip": 1e5,
            "to_world": T().look_at(origin=camera["position"], target=camera["target"], up=camera["up"]),
            "film": {
                "type": "hdrfilm",
                "width": scene["width"],
                "height": scene["height"],
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "independent"},
        },
    }
    for k, mesh in enumerate(scene["meshes"]):
        if "sphere" in mesh:
            shape = {"type": "sphere", "center": mesh["sphere"]["center"], "radius": float(mesh["sphere"]["radius"])}
        else:
            path = folder / f"{k}.ply"
            ply(mi, path, mesh)
            shape = {"type": "ply", "filename": str(path), "face_normals": True}
        shape["bsdf"] = bsdf(mesh["material"])
        if "absorption" in mesh["material"]:
            absorption = mesh["material"]["absorption"]
            # Mitsuba takes colours in [0, 1] and a factor.
            most = max(absorption)
            density = {"sigma_t": rgb(a / most for a in absorption), "scale": most}
            shape["interior"] = {"type": "homogeneous", "albedo": 0.0, **density}
        if "emission" in mesh:
            shape["emitter"] = {"type": "area", "radiance": rgb(mesh["emission"])}
        out[f"shape{k}"] = shape
    for k, light in enumerate(scene.get("lights", [])):
        if light["type"] == "point":
            out[f"light{k}"] = {"type": "point", "position": light["position"], "intensity": rgb(light["intensity"])}
        else:
            illuminance = rgb(light["illuminance"])
            out[f"light{k}"] = {"type": "directional", "direction": light["direction"], "irradiance": illuminance}
    if "environment" in scene:
        out["environment"] = environment(mi, scene["environment"])
    return mi.load_dict(out)


def make(mi, name, renders, spp):
    scene = json.loads((HERE / f"{name}.json").read_text())
    with tempfile.TemporaryDirectory() as folder:
        built = build(mi, scene, Path(folder))
        pictures = []
        for seed in range(renders):
            picture = np.array(mi.render(built, spp=spp, seed=seed), np.float64)[..., :3]
            if not np.isfinite(picture).all():
                raise SystemExit(f"{name}: render {seed} has values that are not finite")
            pictures.append(picture)
    mean, variance = np.mean(pictures, 0), np.var(pictures, 0, ddof=1) / renders
    channels = ["R", "G", "B", "variance.R", "variance.G", "variance.B"]
    bitmap = mi.Bitmap(np.concatenate([mean, variance], -1).astype(np.float32), mi.Bitmap.PixelFormat.MultiChannel, channels)
    metadata = bitmap.metadata()
    metadata["comments"] = f"Mitsuba {mi.__version__}, {renders} renders of {spp} samples a pixel, {scene['segments']} segments"
    metadata["renders"] = renders
    bitmap.write(str(HERE / f"{name}.exr"))
    of_means = np.mean(pictures, (1, 2))
    error = of_means.std(0, ddof=1) / math.sqrt(renders)
    noise = np.sqrt(np.median(variance, (0, 1))) / np.median(mean, (0, 1))
    print(f"{name}: mean {of_means.mean(0)} +- {error}, error of a pixel {noise}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="all scenes if none is named")
    parser.add_argument("--renders", type=int, default=64)
    parser.add_argument("--spp", type=int, default=192)
    parser.add_argument("--variant", default="llvm_ad_rgb", help="or scalar_rgb, which needs no LLVM")
    arguments = parser.parse_args()
    import mitsuba as mi

    mi.set_variant(arguments.variant)
    for name in arguments.names or sorted(p.stem for p in HERE.glob("*.json")):
        make(mi, name, arguments.renders, arguments.spp)
    return 0


if __name__ == "__main__":
    sys.exit(main())
