// The stage: bodies in three dimensions that move in a mode, drawn with three.js.
import { channelsOf, ramp } from "./colours.js";
import { unpack } from "./page_data.js";

const HALF_SPEED = 2.2;
/** A frame that takes longer than this (ms) makes the next ones rarer: machines without GPU. */
const SLOW = 60;
const FIRST_FRAMES = 4;

/** @typedef {{data: import("./page_data.js").BodyData, mesh: any, rest: Float32Array, colours: Float32Array, own: any}} Actor */

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.scene = new THREE.Scene();
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa4b0, 2.2));
    this.light = new THREE.DirectionalLight(0xffffff, 1.6);
    this.scene.add(this.light);
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.01, 100);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    /** @type {Actor[]} */
    this.actors = [];
    /** @type {any[]} */
    this.ghosts = [];
    /** @type {Set<string>} */
    this.hidden = new Set();
    this.amplitude = 1;
    this.byBody = false;
    this.playing = false;
    this.resting = false;
    this.phase = 1;
    /** @type {import("./page_data.js").StageData | null} */
    this.data = null;
    /** @type {Float32Array | null} */
    this.motions = null;
    /** @type {Record<number, Int8Array>} */
    this.fields = {};
    this.mode = -1;
    this.frames = 0;
    this.wait = 0;
    this.asked = 0;
    this.visible = true;
    new ResizeObserver(() => this.resize()).observe(canvas);
    new IntersectionObserver((entries) => {
      this.visible = entries[0].isIntersecting;
      if (this.visible) this.play();
    }).observe(canvas);
    canvas.addEventListener("keydown", (event) => this.turnByKey(event));
  }

  /**
   * Show a mode of a model; other bodies are built anew.
   * @param {import("./page_data.js").StageData} data
   * @param {number} mode
   */
  async show(data, mode) {
    const mine = ++this.asked;
    const motions = /** @type {Float32Array} */ (await unpack(data.motions));
    /** @type {Record<number, Int8Array>} */
    const fields = {};
    for (const [place, reference] of Object.entries(data.deformed[String(mode)] ?? {})) {
      fields[Number(place)] = /** @type {Int8Array} */ (await unpack(reference));
    }
    const actors = data === this.data ? this.actors : await Promise.all(data.bodies.map((body) => actorOf(body)));
    if (mine !== this.asked) return;
    if (data !== this.data) this.enter(data, actors);
    Object.assign(this, { motions, fields, mode });
    this.colour();
    this.place(this.phase);
    this.draw();
    this.play();
  }

  /** @param {import("./page_data.js").StageData} data @param {Actor[]} actors */
  enter(data, actors) {
    this.ghosts.forEach((ghost) => this.scene.remove(ghost));
    for (const actor of this.actors) {
      this.scene.remove(actor.mesh);
      actor.mesh.geometry.dispose();
      actor.mesh.material.dispose();
    }
    const first = this.data === null;
    this.data = data;
    this.actors = actors;
    for (const actor of actors) this.scene.add(actor.mesh);
    this.ghosts = actors.filter((actor) => !actor.data.fixed).map(ghostOf);
    this.showRest(this.resting);
    if (first) this.lookFrom([0.75, 0.45, -1]);
    this.resize();
  }

  /** Draw the bodies at rest, too, translucent. @param {boolean} on */
  showRest(on) {
    this.resting = on;
    for (const ghost of this.ghosts) on ? this.scene.add(ghost) : this.scene.remove(ghost);
    this.draw();
  }

  /** @param {number[]} direction from the middle to the eye */
  lookFrom(direction) {
    if (!this.data) return;
    const [x, y, z] = this.data.centre;
    const eye = new THREE.Vector3(...direction).setLength(1.45 * this.data.diagonal);
    this.controls.target.set(x, y, z);
    this.camera.position.set(x, y, z).add(eye);
    this.camera.near = 0.01 * this.data.diagonal;
    this.camera.far = 10 * this.data.diagonal;
    this.camera.updateProjectionMatrix();
    this.controls.update();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Colour all points by their displacement, or bodies by their own colour. */
  colour() {
    if (!this.data) return;
    const table = ramp(this.data.colours);
    this.actors.forEach((actor, place) => {
      const own = channelsOf(actor.data.colour).map(linear);
      for (let point = 0; point < actor.rest.length / 3; point++) {
        const size = Math.min(1, this.sizeAt(actor, place, point));
        const colour = 3 * Math.round(255 * size);
        for (let k = 0; k < 3; k++) {
          actor.colours[3 * point + k] = this.byBody || actor.data.fixed ? own[k] : linear(table[colour + k]);
        }
      }
      actor.mesh.geometry.attributes.color.needsUpdate = true;
    });
  }

  /** @param {Actor} actor @param {number} place @param {number} point @returns {number} displacement over the largest */
  sizeAt(actor, place, point) {
    const field = this.fields[place];
    const count = actor.rest.length / 3;
    if (field) return Math.hypot(field[point], field[point + count], field[point + 2 * count]) / 127;
    const m = this.motionOf(place);
    const [x, y, z] = [0, 1, 2].map((k) => actor.rest[3 * point + k] - (actor.data.elastic ? actor.data.reference[k] : 0));
    return Math.hypot(m[0] + m[4] * z - m[5] * y, m[1] + m[5] * x - m[3] * z, m[2] + m[3] * y - m[4] * x);
  }

  /** @param {number} place @returns {Float32Array} */
  motionOf(place) {
    if (!this.motions || this.mode < 0) return new Float32Array(6);
    const start = 6 * (this.mode * this.actors.length + place);
    return this.motions.subarray(start, start + 6);
  }

  /** Put all bodies where they are at a part of the amplitude. @param {number} part -1 to 1 */
  place(part) {
    if (!this.data) return;
    const factor = part * this.amplitude * this.data.amplitude * this.data.diagonal;
    this.actors.forEach((actor, place) => {
      const field = this.fields[place];
      if (field) deform(actor, field, factor / 127);
      else if (actor.data.elastic) deform(actor, null, 0);
      const m = this.motionOf(place);
      const turn = new THREE.Vector3(m[3], m[4], m[5]).multiplyScalar(factor);
      const angle = turn.length();
      const matrix = new THREE.Matrix4();
      if (angle > 0) matrix.makeRotationAxis(turn.normalize(), angle);
      const reference = new THREE.Vector3(...actor.data.reference);
      const shift = new THREE.Vector3(m[0], m[1], m[2]).multiplyScalar(factor);
      const centre = reference.clone().applyMatrix4(matrix).negate().add(reference).add(shift);
      actor.mesh.matrix.copy(matrix).setPosition(centre);
      if (!actor.data.elastic) actor.mesh.matrix.multiply(actor.own);
      actor.mesh.visible = !this.hidden.has(actor.data.owner);
    });
  }

  draw() {
    this.light.position.copy(this.camera.position);
    this.renderer.render(this.scene, this.camera);
  }

  /** @param {boolean} on */
  setPlaying(on) {
    this.playing = on;
    if (!on) {
      this.place((this.phase = 1));
      this.draw();
    }
    this.play();
  }

  play() {
    if (!this.playing || this.frames < 0 || this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => this.step());
  }

  step() {
    this.waiting = false;
    if (!this.playing || !this.visible) return;
    const began = performance.now();
    this.place((this.phase = Math.cos((Math.PI * began) / (1000 / HALF_SPEED))));
    this.draw();
    // WebGL only queues: reading one pixel waits for the picture. The first frames compile shaders.
    if (++this.frames > FIRST_FRAMES) {
      const gl = this.renderer.getContext();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      const took = performance.now() - began;
      this.wait = took > SLOW ? Math.min(2 * took, 1000) : 0;
    }
    if (this.wait) setTimeout(() => this.play(), this.wait);
    else this.play();
  }

  /** @param {KeyboardEvent} event */
  turnByKey(event) {
    /** @type {Record<string, [number, number]>} */
    const turns = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, -0.12], ArrowDown: [0, 0.12] };
    const sizes = /** @type {Record<string, number>} */ ({ "+": 0.85, "=": 0.85, "-": 1 / 0.85 });
    const eye = this.camera.position.clone().sub(this.controls.target);
    if (turns[event.key]) {
      const [around, over] = turns[event.key];
      const side = new THREE.Vector3().crossVectors(this.camera.up, eye).normalize();
      eye.applyAxisAngle(this.camera.up, around).applyAxisAngle(side, over);
    } else if (sizes[event.key]) eye.multiplyScalar(sizes[event.key]);
    else return;
    event.preventDefault();
    this.camera.position.copy(this.controls.target).add(eye);
    this.controls.update();
    this.draw();
  }
}

/** sRGB to the linear values that lights work on. @param {number} channel 0 to 255 @returns {number} */
const linear = (channel) => Math.pow(channel / 255, 2.2);

/** @param {import("./page_data.js").BodyData} data @returns {Promise<Actor>} */
async function actorOf(data) {
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
function ghostOf(actor) {
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

/** @param {Actor} actor @param {Int8Array | null} field three rows of components @param {number} factor */
function deform(actor, field, factor) {
  const position = actor.mesh.geometry.attributes.position;
  const count = actor.rest.length / 3;
  for (let point = 0; point < count; point++) {
    for (let k = 0; k < 3; k++) {
      position.array[3 * point + k] = actor.rest[3 * point + k] + (field ? factor * field[point + k * count] : 0);
    }
  }
  position.needsUpdate = true;
}
