// SPDX-License-Identifier: MIT
// A scene that scripts/web_peers.py writes, by three-gpu-pathtracer.
import * as THREE from "three";
import { WebGLPathTracer } from "three-gpu-pathtracer";

const { width, height, bounces, camera, ambient, objects, lamps } = window.scene;

function material({ color, roughness, metalness, specular }) {
  const made = new THREE.MeshPhysicalMaterial({ roughness, metalness, specularIntensity: specular, side: THREE.DoubleSide });
  made.color.setRGB(...color); // linear
  return made;
}

function mesh(object) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(object.positions, 3));
  geometry.setIndex(object.triangles);
  if (object.normals) geometry.setAttribute("normal", new THREE.Float32BufferAttribute(object.normals, 3));
  else geometry.computeVertexNormals();
  return new THREE.Mesh(geometry, material(object));
}

// It shines along its -z.
function lamp({ corner, edge_u, edge_v, radiance }) {
  const [u, v] = [edge_u, edge_v].map((edge) => new THREE.Vector3(...edge));
  const light = new THREE.RectAreaLight(new THREE.Color().setRGB(...radiance), 1, u.length(), v.length());
  light.position.set(...corner).addScaledVector(u, 0.5).addScaledVector(v, 0.5);
  const [x, y] = [u.clone().normalize(), v.clone().normalize().negate()];
  light.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, y, x.clone().cross(y)));
  return light;
}

function constant(radiance) {
  const texels = new Float32Array(4 * 4 * 2).map((_, i) => (i % 4 < 3 ? radiance[i % 4] : 1));
  const texture = new THREE.DataTexture(texels, 4, 2, THREE.RGBAFormat, THREE.FloatType);
  texture.mapping = THREE.EquirectangularReflectionMapping;
  texture.needsUpdate = true;
  return texture;
}

const scene = new THREE.Scene();
objects.forEach((object) => scene.add(mesh(object)));
lamps.forEach((each) => scene.add(lamp(each)));
if (ambient) scene.environment = scene.background = constant(ambient);
const view = new THREE.PerspectiveCamera(camera.fov_degrees, width / height, 0.01, 100);
view.position.set(...camera.position);
view.lookAt(...camera.target);

const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.toneMapping = THREE.NoToneMapping;
renderer.setPixelRatio(1);
renderer.setSize(width, height);
document.body.append(renderer.domElement);
const tracer = new WebGLPathTracer(renderer);
tracer.tiles.set(1, 1);
tracer.bounces = bounces + 1; // of theirs the first is where the camera's ray ends
Object.assign(tracer, { renderDelay: 0, fadeDuration: 0, minSamples: 1, rasterizeScene: false, renderToCanvas: false });
tracer.setScene(scene, view);

const pixel = new Float32Array(4);
function finish() {
  renderer.readRenderTargetPixels(tracer.target, 0, 0, 1, 1, pixel); // waits for all that was drawn
}

// Seconds that `spp` samples of each pixel take.
window.trace = async (spp) => {
  while (tracer.samples < 1) {
    tracer.renderSample();
    await new Promise((done) => setTimeout(done, 10)); // it compiles meanwhile
  }
  finish();
  const start = performance.now();
  const end = tracer.samples + spp;
  while (tracer.samples < end) tracer.renderSample();
  finish();
  return (performance.now() - start) / 1000;
};
window.film = () => {
  const texels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(tracer.target, 0, 0, width, height, texels);
  return btoa(Array.from(new Uint8Array(texels.buffer), (byte) => String.fromCharCode(byte)).join(""));
};
