// SPDX-License-Identifier: MIT
// Mouse, touch and keys on the picture, as moves of the camera.
import * as cameras from "./camera";
import type { Camera } from "./payload";

const TURN = 2 * Math.PI; // radians for the picture's height
const WHEEL = 0.0015; // of the logarithm of the distance, for a unit of a wheel
const PINCH = 0.01; // the same of a trackpad, whose pinch comes as a wheel with Ctrl and small units
const MOST_WHEEL = 0.6; // of that logarithm, for an event
const KEY_TURN = Math.PI / 36;
const KEY_PAN = 0.03; // of the picture's height
const KEY_DOLLY = 1.1;

const CLICK = 4; // CSS pixels

const isNear = (a: PointerEvent, b: PointerEvent): boolean =>
  Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY) < CLICK;

export type Move = (camera: Camera) => Camera;

export function listen(
  canvas: HTMLCanvasElement,
  move: (change: Move) => void,
  pick: (x: number, y: number) => void, // from 0 to 1, x to the right and y down
): void {
  const pointers = new Map<number, PointerEvent>();
  let first: PointerEvent | null = null; // while it may still be a click

  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus({ preventScroll: true, focusVisible: false } as FocusOptions);
    first = pointers.size || event.button ? null : event;
    pointers.set(event.pointerId, event);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointerup", (event) => {
    if (first && isNear(first, event)) pick(event.offsetX / canvas.clientWidth, event.offsetY / canvas.clientHeight);
    first = null;
  });
  for (const end of ["pointerup", "pointercancel"] as const)
    canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());

  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before || (first && isNear(first, event))) return;
    first = null;
    const height = canvas.clientHeight;
    const [right, down] = [(event.clientX - before.clientX) / height, (event.clientY - before.clientY) / height];
    const others = [...pointers.values()].filter(({ pointerId }) => pointerId !== event.pointerId);
    pointers.set(event.pointerId, event);
    if (others.length) {
      // Two fingers: each moves the picture by half, and their distance is that to the target.
      const distance = (a: PointerEvent): number => Math.hypot(a.clientX - others[0].clientX, a.clientY - others[0].clientY);
      const factor = Math.max(1, distance(before)) / Math.max(1, distance(event));
      move((camera) => cameras.dolly(cameras.pan(camera, right / 2, down / 2), factor));
    } else if (event.shiftKey || event.buttons > 1) move((camera) => cameras.pan(camera, right, down));
    else move((camera) => cameras.orbit(camera, right * TURN, down * TURN));
  });

  // In a cell or a frame the page around scrolls, until the picture has been clicked.
  const takesWheel = (): boolean => window.parent === window || document.activeElement === canvas;
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!takesWheel()) return;
      event.preventDefault();
      const units = event.deltaY * [1, 16, 100][event.deltaMode];
      const change = (event.ctrlKey ? PINCH : WHEEL) * units;
      move((camera) => cameras.dolly(camera, Math.exp(Math.max(-MOST_WHEEL, Math.min(MOST_WHEEL, change)))));
    },
    { passive: false },
  );

  const steps: Record<string, [number, number]> = {
    ArrowLeft: [-1, 0],
    ArrowRight: [1, 0],
    ArrowUp: [0, -1],
    ArrowDown: [0, 1],
  };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = steps[event.key];
    if (step && event.shiftKey) move((camera) => cameras.pan(camera, KEY_PAN * step[0], KEY_PAN * step[1]));
    else if (step) move((camera) => cameras.orbit(camera, KEY_TURN * step[0], KEY_TURN * step[1]));
    else if (event.key === "+" || event.key === "=") move((camera) => cameras.dolly(camera, 1 / KEY_DOLLY));
    else if (event.key === "-") move((camera) => cameras.dolly(camera, KEY_DOLLY));
    else if (event.key === "Enter") pick(0.5, 0.5);
    else return;
    event.preventDefault();
  });
}
