// SPDX-License-Identifier: MIT
// The controls below the picture, made from what the page says of them.
import type { Settings } from "./controls";
import type { Control } from "./payload";

export function element<K extends keyof HTMLElementTagNameMap>(
  name: K,
  attributes: Record<string, string> = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

export class Panel {
  private readonly fields = new Map<string, { input: HTMLInputElement | HTMLSelectElement; show: (value: number | string) => void }>();

  constructor(
    private readonly parent: HTMLElement,
    private readonly change: (id: string, value: number | string) => void,
  ) {}

  add(control: Control, value: number | string): void {
    const id = `control-${control.id}`;
    const output = element("output", { for: id });
    const isNumber = typeof control.value === "number";
    const input = control.choices ? this.choice(id, control.choices) : isNumber ? this.slider(id, control) : this.color(id);
    // The value itself: a slider rounds its own to its step.
    const show = (value: number | string): void => {
      output.textContent = isNumber ? `${Number(Number(value).toPrecision(4))} ${control.unit ?? ""}`.trim() : "";
    };
    input.value = String(value);
    input.addEventListener("input", () => {
      show(input.value);
      this.change(control.id, isNumber ? Number(input.value) : input.value);
    });
    show(value);
    this.parent.append(element("label", { for: id }, control.label), input, output);
    this.fields.set(control.id, { input, show });
  }

  clear(): void {
    this.parent.replaceChildren();
    this.fields.clear();
  }

  set(settings: Settings): void {
    for (const [id, { input, show }] of this.fields) {
      input.value = String(settings[id]);
      show(settings[id]);
    }
  }

  private choice(id: string, choices: string[]): HTMLSelectElement {
    return element("select", { id }, ...choices.map((name) => element("option", { value: name }, name)));
  }

  private color(id: string): HTMLInputElement {
    return element("input", { id, type: "color" });
  }

  private slider(id: string, { min, max, step }: Control): HTMLInputElement {
    return element("input", { id, type: "range", min: String(min), max: String(max), step: String(step) });
  }
}
