// SPDX-License-Identifier: MIT
// What the values of controls change: uniforms, words of u_scene, how the picture is shown. Which control changes what
// is said by the page (src/fragtracer/apps/web/controls.py).
import type { Control, Values } from "./payload";

export interface Changes {
  uniforms: Record<string, Values>;
  words: { word: number; values: number[] }[];
}

export type Settings = Record<string, number | string>;

export function changes(controls: Control[], settings: Settings): Changes {
  const result: Changes = { uniforms: {}, words: [] };
  for (const control of controls) {
    const value = Number(settings[control.id]);
    for (const { uniform, word, value: before } of control.targets) {
      if (uniform) result.uniforms[uniform] = uniformValue(control.effect, value, before);
      else result.words.push({ word: word!, values: wordValues(control.effect, value, before!) });
    }
  }
  return result;
}

const radians = (degrees: number): number => (degrees * Math.PI) / 180;

function uniformValue(effect: Control["effect"], value: number, before?: number[]): Values {
  if (effect === "turn") return [Math.cos(radians(value)), Math.sin(radians(value))];
  return effect === "scale" ? before!.map((x) => x * value) : value;
}

// A direction is turned about +y, counter-clockwise seen from above.
function wordValues(effect: Control["effect"], value: number, before: number[]): number[] {
  if (effect === "scale") return before.map((x) => x * value);
  const [c, s] = [Math.cos(radians(value)), Math.sin(radians(value))];
  const [x, y, z] = before;
  return [c * x + s * z, y, c * z - s * x];
}
