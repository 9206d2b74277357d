// SPDX-License-Identifier: MIT
// Moves a camera as src/fragtracer/apps/viewer/camera.py does, and makes its uniforms as packing/camera.py. Every
// function returns another camera. Angles are in radians; a positive `right` moves the picture to the right.
import type { Camera, Values, Vector } from "./payload";

const NEAREST_POLE = Math.PI / 180;

const add = (a: Vector, b: Vector, s = 1): Vector => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a: Vector, s: number): Vector => [a[0] * s, a[1] * s, a[2] * s];
const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - b[1] * a[2],
  a[2] * b[0] - b[2] * a[0],
  a[0] * b[1] - b[0] * a[1],
];
const length = (a: Vector): number => Math.sqrt(dot(a, a));
const unit = (a: Vector): Vector => scaled(a, 1 / length(a));

function axes(camera: Camera): [Vector, Vector, Vector] {
  const forward = unit(add(camera.target, camera.position, -1));
  const right = unit(cross(forward, camera.up));
  return [right, cross(right, forward), forward];
}

const tangent = (camera: Camera): number => Math.tan((camera.fov_degrees * Math.PI) / 360);

// Turn the scene about the target.
export function orbit(camera: Camera, right: number, down: number): Camera {
  const up = unit(camera.up);
  const arm = add(camera.position, camera.target, -1);
  const size = length(arm);
  const limit = Math.PI / 2 - NEAREST_POLE;
  const sine = Math.max(-1, Math.min(1, dot(arm, up) / size));
  const elevation = Math.max(-limit, Math.min(limit, Math.asin(sine) + down));
  const level = unit(add(arm, up, -dot(arm, up)));
  const turned = add(scaled(level, Math.cos(-right)), cross(up, level), Math.sin(-right));
  const offset = add(scaled(turned, Math.cos(elevation)), up, Math.sin(elevation));
  return { ...camera, position: add(camera.target, offset, size) };
}

// Shift the scene in the plane of the target, by parts of the picture's height.
export function pan(camera: Camera, right: number, down: number): Camera {
  const height = 2 * length(add(camera.position, camera.target, -1)) * tangent(camera);
  const [x, y] = axes(camera);
  const step = add(scaled(y, height * down), x, -height * right);
  return { ...camera, position: add(camera.position, step), target: add(camera.target, step) };
}

// Multiply the distance to the target.
export function dolly(camera: Camera, factor: number): Camera {
  const back = add(camera.position, camera.target, -1);
  const position = add(camera.target, back, factor);
  return length(scaled(back, factor)) > 1e-6 ? { ...camera, position } : camera;
}

export function uniforms(camera: Camera, origin: Vector, width: number, height: number): Record<string, Values> {
  const [x, y, forward] = axes(camera);
  const eye = add(camera.position, origin, -1);
  const high = tangent(camera);
  const [near, far] = [1, 2]; // of packing/camera.py; nothing is clipped by them
  return {
    u_inverse_view: [...x, 0, ...y, 0, ...scaled(forward, -1), 0, ...eye, 1],
    u_inverse_projection: [
      ...[(high * width) / height, 0, 0, 0],
      ...[0, high, 0, 0],
      ...[0, 0, 0, (near - far) / (2 * far * near)],
      ...[0, 0, -1, (far + near) / (2 * far * near)],
    ],
    u_lens_radius: camera.aperture_radius,
    u_focus_distance: camera.focus_distance ?? length(add(camera.target, camera.position, -1)),
    u_inverse_image_size: [1 / width, 1 / height],
  };
}

// The [camera] table of a scene file.
export function toml(camera: Camera): string {
  const number = (x: number): string => {
    const text = String(Math.fround(x) === x ? x : Number(x.toPrecision(9)));
    return /[.e]/.test(text) ? text : text + ".0";
  };
  const lines = ["[camera]"];
  for (const [name, value] of Object.entries(camera))
    if (value !== null)
      lines.push(`${name} = ${Array.isArray(value) ? `[${value.map(number).join(", ")}]` : number(value as number)}`);
  return lines.join("\n") + "\n";
}
