// SPDX-License-Identifier: MIT
// The page in a cell of a notebook, an anywidget: camera and settings are the same there as in Python
// (src/fragtracer/apps/web/notebook.py).
import type { Settings } from "./controls";
import type { Api } from "./main";
import type { Camera } from "./payload";

interface State {
  html: string;
  camera: Camera;
  settings: Settings;
}

interface Model {
  get<K extends keyof State>(name: K): State[K];
  set<K extends keyof State>(name: K, value: State[K]): void;
  save_changes(): void;
  on(event: string, callback: () => void): void;
  off(event: string, callback: () => void): void;
}

const EVENTS = ["change:camera", "change:settings"];

function render({ model, el }: { model: Model; el: HTMLElement }): () => void {
  const frame = document.createElement("iframe");
  frame.title = "A live picture";
  frame.allow = "clipboard-write";
  frame.style.cssText = "width: 100%; height: 36rem; border: 0";
  frame.srcdoc = model.get("html");
  let api: Api | undefined;
  const follow = (): void => api?.set(model.get("camera"), model.get("settings"));
  const connect = (page: Window): void => {
    api = page.fragtracer!;
    follow();
    api.onChange = (camera, settings) => {
      model.set("camera", camera);
      model.set("settings", settings);
      model.save_changes();
    };
  };
  frame.addEventListener("load", () => {
    const page = frame.contentWindow!;
    if (page.fragtracer?.live.shown) connect(page);
    else page.addEventListener("traced", () => connect(page), { once: true });
  });
  for (const event of EVENTS) model.on(event, follow);
  el.append(frame);
  return () => {
    for (const event of EVENTS) model.off(event, follow);
    frame.remove();
  };
}

export default { render };
