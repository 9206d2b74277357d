// SPDX-License-Identifier: MIT
// Two sets of three float textures that take turns, as src/fragtracer/gpu/film.py: a pass reads the front and draws
// the back. Mean radiance and count, variance and count of what is not finite, half-difference.
import { type Gl, newTexture } from "./gl";

export const SAMPLERS = ["u_film_mean", "u_film_variance", "u_film_half_difference"];

export class Film {
  samples = 0; // of each pixel
  private readonly sets: WebGLTexture[][] = [];
  private readonly framebuffers: WebGLFramebuffer[] = [];
  private front = 0;

  constructor(
    private readonly gl: Gl,
    readonly width: number,
    readonly height: number,
  ) {
    for (let set = 0; set < 2; set++) {
      const framebuffer = gl.createFramebuffer()!;
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      const textures = SAMPLERS.map((_, i) => {
        const texture = newTexture(gl, gl.TEXTURE_2D);
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0);
        return texture;
      });
      gl.drawBuffers(SAMPLERS.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
      this.sets.push(textures);
      this.framebuffers.push(framebuffer);
    }
    this.clear();
  }

  clear(): void {
    const gl = this.gl;
    gl.disable(gl.SCISSOR_TEST);
    for (const framebuffer of this.framebuffers) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      for (let i = 0; i < SAMPLERS.length; i++) gl.clearBufferfv(gl.COLOR, i, [0, 0, 0, 0]);
    }
    this.front = 0;
    this.samples = 0;
  }

  get textures(): WebGLTexture[] {
    return this.sets[this.front];
  }

  // Draw to `rows` rows of the back from `bottom` (0 is the lowest) upwards.
  useBack(bottom: number, rows: number): void {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffers[1 - this.front]);
    gl.viewport(0, 0, this.width, this.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, bottom, this.width, rows);
  }

  swap(samples: number): void {
    this.front = 1 - this.front;
    this.samples += samples;
  }

  // One of the front's textures, RGBA, row 0 at the bottom.
  read(index: number): Float32Array {
    const gl = this.gl;
    const pixels = new Float32Array(4 * this.width * this.height);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.framebuffers[this.front]);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + index);
    gl.readPixels(0, 0, this.width, this.height, gl.RGBA, gl.FLOAT, pixels);
    return pixels;
  }

  release(): void {
    for (const framebuffer of this.framebuffers) this.gl.deleteFramebuffer(framebuffer);
    for (const texture of this.sets.flat()) this.gl.deleteTexture(texture);
  }
}
