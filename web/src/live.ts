// SPDX-License-Identifier: MIT
// Draws for as long as nothing changes: after a change coarsely first, so that it is seen at once, then finer.
import * as cameras from "./camera";
import { type Settings, changes, isTraced } from "./controls";
import { Display } from "./display";
import { Film } from "./film";
import { ContextLost, type Gl, pause } from "./gl";
import type { Camera, Payload } from "./payload";
import { Tracer } from "./tracer";

const PREVIEW = 0.06; // seconds that the first, coarse picture after a change is meant to take
const PASS = 0.5; // seconds that any other picture is meant to take at most
const COARSEST = 8; // pixels a side that share one of it
const MOVING = 150; // milliseconds after a change in which there is no finer picture
const SHOWN = 50; // milliseconds between two drawings of the canvas
const METERED = 1000; // milliseconds between two measurements of the error
const MOST_PIXELS = 2_100_000; // of the picture
const MOST_SAMPLES = 2 ** 24; // of a pixel, as src/fragtracer/films.py
const GOOD = { error: 0.005, least: 16, most: 4096 }; // the error and the samples of a pixel at which a picture rests

export interface State {
  samples: number;
  seconds: number;
  error: number;
  speed: number; // pixel samples per second
}

export class Live {
  camera: Camera;
  settings: Settings;
  paused = false;
  rests = true; // once the picture is good, and not only where a film can count no more samples; again after a change
  gl!: Gl;
  tracer!: Tracer;
  shown: Film | null = null;
  onFrame: (state: State, isCoarse: boolean) => void = () => {};
  onLoss: (isLost: boolean) => void = () => {};
  private display!: Display;
  private films = new Map<number, Film>(); // by how many pixels a side share one of its texels
  private version = 0; // of camera and settings
  private drawn = -1; // the version that the films are of
  private changed = 0; // when
  private isOn = true; // the canvas can be seen
  private isReady = false; // the context holds all that is needed
  private wake: () => void = () => {};
  private state: State = { samples: 0, seconds: 0, error: Infinity, speed: 0 };
  private begun = 0; // when the picture was, in the seconds of the tracer
  private lastShown = 0;
  private lastMetered = 0;

  constructor(
    gl: Gl,
    private readonly payload: Payload,
  ) {
    this.use(gl);
    this.camera = payload.header.camera;
    this.settings = Object.fromEntries(payload.header.controls.map(({ id, value }) => [id, value]));
  }

  // Draw by this context from now on.
  use(gl: Gl): void {
    this.gl = gl;
    this.isReady = false;
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // then it comes back
      if (gl !== this.gl) return;
      this.isReady = false;
      this.onLoss(true);
      this.wake();
    });
    this.canvas.addEventListener("webglcontextrestored", () => this.wake());
    this.wake();
  }

  get canvas(): HTMLCanvasElement {
    return this.gl.canvas as HTMLCanvasElement;
  }

  // Whether no more is traced until something changes.
  get isDone(): boolean {
    const { samples, error } = this.state;
    const isGood = this.rests && samples >= GOOD.least && error <= GOOD.error;
    return this.drawn === this.version && (isGood || samples >= this.most);
  }

  // Compile and upload everything, again after the context was lost.
  private async start(): Promise<void> {
    const { header } = this.payload;
    this.gl.getExtension("EXT_color_buffer_float");
    this.films.clear();
    this.shown = null;
    this.tracer = new Tracer(this.gl, header, this.payload);
    this.display = new Display(this.gl, header.vertex, header.display);
    await Promise.all([this.tracer.start(), this.display.prepare(this.tonemap)]);
    this.drawn = -1;
    this.isReady = true;
  }

  // Settings that are left out stay as they are. Whether it takes another picture.
  set(camera: Camera, changed: Settings): boolean {
    const settings = { ...this.settings, ...changed };
    const traced = this.payload.header.controls.some((control) => isTraced(control) && settings[control.id] !== this.settings[control.id]);
    const shown = this.tonemap !== settings.tonemap;
    const moved = JSON.stringify(camera) !== JSON.stringify(this.camera);
    this.camera = camera;
    this.settings = settings;
    if (traced || moved) this.restart();
    if (shown) void this.display.prepare(this.tonemap).then(() => this.show());
    else if (!traced) this.show();
    return traced || moved;
  }

  restart(): void {
    this.version++;
    this.rests = true;
    this.changed = performance.now();
    this.wake();
  }

  setOn(isOn: boolean): void {
    this.isOn = isOn;
    this.wake();
  }

  setPaused(paused: boolean): void {
    this.paused = paused;
    this.wake();
  }

  // Draw for as long as the page is there.
  async run(): Promise<void> {
    for (;;) {
      const { gl } = this;
      if (!this.isOn || gl.isContextLost()) await this.woken();
      else
        await this.draw().catch((error: unknown) => {
          if (!(error instanceof ContextLost || gl.isContextLost())) throw error;
        });
    }
  }

  // Until something changes.
  private async draw(): Promise<void> {
    if (!this.isReady) {
      await this.start();
      this.onLoss(false);
    }
    const version = this.version;
    if (this.drawn !== version) await this.begin(version);
    const goesOn = async (): Promise<boolean> => {
      const isValid = (): boolean => version === this.version && this.isReady;
      while (isValid() && (this.paused || !this.isOn || this.isDone)) await this.woken();
      return isValid();
    };
    await this.refine(goesOn);
  }

  // The film after `spp` samples of each pixel of a picture of its own, seen by `camera`; begun anew, when the context
  // is back, if it was lost meanwhile.
  async trace(width: number, height: number, spp: number, seed: number): Promise<Film> {
    this.setPaused(true);
    for (;;) {
      while (!this.isReady || this.gl.isContextLost() || this.drawn !== this.version) await pause(5);
      const film = await this.traced(width, height, spp, seed);
      if (film) return film;
    }
  }

  // That film, or null if the context was lost meanwhile.
  private async traced(width: number, height: number, spp: number, seed: number): Promise<Film | null> {
    const tracer = this.tracer;
    const isValid = (): boolean => this.isReady && this.tracer === tracer && !this.gl.isContextLost();
    await tracer.settle();
    const before = tracer.seconds;
    const film = new Film(this.gl, width, height);
    tracer.set({ ...this.view(width, height), u_seed: seed });
    while (film.samples < spp && isValid())
      await tracer.pass(film, Math.min(tracer.rays(film), spp - film.samples), async () => isValid());
    await tracer.settle();
    if (!isValid()) return null;
    tracer.set({ u_seed: this.payload.header.seed });
    this.begun += tracer.seconds - before;
    return film;
  }

  // The material in a place of the picture: x to the right and y down, from 0 to 1.
  async pick(x: number, y: number): Promise<number> {
    const { width, height } = this.size;
    return this.tracer.pick([2 * x - 1, 1 - 2 * y], this.view(width, height));
  }

  show(): void {
    if (this.shown && this.isReady) this.display.draw(this.shown, Number(this.settings.exposure), this.tonemap);
    this.lastShown = performance.now();
  }

  // What is seen, as a .png.
  async png(): Promise<Blob | null> {
    await this.display.prepare(this.tonemap);
    this.show();
    return new Promise((done) => this.canvas.toBlob(done, "image/png"));
  }

  private woken(): Promise<void> {
    return new Promise((done) => (this.wake = done));
  }

  // Whether what it takes for a tone curve is compiled.
  shows(tonemap: string): boolean {
    return this.display.knows(tonemap);
  }

  private get tonemap(): string {
    return String(this.settings.tonemap);
  }

  private async begin(version: number): Promise<void> {
    const { uniforms, edits } = changes(this.payload.header.controls, this.settings);
    this.tracer.set(uniforms);
    await this.tracer.edit(edits);
    for (const film of this.films.values()) film.samples = 0;
    this.state = { samples: 0, seconds: 0, error: Infinity, speed: this.state.speed };
    this.drawn = version;
  }

  private async refine(goesOn: () => Promise<boolean>): Promise<void> {
    const { width, height } = this.size;
    const pixels = this.tracer.speed * PREVIEW;
    let share = 1;
    while (share < COARSEST && (width * height) / share ** 2 > pixels) share *= 2;
    for (; share > 1; share /= 2) {
      do if (!(await this.add(share, goesOn))) return;
      while (performance.now() - this.changed < MOVING);
    }
    while (await this.add(1, goesOn));
  }

  // One more pass, and show it.
  private async add(share: number, goesOn: () => Promise<boolean>): Promise<boolean> {
    if (!(await goesOn())) return false;
    const film = this.film(share);
    if (film.samples === 0) {
      film.clear();
      this.begun = this.tracer.seconds;
    }
    this.tracer.set(this.view(film.width, film.height));
    const rays = Math.min(this.tracer.rays(film, PASS), Math.max(1, film.samples), this.most - film.samples);
    if (!(await this.tracer.pass(film, rays, goesOn))) return false;
    this.shown = film;
    if (share === 1) {
      this.state.samples = film.samples;
      const isLast = film.samples === this.most;
      if (film.samples >= 2 && (isLast || performance.now() - this.lastMetered > METERED)) {
        await this.tracer.settle();
        this.state.error = this.display.relativeError(film);
        this.lastMetered = performance.now();
      }
      this.state.seconds = this.tracer.seconds - this.begun;
      if (this.state.seconds) this.state.speed = (film.samples * film.width * film.height) / this.state.seconds;
    }
    if (this.isDone || film.samples <= rays || performance.now() - this.lastShown > SHOWN) this.show();
    this.onFrame(this.state, share > 1);
    await pause();
    return true;
  }

  // Samples of each pixel.
  private get most(): number {
    return this.rests ? GOOD.most : MOST_SAMPLES;
  }

  // Of the picture: that of the canvas, if it is not too large.
  private get size(): { width: number; height: number } {
    const { width, height } = this.gl.canvas;
    const share = Math.min(1, Math.sqrt(MOST_PIXELS / (width * height)));
    return { width: Math.max(1, Math.round(width * share)), height: Math.max(1, Math.round(height * share)) };
  }

  private film(share: number): Film {
    const [width, height] = [this.size.width, this.size.height].map((side) => Math.max(1, Math.ceil(side / share)));
    const known = this.films.get(share);
    if (known && known.width === width && known.height === height) return known;
    known?.release();
    if (this.shown === known) this.shown = null;
    const film = new Film(this.gl, width, height);
    this.films.set(share, film);
    return film;
  }

  private view(width: number, height: number): ReturnType<typeof cameras.uniforms> {
    return cameras.uniforms(this.camera, this.payload.header.origin, width, height);
  }
}
