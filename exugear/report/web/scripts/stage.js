// The stage: bodies in three dimensions that move in a mode or in operation, drawn with three.js.
import { actorOf, deform, ghostOf, linear } from "./actors.js";
import { channelsOf, ramp } from "./colours.js";
import { drawMarks } from "./marks.js";
import { unpack } from "./page_data.js";

const HALF_SPEED = 2.2;
/** A frame that takes longer than this (ms) makes the next ones rarer: machines without GPU. */
const SLOW = 60;
const FIRST_FRAMES = 4;
const ORIGIN = [0, 0, 0];

/** @typedef {import("./actors.js").Actor} Actor */
/** Name at a point, m. @typedef {{text: string, at: number[]}} Flag */

export class Stage {
  /** @param {HTMLCanvasElement} canvas of the bodies @param {HTMLCanvasElement} marks over it: axes, scale, names */
  constructor(canvas, marks) {
    this.canvas = canvas;
    this.marks = marks;
    this.labelled = true;
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
    /** Bodies in a brighter colour. @type {Set<string>} */
    this.marked = new Set();
    /** @type {Flag[]} */
    this.flags = [];
    this.playing = false;
    this.resting = false;
    this.angle = 0;
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
      // On a busy machine several changes arrive together: the last one holds.
      this.visible = entries[entries.length - 1].isIntersecting;
      if (this.visible) this.play();
    }).observe(canvas);
    canvas.addEventListener("keydown", (event) => this.turnByKey(event));
  }

  /**
   * Show a mode of a model, or its bodies at rest without motions; other bodies are built anew.
   * @param {import("./page_data.js").StageData} data
   * @param {number} mode
   */
  async show(data, mode) {
    const mine = ++this.asked;
    const motions = data.motions ? /** @type {Float32Array} */ (await unpack(data.motions)) : null;
    /** @type {Record<number, Int8Array>} */
    const fields = {};
    for (const [place, reference] of Object.entries(data.deformed?.[String(mode)] ?? {})) {
      fields[Number(place)] = /** @type {Int8Array} */ (await unpack(reference));
    }
    const same = data === this.data || (data.geometry !== undefined && data.geometry === this.data?.geometry);
    const actors = same ? this.actors : await Promise.all(data.bodies.map((body) => actorOf(body)));
    if (mine !== this.asked) return;
    if (!same) this.enter(data, actors);
    this.data = data;
    Object.assign(this, { motions, fields, mode });
    this.colour();
    this.place(this.angle);
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
    this.mark(this.marked, this.flags);
    if (first) this.lookFrom([0.75, 0.45, -1]);
    this.resize();
  }

  /** Draw the bodies at rest, too, translucent. @param {boolean} on */
  showRest(on) {
    this.resting = on;
    for (const ghost of this.ghosts) on ? this.scene.add(ghost) : this.scene.remove(ghost);
    this.draw();
  }

  /** Point out bodies and points. @param {Set<string>} marked names of bodies @param {Flag[]} flags */
  mark(marked, flags) {
    Object.assign(this, { marked, flags });
    for (const { data, mesh } of this.actors) mesh.material.emissive.set(marked.has(data.owner) ? 0x2a5f96 : 0x000000);
    this.draw();
  }

  /**
   * Body and point (m) under a place of the window; fixed bodies, which are translucent, come last.
   * @param {number} x @param {number} y @returns {{owner: string, point: number[]} | null}
   */
  pick(x, y) {
    const box = this.canvas.getBoundingClientRect();
    const caster = new THREE.Raycaster();
    const place = new THREE.Vector2((2 * (x - box.left)) / box.width - 1, 1 - (2 * (y - box.top)) / box.height);
    caster.setFromCamera(place, this.camera);
    const seen = this.actors.filter(({ mesh }) => mesh.visible);
    const hits = caster.intersectObjects(seen.map(({ mesh }) => mesh), false);
    const owned = hits.map((hit) => ({ hit, data: seen[seen.findIndex(({ mesh }) => mesh === hit.object)].data }));
    const first = owned.find(({ data }) => !data.fixed) ?? owned[0];
    return first ? { owner: first.data.owner, point: first.hit.point.toArray() } : null;
  }

  /** @param {number[]} direction from the middle to the eye */
  lookFrom(direction) {
    if (!this.data) return;
    const [x, y, z] = this.data.centre;
    const eye = new THREE.Vector3(...direction).setLength(1.6 * this.data.diagonal);
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
    const table = Float32Array.from(ramp(this.data.colours), linear);
    this.actors.forEach((actor, place) => {
      const own = channelsOf(actor.data.colour).map(linear);
      for (let point = 0; point < actor.rest.length / 3; point++) {
        const size = Math.min(1, this.sizeAt(actor, place, point));
        const colour = 3 * Math.round(255 * size);
        for (let k = 0; k < 3; k++) {
          actor.colours[3 * point + k] = this.byBody || actor.data.fixed ? own[k] : table[colour + k];
        }
      }
      actor.mesh.geometry.attributes.color.needsUpdate = true;
    });
  }

  /** Semi-major axis of the ellipse of a point. @param {Actor} actor @param {number} place @param {number} point */
  sizeAt(actor, place, point) {
    const [a, b] = [0, 1].map((part) => this.displacement(actor, place, point, part));
    const dot = (/** @type {number[]} */ u, /** @type {number[]} */ v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    const [aa, bb, ab] = [dot(a, a), dot(b, b), dot(a, b)];
    return Math.sqrt((aa + bb + Math.hypot(aa - bb, 2 * ab)) / 2);
  }

  /** Displacement over the largest. @param {Actor} actor @param {number} place @param {number} point @param {number} part */
  displacement(actor, place, point, part) {
    const field = this.fields[place];
    const count = actor.rest.length / 3;
    if (field) return [0, 1, 2].map((k) => field[point + (3 * part + k) * count] / 127);
    const m = this.motionOf(place, part);
    const [u, v, w] = actor.data.elastic ? actor.data.reference : ORIGIN;
    const [x, y, z] = [actor.rest[3 * point] - u, actor.rest[3 * point + 1] - v, actor.rest[3 * point + 2] - w];
    return [m[0] + m[4] * z - m[5] * y, m[1] + m[5] * x - m[3] * z, m[2] + m[3] * y - m[4] * x];
  }

  /** @param {number} place @param {number} part 0 for the real, 1 for the imaginary part @returns {Float32Array} */
  motionOf(place, part) {
    if (!this.motions || this.mode < 0) return new Float32Array(6);
    const start = 6 * ((2 * this.mode + part) * this.actors.length + place);
    return this.motions.subarray(start, start + 6);
  }

  /** Put all bodies where they are at an angle of the vibration: Re(X exp(i angle)). @param {number} angle */
  place(angle) {
    if (!this.data) return;
    const scale = this.amplitude * this.data.amplitude * this.data.diagonal;
    const [re, im] = [scale * Math.cos(angle), -scale * Math.sin(angle)];
    this.actors.forEach((actor, place) => {
      const field = this.fields[place];
      if (field) deform(actor, field, re / 127, im / 127);
      else if (actor.data.elastic) deform(actor, null, 0, 0);
      const quarter = this.motionOf(place, 1);
      const m = this.motionOf(place, 0).map((value, k) => re * value + im * quarter[k]);
      const turn = new THREE.Vector3(m[3], m[4], m[5]);
      const size = turn.length();
      const matrix = new THREE.Matrix4();
      if (size > 0) matrix.makeRotationAxis(turn.normalize(), size);
      const reference = new THREE.Vector3(...actor.data.reference);
      const shift = new THREE.Vector3(m[0], m[1], m[2]);
      const centre = reference.clone().applyMatrix4(matrix).negate().add(reference).add(shift);
      actor.mesh.matrix.copy(matrix).setPosition(centre);
      if (!actor.data.elastic) actor.mesh.matrix.multiply(actor.own);
      actor.mesh.visible = !this.hidden.has(actor.data.owner);
    });
  }

  /** Draw bodies and marks; marks stay where they are while bodies move. */
  draw() {
    this.render();
    drawMarks(this);
  }

  render() {
    this.light.position.copy(this.camera.position);
    this.renderer.render(this.scene, this.camera);
  }

  /** @param {boolean} on */
  setPlaying(on) {
    this.playing = on;
    if (!on) {
      this.place((this.angle = 0));
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
    this.place((this.angle = ((Math.PI * began) / 1000) * HALF_SPEED));
    this.render();
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
