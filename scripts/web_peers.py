# SPDX-License-Identifier: MIT
"""Samples per second of a page beside three-gpu-pathtracer, on the same scene in the same browser, in turns.

Both trace paths of the same length through the same triangles and rectangles, and sample lights by both strategies. The
versions are those of web/peers/package.json (needs Node). Differences: a camera's ray does not meet their lamps.

    python scripts/web_peers.py [--pictures FOLDER] [--seconds SECONDS] [SCENE ...]
"""

import argparse
import base64
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import fragtracer as ft
from fragtracer.apps.web import page
from fragtracer.display.look import Look

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from chromium import DRIVERS, Chromium
from web_numbers import SIZE, TURNS, samples_for, seconds_of_page

PEERS = Path(__file__).parents[1] / "web" / "peers"
PLANE = 50.0  # half the side of a square in place of a plane


def script() -> str:
    """Their path tracer and page.js in one file."""
    subprocess.run(["npm", "ci", "--legacy-peer-deps"], cwd=PEERS, check=True, capture_output=True)
    command = [PEERS / "node_modules" / ".bin" / "esbuild", "page.js", "--bundle", "--minify", "--charset=utf8"]
    return subprocess.run(command, cwd=PEERS, check=True, capture_output=True, text=True).stdout


def quad(corner, edge_u, edge_v):
    corner, edge_u, edge_v = np.array(corner), np.array(edge_u), np.array(edge_v)
    return np.array([corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v]), [[0, 1, 2], [0, 2, 3]], None


def plane(shape):
    normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
    u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    return quad(np.array(shape.point) - PLANE * (u + v), 2 * PLANE * u, 2 * PLANE * v)


def placed(matrix, geometry):
    normals = None if geometry.normals is None else geometry.normals @ np.linalg.inv(matrix[:3, :3])
    return geometry.positions @ matrix[:3, :3].T + matrix[:3, 3], geometry.triangles, normals


def described(scene):
    """A scene of meshes, planes, rectangles and ambient light for page.js."""
    objects, lamps = [], []

    def add(name, positions, triangles, normals):
        material = scene.materials[name]
        is_metal = material.metal is not None
        objects.append(
            {
                "positions": np.ravel(positions).tolist(),
                "triangles": np.ravel(triangles).tolist(),
                "normals": None if normals is None else np.ravel(normals).tolist(),
                "color": list(material.specular_f0 if is_metal else material.base_color),
                "roughness": material.roughness,
                "metalness": 1 if is_metal else 0,
                "specular": 1 if max(material.specular_f0) > 0 else 0,
            }
        )

    for shape in scene.planes:
        add(shape.material, *plane(shape))
    for shape in scene.rectangles:
        edges = {name: list(getattr(shape, name)) for name in ("corner", "edge_u", "edge_v")}
        if scene.materials[shape.material].is_emissive:
            lamps.append({**edges, "radiance": list(scene.materials[shape.material].emission)})
        else:
            add(shape.material, *quad(**edges))
    for mesh in scene.meshes:
        for matrix, part in mesh.placed():
            add(mesh.material_of(part), *placed(matrix, part.geometry))
    camera = {name: getattr(scene.camera, name) for name in ("position", "target", "fov_degrees")}
    ambient = list(scene.ambient.radiance) if scene.ambient else None
    size = {"width": SIZE[0], "height": SIZE[1], "bounces": scene.render.bounces}
    return {**size, "camera": camera, "ambient": ambient, "objects": objects, "lamps": lamps}


def seconds_of_peer(browser, spp):
    return browser.run(f"trace({spp})", 300)


def best_rate(seconds_of, browser, seconds):
    """Million samples per second, the best of some turns, each of about so many seconds."""
    spp = samples_for(seconds, lambda spp: seconds_of(browser, spp))
    return max(SIZE[0] * SIZE[1] * spp / seconds_of(browser, spp) for _ in range(TURNS)) / 1e6


def picture(text, path):
    texels = np.frombuffer(base64.b64decode(text), np.float32).reshape(SIZE[1], SIZE[0], 4)[::-1, :, :3]
    print(f"{path.name}: mean {texels.mean(axis=(0, 1))}")
    Image.fromarray(np.uint8(255 * Look().show(np.ascontiguousarray(texels)))).save(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=["cornell-box", "knot"])
    parser.add_argument("--driver", choices=DRIVERS, default="mesa")
    parser.add_argument("--seconds", type=float, default=3.0, help="of a turn")
    parser.add_argument("--pictures", type=Path, help="a folder for what both have rendered")
    arguments = parser.parse_args()
    theirs = script()
    print("| scene | page M samples/s | three-gpu-pathtracer M samples/s | ratio |\n| --- | ---: | ---: | ---: |")
    with Chromium(arguments.driver) as browser, tempfile.TemporaryDirectory() as there:
        browser.resize(400, 400)
        for name in arguments.scenes:
            scene = ft.load(name)
            ours, peer = (Path(there) / file for file in ("page.html", "peer.html"))
            ours.write_text(page(scene, SIZE, 1).text, encoding="utf-8")
            data = json.dumps(described(scene))
            text = (
                f'<!DOCTYPE html><meta charset="utf-8"><body><script>scene = {data}</script><script>{theirs}</script>'
            )
            peer.write_text(text, encoding="utf-8")
            browser.open(ours)
            browser.wait("window.fragtracer && fragtracer.live.shown", 120)
            page_rate = best_rate(seconds_of_page, browser, arguments.seconds)
            if arguments.pictures:
                picture(
                    browser.run(f"fragtracer.trace({SIZE[0]}, {SIZE[1]}, 64, 0)")[0],
                    arguments.pictures / f"{name}-page.png",
                )
            browser.open(peer)
            browser.wait("window.trace", 120)
            peer_rate = best_rate(seconds_of_peer, browser, arguments.seconds)
            if arguments.pictures:
                picture(browser.run("film()"), arguments.pictures / f"{name}-peer.png")
            print(f"| {name} | {page_rate:.3f} | {peer_rate:.4f} | {page_rate / peer_rate:.1f} |", flush=True)


if __name__ == "__main__":
    main()
