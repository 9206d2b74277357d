// SPDX-License-Identifier: MIT
// A few things that WebGL lacks: programs that compile in the background, uniforms by name, fences to wait for.
import type { Values } from "./payload";

export type Gl = WebGL2RenderingContext;

export const pause = (milliseconds = 0): Promise<void> => new Promise((done) => setTimeout(done, milliseconds));

// Whether the CPU does the rendering.
export function isSoftware(gl: Gl): boolean {
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(name);
}

export class ContextLost extends Error {
  constructor() {
    super("the graphics context was lost");
  }
}

export class Program {
  private readonly places = new Map<string, { place: WebGLUniformLocation; type: number }>();
  readonly samplers: { name: string; type: number }[] = [];

  private constructor(
    private readonly gl: Gl,
    private readonly program: WebGLProgram,
  ) {
    const count: number = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    gl.useProgram(program);
    for (let i = 0; i < count; i++) {
      const { name, type } = gl.getActiveUniform(program, i)!;
      const place = gl.getUniformLocation(program, name)!;
      this.places.set(name, { place, type });
      if (isSampler(gl, type)) {
        gl.uniform1i(place, this.samplers.length);
        this.samplers.push({ name, type });
      }
    }
  }

  // Without blocking the page where the driver can (KHR_parallel_shader_compile).
  static async compiled(gl: Gl, vertex: string, fragment: string): Promise<Program> {
    const parallel = gl.getExtension("KHR_parallel_shader_compile");
    const program = gl.createProgram()!;
    const shaders = [vertex, fragment].map((text, i) => {
      const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER)!;
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      return shader;
    });
    gl.linkProgram(program);
    await pause();
    // As in finished().
    const isLost = (): boolean => gl.isContextLost() || !gl.isProgram(program);
    while (parallel && !isLost() && !gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR)) await pause(10);
    if (isLost()) throw new ContextLost();
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = [...shaders.map((shader) => gl.getShaderInfoLog(shader)), gl.getProgramInfoLog(program)];
      throw new Error(logs.filter(Boolean).join("\n") || "the program does not link");
    }
    for (const shader of shaders) gl.deleteShader(shader);
    return new Program(gl, program);
  }

  use(): void {
    this.gl.useProgram(this.program);
  }

  // Those that the program does not have are passed over. The program must be in use.
  set(uniforms: Record<string, Values>): void {
    const gl = this.gl;
    for (const [name, value] of Object.entries(uniforms)) {
      const found = this.places.get(name);
      if (!found) continue;
      const values = typeof value === "number" ? [value] : value;
      const { place, type } = found;
      if (type === gl.FLOAT) gl.uniform1fv(place, values);
      else if (type === gl.FLOAT_VEC2) gl.uniform2fv(place, values);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(place, values);
      else if (type === gl.FLOAT_VEC4) gl.uniform4fv(place, values);
      else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(place, false, values);
      else if (type === gl.INT || type === gl.BOOL) gl.uniform1iv(place, values);
      else if (type === gl.INT_VEC2) gl.uniform2iv(place, values);
      else if (type === gl.INT_VEC3) gl.uniform3iv(place, values);
      else if (type === gl.INT_VEC4) gl.uniform4iv(place, values);
      else if (type === gl.UNSIGNED_INT) gl.uniform1uiv(place, values);
      else throw new Error(`the uniform ${name} has a type that is not known here`);
    }
  }

  draw(): void {
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
  }
}

function isSampler(gl: Gl, type: number): boolean {
  return [gl.SAMPLER_2D, gl.SAMPLER_3D, gl.SAMPLER_2D_ARRAY, gl.UNSIGNED_INT_SAMPLER_2D].includes(type as never);
}

export function targetOf(gl: Gl, sampler: number): number {
  if (sampler === gl.SAMPLER_3D) return gl.TEXTURE_3D;
  return sampler === gl.SAMPLER_2D_ARRAY ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D;
}

export function newTexture(gl: Gl, target: number): WebGLTexture {
  const texture = gl.createTexture()!;
  gl.bindTexture(target, texture);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, side, gl.NEAREST);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, side, gl.CLAMP_TO_EDGE);
  return texture;
}

// Resolves when all that was issued before has been done; false if the context was lost meanwhile.
export async function finished(gl: Gl): Promise<boolean> {
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  if (!fence) return false;
  gl.flush();
  for (;;) {
    await pause();
    // It may have been lost and restored between two looks: then the fence is of no context.
    if (gl.isContextLost() || !gl.isSync(fence)) return false;
    const state = gl.clientWaitSync(fence, 0, 0);
    if (state === gl.WAIT_FAILED) return false;
    if (state !== gl.TIMEOUT_EXPIRED) break;
  }
  gl.deleteSync(fence);
  return true;
}
