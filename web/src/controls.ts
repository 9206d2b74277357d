// SPDX-License-Identifier: MIT
// What the values of controls change: uniforms and words of tables. Which control changes what is said by the page
// (src/fragtracer/apps/web/controls.py).
import type { Control, Surface, Target, Values, Vector } from "./payload";

export interface Edit {
  table: string;
  word: number;
  values: number[];
}

export interface Changes {
  uniforms: Record<string, Values>;
  edits: Edit[];
}

export type Settings = Record<string, number | string>;

// Whether the picture must be traced again where the control has another value.
export const isTraced = ({ effect }: Control): boolean => effect !== "exposure" && effect !== "tonemap";

export function changes(controls: Control[], settings: Settings): Changes {
  const uniforms: Record<string, Values> = {};
  const edits = new Map<string, Edit>(); // several controls may scale the same words
  const put = (edit: Edit): void => void edits.set(`${edit.table} ${edit.word}`, edit);
  for (const control of controls)
    for (const target of control.targets) {
      const value = Number(settings[control.id]);
      if (target.surface) surfaceEdits(target.surface, control.object!, settings, controls).forEach(put);
      else if (target.uniform) uniforms[target.uniform] = uniformValue(control.effect, value, target.value);
      else {
        const { table = "u_scene", word = 0 } = target;
        const before = edits.get(`${table} ${word}`)?.values ?? target.value!;
        put({ table, word, values: wordValues(control.effect, value, before, target) });
      }
    }
  return { uniforms, edits: [...edits.values()] };
}

const radians = (degrees: number): number => (degrees * Math.PI) / 180;

function uniformValue(effect: Control["effect"], value: number, before?: number[]): Values {
  if (effect === "turn") return [Math.cos(radians(value)), Math.sin(radians(value))];
  return effect === "scale" ? before!.map((x) => x * value) : value;
}

// A direction is turned about +y, counter-clockwise seen from above.
function wordValues(effect: Control["effect"], value: number, before: number[], target: Target): number[] {
  if (effect === "scale") return before.map((x) => x * value ** (target.exponent ?? 1));
  const [c, s] = [Math.cos(radians(value)), Math.sin(radians(value))];
  const [x, y, z] = before;
  return [c * x + s * z, y, c * z - s * x];
}

// As shaders/material/material.glsl; a surface that has its first values is left as it came.
function surfaceEdits(surface: Surface, object: number, settings: Settings, controls: Control[]): Edit[] {
  const { words, maps, before } = surface;
  const own = controls.filter((control) => control.object === object);
  const find = (name: string): Control | undefined => own.find(({ id }) => id === `${name}-${object}`);
  const changed = (name: string): boolean => find(name) !== undefined && settings[`${name}-${object}`] !== find(name)!.value;
  const number = (name: "roughness" | "metallic"): number => (changed(name) ? Number(settings[`${name}-${object}`]) : surface[name]);
  const albedo = changed("albedo") ? linear(String(settings[`albedo-${object}`])) : surface.albedo;
  const [roughness, metallic] = [number("roughness"), number("metallic")];
  const grazing = Math.min(1, 50 * Math.max(...albedo));
  const mixed = (dielectric: Vector, metal: Vector): Vector =>
    dielectric.map((x, i) => (1 - metallic) * x + metallic * metal[i]) as Vector;
  const values = ["albedo", "roughness", "metallic"].some(changed)
    ? {
        diffuse: albedo.map((x) => (1 - metallic) * x),
        alpha: roughness ** 2,
        f0: mixed(surface.dielectric_f0, albedo),
        f90: mixed(surface.dielectric_f90, [grazing, grazing, grazing]),
      }
    : before;
  const edit = (word: number, value: number | number[]): Edit => ({
    table: "u_scene",
    word,
    values: typeof value === "number" ? [value] : value,
  });
  const result = Object.entries(words).map(([name, word]) => edit(word, values[name as keyof typeof values]));
  if (maps.albedo !== undefined) result.push(edit(maps.albedo, albedo));
  if (maps.roughness !== undefined) result.push(edit(maps.roughness, roughness));
  if (maps.metallic !== undefined) result.push(edit(maps.metallic, metallic));
  return result;
}

// IEC 61966-2-1, of "#rrggbb".
function linear(color: string): Vector {
  return [1, 3, 5].map((at) => {
    const x = parseInt(color.slice(at, at + 2), 16) / 255;
    return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
  }) as Vector;
}
