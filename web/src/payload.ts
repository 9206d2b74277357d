// SPDX-License-Identifier: MIT
// What the page brings along: a JSON header and the arrays that it names, compressed and in base64.
// src/fragtracer/apps/web/payload.py writes it.

export type Vector = [number, number, number];
export type Values = number | number[];

export interface Part {
  offset: number; // bytes from the end of the header
  length: number; // bytes
  stride: number; // of interleaved bytes; 0: they lie as they are
}

export interface Table {
  name: string; // of the sampler
  kind: "uint" | "float" | "half" | "byte";
  size: [number, number, number] | null; // width, height and layers of an array of layers; null: folded texels
  parts: Part[]; // each begins a row of a folded texture
}

export interface Camera {
  position: Vector;
  target: Vector;
  up: Vector;
  fov_degrees: number;
  aperture_radius: number;
  focus_distance: number | null;
}

// A metallic-roughness material: words of u_scene of its record and of that of its textures, and what is in them.
export interface Surface {
  words: Record<"diffuse" | "alpha" | "f0" | "f90", number>;
  maps: Partial<Record<"albedo" | "roughness" | "metallic", number>>;
  before: { diffuse: Vector; alpha: number; f0: Vector; f90: Vector };
  albedo: Vector;
  roughness: number;
  metallic: number;
  dielectric_f0: Vector;
  dielectric_f90: Vector;
}

// What a control changes: a uniform, a run of words of a table, or a surface.
export interface Target {
  uniform?: string;
  table?: string; // u_scene if it is left out
  word?: number;
  value?: number[]; // what it is without the control
  exponent?: number; // of the factor of "scale"; 1 if it is left out
  surface?: Surface;
}

export interface Control {
  id: string;
  label: string;
  effect: "set" | "turn" | "scale" | "surface" | "exposure" | "tonemap";
  value: number | string;
  min?: number;
  max?: number;
  step?: number;
  choices?: string[];
  unit?: string;
  targets: Target[];
  object?: number; // the material that it belongs to
  name?: string; // of that material
}

// What depends on how shapes are stored: where a CPU renders, more of them are tested one by one.
export interface Stored {
  constants: [number, string][]; // lines of the fragment shader with the scene compiled in, for renderers in software
  path_rounds: number; // of all loops along one path, by the first settings
  uniforms: Record<string, Values>;
  tables: Table[];
  controls: Control[];
}

export interface Header extends Stored {
  file: string; // the name of the scene, for files
  seed: number;
  vertex: string;
  fragment: string;
  pick: string; // takes the place of the outputs and main() of `fragment`
  display: string;
  software?: Stored; // if it differs
  random: { state: string; increment: string; directions: number[][]; bits: number; width: number; layers: number; group: number };
  camera: Camera;
  origin: Vector;
}

export interface Payload {
  header: Header;
  bytes(part: Part): Uint8Array;
}

export async function decode(base64: string, isSoftware: boolean): Promise<Payload> {
  const packed = Uint8Array.from(atob(base64.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const whole = await new Response(stream).arrayBuffer();
  const length = new DataView(whole).getUint32(0, true);
  const header: Header = JSON.parse(new TextDecoder().decode(new Uint8Array(whole, 4, length)));
  if (isSoftware) Object.assign(header, header.software);
  const bytes = (part: Part): Uint8Array => {
    const stored = new Uint8Array(whole, 4 + length + part.offset, part.length);
    return part.stride ? interleaved(stored, part.stride) : stored.slice();
  };
  return { header, bytes };
}

// Undoes the order in which byte 0 of all items of `stride` bytes comes first, then byte 1 of all.
function interleaved(stored: Uint8Array, stride: number): Uint8Array {
  const result = new Uint8Array(stored.length);
  const count = stored.length / stride;
  for (let byte = 0; byte < stride; byte++) {
    const first = byte * count;
    for (let i = 0, at = byte; i < count; i++, at += stride) result[at] = stored[first + i];
  }
  return result;
}
