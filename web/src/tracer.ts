// SPDX-License-Identifier: MIT
// The path tracing program with its scene, as src/fragtracer/gpu/tracer.py: passes cut into bands by measured time.
import { Film, SAMPLERS } from "./film";
import { type Gl, Program, finished, isSoftware, newTexture, targetOf } from "./gl";
import type { Edit } from "./controls";
import type { Header, Payload, Table, Values } from "./payload";
import { randomTexture } from "./random";

const WIDTH = 4096; // of a folded texture, as shaders/scene/storage.glsl has it
const FIRST_BAND = 4096; // pixel samples
const BLOCK_ROWS = 4; // drivers shade pixels in blocks, which a band should not cut
const MOST_GROWTH = 4; // of a band over the one before
const MOST_RAYS = 64; // of a pixel in a pass
const MOST_ROUNDS = 65000; // of all loops in a draw; llvmpipe stops a shader after 65,535
// Seconds that a band is meant to take: the page, too, is drawn by this device.
const BUDGET = { gpu: 0.012, software: 0.1 };
const IN_FLIGHT = 2; // bands, so that the device does not wait for the page

// When a band was found finished.
interface End {
  isGood: boolean;
  time: number;
  isLate: boolean; // a hidden page hears late of it
}

export class Tracer {
  speed = 0; // pixel samples per second by the last band; 0: not known yet
  seconds = 0; // that all bands so far have taken
  readonly isSoftware: boolean;
  private program!: Program;
  private general: Promise<Program> | null = null; // the program that reads the whole scene from textures
  private readonly textures = new Map<string, WebGLTexture>();
  private readonly dummies = new Map<number, WebGLTexture>();
  private readonly words: Record<string, Uint32Array>; // of tables that may change
  private picker: Promise<Program> | null = null;
  private uniforms: Record<string, Values>;
  private pending: { end: Promise<End>; samples: number; start: number }[] = [];
  private last = 0; // when the last band was found finished

  constructor(
    private readonly gl: Gl,
    private readonly header: Header,
    payload: Payload,
  ) {
    this.isSoftware = isSoftware(gl);
    this.uniforms = { ...header.uniforms, u_has_work: 0, u_stage: 0 };
    for (const table of header.tables) this.textures.set(table.name, this.upload(table, payload));
    const words = (name: string): Uint32Array => {
      const table = header.tables.find((known) => known.name === name);
      return new Uint32Array(table ? (payload.bytes(table.parts[0]).buffer as ArrayBuffer) : []);
    };
    this.words = { u_scene: words("u_scene"), u_shapes: words("u_shapes") };
    this.textures.set("u_random_texture", this.uploadRandom());
  }

  // Compiles; with what the scene holds as constants where a CPU renders, as on the desktop.
  async start(): Promise<void> {
    const lines = this.header.fragment.split("\n");
    if (this.isSoftware) for (const [line, text] of this.header.constants) lines[line] = text;
    this.program = await Program.compiled(this.gl, this.header.vertex, lines.join("\n"));
  }

  set(uniforms: Record<string, Values>): void {
    Object.assign(this.uniforms, uniforms);
  }

  // Other values for words of tables. Constants have no place for them: the program is then the general one.
  async edit(edits: Edit[]): Promise<void> {
    const changed = edits.filter(({ table, word, values }) => {
      const floats = new Float32Array(this.words[table].buffer);
      return values.some((value, i) => floats[word + i] !== Math.fround(value));
    });
    if (!changed.length) return;
    for (const { table, word, values } of changed) new Float32Array(this.words[table].buffer).set(values, word);
    for (const table of new Set(changed.map((edit) => edit.table)))
      this.put(this.textures.get(table)!, "uint", new Uint8Array(this.words[table].buffer), 0);
    if (this.isSoftware) {
      this.general ??= Program.compiled(this.gl, this.header.vertex, this.header.fragment);
      const program = await this.general;
      if (program !== this.program) this.speed = 0;
      this.program = program;
    }
  }

  // The number of the material that is seen in a place, in [-1, 1]^2 with y up, or -1.
  async pick(place: [number, number], view: Record<string, Values>): Promise<number> {
    const { gl, header } = this;
    const { fragment, vertex } = header;
    const head = fragment.slice(0, fragment.lastIndexOf("OUTPUT(0)"));
    this.picker ??= Program.compiled(gl, vertex, head + header.pick);
    const program = await this.picker;
    const texture = newTexture(gl, gl.TEXTURE_2D);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, 1, 1);
    const framebuffer = gl.createFramebuffer()!;
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.viewport(0, 0, 1, 1);
    gl.disable(gl.SCISSOR_TEST);
    program.use();
    program.set({ ...this.uniforms, ...view, u_place: place });
    this.bind(program, []);
    program.draw();
    const found = new Float32Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, found);
    gl.deleteFramebuffer(framebuffer);
    gl.deleteTexture(texture);
    return found[0];
  }

  // How many paths a pass should have at most, and, so that it takes so many seconds: several in one draw keep more
  // lanes busy (path regeneration).
  rays(film: Film, seconds = Infinity): number {
    const most = this.isSoftware ? Math.max(1, Math.floor(MOST_ROUNDS / this.rounds)) : MOST_RAYS;
    const wanted = seconds === Infinity ? most : (this.speed * seconds) / (film.width * film.height);
    return Math.max(1, Math.floor(Math.min(MOST_RAYS, most, wanted)));
  }

  // Of all loops along one path, at most: they grow with its vertices, and at each with the samples of lights
  // (src/fragtracer/packing/__init__.py).
  private get rounds(): number {
    const growth = (name: string, others: number): number =>
      Math.max(1, (Number(this.uniforms[name]) + others) / (Number(this.header.uniforms[name]) + others));
    return this.header.path_rounds * growth("u_bounces", 2) * growth("u_light_samples", 1);
  }

  // Draw `rays` paths for every pixel; `goesOn` is asked before each band, and may let it wait. False if the pass was
  // given up: the film then keeps what it had.
  async pass(film: Film, rays: number, goesOn: () => Promise<boolean>): Promise<boolean> {
    let row = 0;
    while (row < film.height) {
      if (!(await goesOn())) return false;
      const rows = Math.min(this.rows(film.width * rays), film.height - row);
      this.draw(film, rays, row, rows);
      const samples = film.width * rows * rays;
      const end = finished(this.gl).then((isGood) => ({ isGood, time: performance.now(), isLate: document.hidden }));
      this.pending.push({ end, samples, start: performance.now() });
      if (this.pending.length >= IN_FLIGHT && !(await this.learn())) return false;
      row += rows;
    }
    film.swap(rays);
    return true;
  }

  // Until nothing is being drawn.
  async settle(): Promise<void> {
    while (this.pending.length) await this.learn();
  }

  private get budget(): number {
    return this.isSoftware ? BUDGET.software : BUDGET.gpu;
  }

  private rows(pixelSamplesPerRow: number): number {
    const rows = Math.max(1, Math.floor(Math.max(FIRST_BAND, this.speed * this.budget) / pixelSamplesPerRow));
    return rows < BLOCK_ROWS ? rows : rows - (rows % BLOCK_ROWS);
  }

  private draw(film: Film, rays: number, row: number, rows: number): void {
    this.program.use();
    this.program.set({ ...this.uniforms, u_rays: rays });
    this.bind(this.program, film.textures);
    film.useBack(row, rows);
    this.program.draw();
  }

  private bind(program: Program, film: WebGLTexture[]): void {
    const gl = this.gl;
    program.samplers.forEach(({ name, type }, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      const texture = this.textures.get(name) ?? film[SAMPLERS.indexOf(name)] ?? this.dummy(type);
      gl.bindTexture(targetOf(gl, type), texture);
    });
  }

  private async learn(): Promise<boolean> {
    const { end, samples, start } = this.pending.shift()!;
    const { isGood, time, isLate } = await end;
    const seconds = Math.max(time - Math.max(start, this.last), 0.1) / 1000;
    this.last = time;
    if (isLate) return isGood;
    this.seconds += seconds;
    const before = Math.max(this.speed, FIRST_BAND / this.budget);
    this.speed = Math.min(samples / seconds, MOST_GROWTH * before);
    return isGood;
  }

  private upload(table: Table, payload: Payload): WebGLTexture {
    const gl = this.gl;
    const [internal] = this.format(table.kind);
    if (table.size) {
      const texture = newTexture(gl, gl.TEXTURE_2D_ARRAY);
      const [width, height, layers] = table.size;
      gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, internal, width, height, layers);
      const [, format, type] = this.format(table.kind);
      const data = this.view(table.kind, payload.bytes(table.parts[0]));
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, width, height, layers, format, type, data);
      return texture;
    }
    const parts = table.parts.map((part) => payload.bytes(part));
    const size = { uint: 16, float: 16, half: 8, byte: 4 }[table.kind]; // bytes of a texel
    const rows = parts.map((part) => Math.max(1, Math.ceil(part.length / size / WIDTH)));
    const texture = newTexture(gl, gl.TEXTURE_2D);
    gl.texStorage2D(gl.TEXTURE_2D, 1, internal, WIDTH, rows.reduce((a, b) => a + b));
    let row = 0;
    parts.forEach((part, i) => {
      this.put(texture, table.kind, part, row);
      row += rows[i];
    });
    return texture;
  }

  // Texels from the beginning of a row on.
  private put(texture: WebGLTexture, kind: Table["kind"], bytes: Uint8Array, row: number): void {
    const gl = this.gl;
    const [, format, type] = this.format(kind);
    const data = this.view(kind, bytes);
    const whole = Math.floor(data.length / 4 / WIDTH);
    const rest = data.length / 4 - whole * WIDTH;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    if (whole) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, WIDTH, whole, format, type, data, 0);
    if (rest) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row + whole, rest, 1, format, type, data, 4 * WIDTH * whole);
  }

  private format(kind: Table["kind"]): [number, number, number] {
    const gl = this.gl;
    if (kind === "uint") return [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT];
    if (kind === "byte") return [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE];
    return kind === "half" ? [gl.RGBA16F, gl.RGBA, gl.HALF_FLOAT] : [gl.RGBA32F, gl.RGBA, gl.FLOAT];
  }

  private view(kind: Table["kind"], bytes: Uint8Array): Uint8Array | Uint16Array | Uint32Array | Float32Array {
    const types = { uint: Uint32Array, float: Float32Array, half: Uint16Array, byte: Uint8Array };
    return new types[kind](bytes.buffer as ArrayBuffer);
  }

  private uploadRandom(): WebGLTexture {
    const gl = this.gl;
    const { width, layers } = this.header.random;
    const texture = newTexture(gl, gl.TEXTURE_3D);
    gl.texStorage3D(gl.TEXTURE_3D, 1, gl.RGBA32F, width, width, layers);
    const points = randomTexture(this.header.random);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, width, width, layers, gl.RGBA, gl.FLOAT, points);
    return texture;
  }

  // For a sampler that this scene does not use: WebGL wants one of its kind all the same.
  private dummy(sampler: number): WebGLTexture {
    const gl = this.gl;
    const known = this.dummies.get(sampler);
    if (known) return known;
    const target = targetOf(gl, sampler);
    const texture = newTexture(gl, target);
    const internal = sampler === gl.UNSIGNED_INT_SAMPLER_2D ? gl.RGBA32UI : gl.RGBA8;
    if (target === gl.TEXTURE_2D) gl.texStorage2D(target, 1, internal, 1, 1);
    else gl.texStorage3D(target, 1, internal, 1, 1, 1);
    this.dummies.set(sampler, texture);
    return texture;
  }
}
