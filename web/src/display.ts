// SPDX-License-Identifier: MIT
// From the film to the canvas by shaders/display/display.frag, and the film's mean error.
import type { Film } from "./film";
import { type Gl, Program, newTexture } from "./gl";

const TILES = 16; // a side, over which sums are taken

// Sums over the pixels of a tile: the standard error if samples were independent, the mean, the squares of the
// half-difference, and those of the standard error (sampling/pixels.py).
const METER = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D u_film_mean;
uniform sampler2D u_film_variance;
uniform sampler2D u_film_half_difference;
layout(location = 0) out vec4 out_sums;
void main() {
    ivec2 size = textureSize(u_film_mean, 0);
    ivec2 low = ivec2(gl_FragCoord.xy) * size / ${TILES};
    ivec2 high = (ivec2(gl_FragCoord.xy) + 1) * size / ${TILES};
    vec4 sums = vec4(0.0);
    for (int y = low.y; y < high.y; y++) {
        for (int x = low.x; x < high.x; x++) {
            vec4 mean = texelFetch(u_film_mean, ivec2(x, y), 0);
            vec3 error2 = texelFetch(u_film_variance, ivec2(x, y), 0).rgb / max(mean.a - 1.0, 1.0);
            vec3 h = texelFetch(u_film_half_difference, ivec2(x, y), 0).rgb - mean.rgb * mod(mean.a, 2.0) / max(mean.a, 1.0);
            const vec3 one = vec3(1.0);
            sums += vec4(dot(sqrt(error2), one), dot(mean.rgb, one), dot(h, h), dot(error2, one));
        }
    }
    out_sums = sums;
}
`;

export class Display {
  private readonly programs = new Map<string, Program | Promise<Program>>();
  private meter: Program | null = null;
  private readonly sums: WebGLTexture;
  private readonly sumsFramebuffer: WebGLFramebuffer;

  constructor(
    private readonly gl: Gl,
    private readonly vertex: string,
    private readonly fragment: string,
  ) {
    this.sums = newTexture(gl, gl.TEXTURE_2D);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, TILES, TILES);
    this.sumsFramebuffer = gl.createFramebuffer()!;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sumsFramebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.sums, 0);
  }

  // Compile what shows this tone curve, so that drawing need not wait.
  async prepare(tonemap: string): Promise<void> {
    for (const fits of [0, 1]) await this.program(tonemap, fits);
    this.meter ??= await Program.compiled(this.gl, this.vertex, METER);
  }

  knows(tonemap: string): boolean {
    return [0, 1].every((fits) => this.programs.get(this.key(tonemap, fits)) instanceof Program);
  }

  draw(film: Film, exposure: number, tonemap: string): void {
    const gl = this.gl;
    const { width, height } = gl.canvas;
    const program = this.programs.get(this.key(tonemap, Number(film.width === width && film.height === height)));
    if (!(program instanceof Program)) return;
    program.use();
    program.set({ u_rectangle: [0, 0, width, height], u_exposure: 2 ** exposure });
    this.bind(program, film);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
    program.draw();
  }

  // Mean standard error over mean radiance; stratification counts in the mean over the picture.
  relativeError(film: Film): number {
    const gl = this.gl;
    if (!this.meter || film.samples < 2) return Infinity;
    this.meter.use();
    this.bind(this.meter, film);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sumsFramebuffer);
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, TILES, TILES);
    this.meter.draw();
    const texels = new Float32Array(4 * TILES * TILES);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, TILES, TILES, gl.RGBA, gl.FLOAT, texels);
    const [error, mean, halves, independent] = [0, 1, 2, 3].map((channel) =>
      texels.reduce((sum, value, i) => (i % 4 === channel ? sum + value : sum), 0),
    );
    return mean > 0 ? (error / mean) * Math.sqrt(independent > 0 ? halves / independent : 1) : 0;
  }

  private bind(program: Program, film: Film): void {
    const gl = this.gl;
    const names = ["u_film_mean", "u_film_variance", "u_film_half_difference"];
    program.samplers.forEach(({ name }, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, film.textures[Math.max(0, names.indexOf(name))]);
    });
  }

  private key(tonemap: string, fits: number): string {
    return `${tonemap} ${fits}`;
  }

  private async program(tonemap: string, fits: number): Promise<Program> {
    const key = this.key(tonemap, fits);
    const known = this.programs.get(key);
    if (known) return known;
    const [version, ...lines] = this.fragment.split("\n");
    const defines = [`#define TONE_CURVE TONE_${tonemap.toUpperCase()}`, `#define FILM_FITS ${fits}`];
    const made = Program.compiled(this.gl, this.vertex, [version, ...defines, ...lines].join("\n"));
    this.programs.set(key, made);
    const program = await made;
    this.programs.set(key, program);
    return program;
  }
}
