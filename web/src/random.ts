// SPDX-License-Identifier: MIT
// The random-vector texture (src/fragtracer/packing/random_texture.py), bit for bit, so that its megabyte need not be
// sent: Owen-scrambled nets, scrambled by the numbers of numpy's PCG64.
import type { Header } from "./payload";

const MULTIPLIER = 0x2360ed051fc65da44385df649fccf645n;
const WORD = (1n << 64n) - 1n;

// O'Neill 2014, PCG: a 128-bit congruential generator with the output XSL-RR, whose 64 bits numpy hands out as two
// words, the lower first.
class Pcg64 {
  private readonly words = new Uint32Array(2);
  private left = 0;

  constructor(
    private state: bigint,
    private readonly increment: bigint,
  ) {}

  word(): number {
    if (this.left === 0) {
      this.state = BigInt.asUintN(128, this.state * MULTIPLIER + this.increment);
      const turn = this.state >> 122n;
      const folded = (this.state >> 64n) ^ (this.state & WORD);
      const output = (folded >> turn) | ((folded << (64n - turn)) & WORD);
      this.words[0] = Number(output & 0xffffffffn);
      this.words[1] = Number(output >> 32n);
      this.left = 2;
    }
    return this.words[2 - this.left--];
  }

  // Whole numbers below 2^bits; of 0 bits, none is drawn.
  fill(count: number, bits: number): Uint32Array {
    const result = new Uint32Array(count);
    if (bits > 0) for (let i = 0; i < count; i++) result[i] = this.word() >>> (32 - bits);
    return result;
  }
}

// RGBA texels of all layers, each coordinate plus one.
export function randomTexture(recipe: Header["random"]): Float32Array {
  const { directions, bits, width, layers, group } = recipe;
  const count = width * width;
  const pointBits = Math.log2(count);
  const random = new Pcg64(BigInt(recipe.state), BigInt(recipe.increment));
  const point = (index: number, dimension: number) =>
    directions[dimension].reduce((sum, direction, bit) => ((index >>> bit) & 1 ? sum ^ direction : sum), 0);
  const index = Uint32Array.from({ length: count }, (_, i) => i);
  const result = new Float32Array(layers * count * 4);
  const points = new Uint32Array(count * 4);
  let order: Uint32Array = index;
  for (let layer = 0; layer < layers; layer++) {
    if (layer % group === 0) order = scrambled(index, 1, pointBits, pointBits, random);
    for (let i = 0; i < points.length; i++) points[i] = point(order[i >>> 2], 4 * (layer % group) + (i & 3));
    const shuffled = scrambled(points, 4, bits, pointBits, random);
    const first = layer * count * 4;
    for (let i = 0; i < shuffled.length; i++) result[first + i] = 1 + shuffled[i] / 2 ** bits;
  }
  return result;
}

// Nested uniform scrambling of each column of `values`, rows of so many `columns`.
function scrambled(values: Uint32Array, columns: number, bits: number, pointBits: number, random: Pcg64): Uint32Array {
  const lower = bits - pointBits;
  const result = random.fill(values.length, lower);
  const nodes = 2 ** pointBits - 1;
  const coins = random.fill(columns * nodes, 1);
  for (let i = 0; i < values.length; i++) {
    const upper = values[i] >>> lower;
    const first = (i % columns) * nodes;
    let flips = 0;
    for (let level = 0; level < pointBits; level++) {
      const above = upper >>> (pointBits - level);
      flips = (flips << 1) | coins[first + 2 ** level - 1 + above];
    }
    result[i] |= ((upper ^ flips) << lower) >>> 0;
  }
  return result;
}
