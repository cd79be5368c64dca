// Bodies on the stage: their meshes, ghosts at rest, and deformed points.
import { unpack } from "./page_data.js";

/** @typedef {{data: import("./page_data.js").BodyData, mesh: any, rest: Float32Array, colours: Float32Array, own: any}} Actor */

/** sRGB to the linear values that lights work on. @param {number} channel 0 to 255 @returns {number} */
export const linear = (channel) => Math.pow(channel / 255, 2.2);

/** @param {import("./page_data.js").BodyData} data @returns {Promise<Actor>} */
export async function actorOf(data) {
  const packed = await unpack(data.points);
  const triangles = await unpack(data.triangles);
  const rest = new Float32Array(packed.length);
  for (let i = 0; i < packed.length; i++) {
    const k = i % 3;
    rest[i] = data.low[k] + (packed[i] / 65535) * data.span[k] + (data.elastic ? data.reference[k] : 0);
  }
  const geometry = new THREE.BufferGeometry();
  const colours = new Float32Array(packed.length);
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(rest), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(triangles), 1));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const material = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide, flatShading: true });
  if (data.fixed) Object.assign(material, { transparent: true, opacity: 0.16, depthWrite: false });
  const mesh = new THREE.Mesh(geometry, material);
  mesh.matrixAutoUpdate = false;
  mesh.frustumCulled = false;
  const own = new THREE.Matrix4().makeRotationZ(data.turn).setPosition(new THREE.Vector3(...data.reference));
  const turned = data.elastic ? rest : turnedPoints(rest, data.turn);
  return { data, mesh, rest: turned, colours, own };
}

/** A translucent copy of a body at rest. @param {Actor} actor @returns {any} */
export function ghostOf(actor) {
  const material = new THREE.MeshLambertMaterial({ color: 0x5b6b7c, side: THREE.DoubleSide, flatShading: true });
  Object.assign(material, { transparent: true, opacity: 0.22, depthWrite: false });
  const ghost = new THREE.Mesh(actor.mesh.geometry.clone(), material);
  ghost.matrixAutoUpdate = false;
  ghost.frustumCulled = false;
  if (!actor.data.elastic) ghost.matrix.copy(actor.own);
  return ghost;
}

/** Points of a body in the axes of the gearbox, from its reference. @param {Float32Array} rest @param {number} turn */
function turnedPoints(rest, turn) {
  const [cosine, sine] = [Math.cos(turn), Math.sin(turn)];
  const out = Float32Array.from(rest);
  for (let i = 0; i < rest.length; i += 3) {
    out[i] = cosine * rest[i] - sine * rest[i + 1];
    out[i + 1] = sine * rest[i] + cosine * rest[i + 1];
  }
  return out;
}

/**
 * Move the points of an elastic body.
 * @param {Actor} actor
 * @param {Int8Array | null} field three rows of real parts, then three of imaginary ones
 * @param {number} re
 * @param {number} im factors of both
 */
export function deform(actor, field, re, im) {
  const position = actor.mesh.geometry.attributes.position;
  const count = actor.rest.length / 3;
  for (let point = 0; point < count; point++) {
    for (let k = 0; k < 3; k++) {
      const moved = field ? re * field[point + k * count] + im * field[point + (k + 3) * count] : 0;
      position.array[3 * point + k] = actor.rest[3 * point + k] + moved;
    }
  }
  position.needsUpdate = true;
}
