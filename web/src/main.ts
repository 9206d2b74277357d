// SPDX-License-Identifier: MIT
// The page: a poster first, then the scene as it is traced, and what a reader can do with it.
import { toml } from "./camera";
import type { Settings } from "./controls";
import type { Film } from "./film";
import { isSoftware } from "./gl";
import { type Move, listen } from "./input";
import { Live, type State } from "./live";
import { Panel, element } from "./panel";
import { type Camera, type Control, type Payload, decode } from "./payload";
import { randomTexture } from "./random";

const SHOWN_FROM = 16; // samples of each pixel, at which the traced picture takes the place of the poster
const SHOWN_AFTER = 3000; // milliseconds after which it does anyway
const PREPARING = "This is a still picture; the live one is being prepared.";

const find = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;

// For tests and notebooks: `window.fragtracer`. Textures are float32 RGBA in base64, row 0 at the bottom.
export interface Api {
  live: Live;
  state: State;
  controls: Control[];
  set(camera: Camera, settings: Settings): void; // from the first frame on, at which the window hears of "traced"
  onChange(camera: Camera, settings: Settings): void; // by the reader
  trace(width: number, height: number, spp: number, seed: number): Promise<string[]>;
  film(): string[]; // what the canvas shows
  pixels(): string; // of the canvas, as bytes; right after it was drawn
  randomTexture(): string;
}

declare global {
  interface Window {
    fragtracer?: Api;
  }
}

async function main(): Promise<void> {
  find("note").textContent = PREPARING;
  await seen(find("stage"));
  const gl = contextOf(find("picture"));
  const missing = whatIsMissing(gl);
  if (!gl || missing) {
    standIn(missing || "WebGL 2 is missing");
    return;
  }
  performance.mark("start");
  const payload = await decode(find("scene").textContent!, isSoftware(gl));
  await page(new Live(gl, payload), payload);
}

// Until some of an element is in view: a document may have more pages than a browser has contexts.
function seen(target: Element): Promise<void> {
  return new Promise((done) => {
    const observer = new IntersectionObserver((entries) => {
      if (!entries.some(({ isIntersecting }) => isIntersecting)) return;
      observer.disconnect();
      done();
    });
    observer.observe(target);
  });
}

function contextOf(canvas: HTMLCanvasElement): WebGL2RenderingContext | null {
  return canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" });
}

// The poster stays, or, where the page has them, pictures from all around that can be turned.
function standIn(why: string): void {
  const pictures: string[] = JSON.parse(find("turntable").textContent!);
  find("note").textContent = `This is ${pictures.length ? "a series of pictures" : "a still picture"}: ${why}.`;
  find("status").textContent = "";
  find("panel").hidden = true;
  find("stage").classList.remove("live");
  find("picture").remove();
  if (!pictures.length) return;
  const stage = find("stage");
  const poster = find<HTMLImageElement>("poster");
  let place = 0;
  const turn = (steps: number): void => {
    place += steps;
    const index = Math.round(place) % pictures.length;
    poster.src = `data:image/webp;base64,${pictures[(index + pictures.length) % pictures.length]}`;
  };
  stage.tabIndex = 0;
  stage.setAttribute("role", "application");
  stage.setAttribute("aria-label", "Arrow keys turn the picture.");
  stage.style.touchAction = "pan-y";
  poster.draggable = false;
  stage.addEventListener("pointerdown", (event) => stage.setPointerCapture(event.pointerId));
  stage.addEventListener("pointermove", (event) => {
    if (event.buttons) turn((-event.movementX / stage.clientWidth) * pictures.length);
  });
  stage.addEventListener("keydown", (event) => {
    if (event.key === "ArrowLeft" || event.key === "ArrowRight") turn(event.key === "ArrowLeft" ? 1 : -1);
  });
}

// Why the scene cannot be traced here, if it cannot.
function whatIsMissing(gl: WebGL2RenderingContext | null): string {
  if (!gl) return "this browser has no WebGL 2, which tracing needs";
  if (!gl.getExtension("EXT_color_buffer_float")) return "this device cannot draw into float textures, which tracing needs";
  if (gl.getParameter(gl.MAX_TEXTURE_SIZE) < 4096) return "this device has no textures of 4096 texels a side, which the scene needs";
  if (typeof DecompressionStream === "undefined") return "this browser has no DecompressionStream, by which the scene is unpacked";
  return "";
}

async function page(live: Live, payload: Payload): Promise<void> {
  const { header } = payload;
  const note = find("note");
  const stage = find("stage");
  const initial = { camera: live.camera, settings: live.settings };
  const set = (camera: Camera, settings: Settings): void => {
    if (live.set(camera, settings)) setPaused(false); // or it would not be seen
  };
  const setByReader = (camera: Camera, settings: Settings): void => {
    set(camera, settings);
    api.onChange(live.camera, live.settings);
  };
  const change = (id: string, value: number | string): void => setByReader(live.camera, { [id]: value });
  const panel = new Panel(find("controls"), change);
  const objectPanel = new Panel(find("object"), change);
  header.controls.filter(({ object }) => object === undefined).forEach((control) => panel.add(control, control.value));
  find("panel").hidden = false;

  let isTouched = false;
  let firstFrame = 0;
  const reveal = (): void => stage.classList.add("live");
  const api: Api = {
    live,
    state: { samples: 0, seconds: 0, error: Infinity, speed: 0 },
    controls: header.controls,
    set: (camera, settings) => {
      set(camera, settings);
      panel.set(live.settings);
      objectPanel.set(live.settings);
    },
    onChange: () => {},
    trace: async (...of) => {
      const film = await live.trace(...of);
      const texts = textures(film);
      film.release();
      return texts;
    },
    film: () => textures(live.shown!),
    pixels: () => {
      const { width, height } = live.canvas;
      const bytes = new Uint8Array(4 * width * height);
      live.gl.bindFramebuffer(live.gl.FRAMEBUFFER, null);
      live.gl.readPixels(0, 0, width, height, live.gl.RGBA, live.gl.UNSIGNED_BYTE, bytes);
      return base64(bytes);
    },
    randomTexture: () => base64(randomTexture(header.random)),
  };
  window.fragtracer = api;

  live.onFrame = (state, isCoarse) => {
    api.state = { ...state };
    if (!firstFrame) {
      firstFrame = performance.now();
      performance.mark("first-frame");
      live.canvas.tabIndex = 0;
      window.dispatchEvent(new Event("traced"));
    }
    const isGood = state.samples >= SHOWN_FROM || performance.now() - firstFrame > SHOWN_AFTER;
    if (isTouched || (isGood && !isCoarse)) reveal();
    find("status").textContent = describe(state, live.isDone);
    saveButton.disabled = false;
    labelPause();
  };
  live.onLoss = (isLost) => {
    stage.classList.toggle("live", false);
    saveButton.disabled = true;
    note.textContent = isLost ? "The graphics device was lost; the scene goes on when it is back, or comes into view again." : "";
  };

  const move = (how: Move): void => {
    if (!firstFrame) return;
    isTouched = true;
    setByReader(how(live.camera), {});
  };
  const pickAt = async (x: number, y: number): Promise<void> => {
    if (!firstFrame) return;
    const number = await live.pick(x, y);
    const own = header.controls.filter(({ object }) => object === number);
    objectPanel.clear();
    own.forEach((control) => objectPanel.add(control, live.settings[control.id]));
    find("picked").textContent = own.length ? String(own[0].name) : "Nothing here can be changed.";
    find("picking").hidden = false;
  };
  const pick = (x: number, y: number): void => void pickAt(x, y);
  listen(live.canvas, move, pick);
  const act = (label: string, key: string, action: () => void): HTMLButtonElement => {
    const button = element("button", { type: "button", "aria-keyshortcuts": key, title: `Key: ${key}` }, label);
    button.addEventListener("click", action);
    document.addEventListener("keydown", (event) => {
      const isTyping = event.target instanceof Element && event.target.matches("select, textarea");
      const isShown = !find("panel").hidden;
      const isMeant = event.key.toLowerCase() === key && isShown && !isTyping && !button.disabled;
      if (isMeant && !event.ctrlKey && !event.metaKey && !event.altKey) action();
    });
    find("actions").append(button);
    return button;
  };
  const stands = (): boolean => live.paused || live.isDone;
  const pauseButton = act("Pause", "p", () => {
    const goesOn = stands();
    if (live.isDone) live.rests = false;
    setPaused(!goesOn);
  });
  const labelPause = (): void => {
    const label = stands() ? "Go on" : "Pause";
    if (pauseButton.textContent !== label) pauseButton.textContent = label;
  };
  const setPaused = (paused: boolean): void => {
    live.setPaused(paused);
    labelPause();
  };
  act("Reset", "r", () => {
    setPaused(false);
    api.set(initial.camera, initial.settings);
    api.onChange(live.camera, live.settings);
  });
  const saveButton = act("Save PNG", "s", () => void live.png().then((blob) => blob && save(blob, `${header.file}.png`)));
  saveButton.disabled = true; // there is no picture yet
  act("Copy camera", "c", () => void copy(toml(live.camera)).then((how) => (note.textContent = how)));

  const resize = (): void => {
    if (matchMedia("print").matches) return; // laid out for paper
    const box = stage.getBoundingClientRect();
    const [width, height] = [box.width, box.height].map((side) => Math.max(1, Math.round(side * devicePixelRatio)));
    if (live.canvas.width === width && live.canvas.height === height) return;
    Object.assign(live.canvas, { width, height });
    live.show();
    live.restart();
  };
  resize();
  new ResizeObserver(resize).observe(stage);
  const followScreen = (): void => {
    const resolution = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
    const renew = (): void => {
      resize();
      followScreen();
    };
    resolution.addEventListener("change", renew, { once: true });
  };
  followScreen();
  // Where there are too many contexts, browsers take those that were used longest ago, and may keep them.
  const renew = (): void => {
    const canvas = live.canvas.cloneNode() as HTMLCanvasElement;
    const gl = contextOf(canvas);
    if (!gl) return;
    live.canvas.replaceWith(canvas);
    live.use(gl);
    listen(canvas, move, pick);
    note.textContent = PREPARING;
  };
  let isInView = true;
  const follow = (): void => {
    const isOn = isInView && !document.hidden;
    if (isOn && live.gl.isContextLost()) renew();
    live.setOn(isOn);
  };
  document.addEventListener("visibilitychange", follow);
  new IntersectionObserver((entries) => {
    isInView = entries[entries.length - 1].isIntersecting;
    follow();
  }).observe(stage);
  follow();
  await live.run();
}

function describe({ samples, seconds, error, speed }: State, isDone: boolean): string {
  if (!samples) return "";
  const percent = 100 * error;
  const parts = [samples === 1 ? "1 sample" : `${samples} samples`, `${seconds.toFixed(seconds < 10 ? 1 : 0)} s`];
  if (Number.isFinite(percent)) parts.push(`error ${rounded(percent, 2)} %`);
  return [...parts, isDone ? "done" : `${rounded(speed / 1e6, 3)} M samples/s`].join(" · ");
}

function rounded(x: number, digits: number): string {
  return x.toLocaleString("en", { minimumSignificantDigits: digits, maximumSignificantDigits: digits });
}

function save(blob: Blob, name: string): void {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

// By the clipboard, or, where a file has none, as a selection.
async function copy(text: string): Promise<string> {
  const area = find<HTMLTextAreaElement>("copied");
  area.value = text;
  try {
    await navigator.clipboard.writeText(text);
    return "The camera is in the clipboard, as the [camera] table of a scene file.";
  } catch {
    area.hidden = false;
    area.select();
    return "Copy the selected lines: the [camera] table of a scene file.";
  }
}

const textures = (film: Film): string[] => [0, 1, 2].map((i) => base64(film.read(i)));

function base64(values: Float32Array | Uint8Array): string {
  const bytes = new Uint8Array(values.buffer);
  let text = "";
  for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  return btoa(text);
}

main().catch((error: unknown) => standIn(error instanceof Error ? error.message : String(error)));
