"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const canvas = document.getElementById("view");
const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
if (!gl) document.getElementById("failure").style.display = "flex"; else start();

function bytes(text) {
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
}

function program(vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

// Rotation about a reference point and a shift, column-major.
function motionMatrix(c, m, part) {
  const t = [part * m[3], part * m[4], part * m[5]], a = Math.hypot(...t);
  const [x, y, z] = a > 0 ? t.map(v => v / a) : [0, 0, 1], s = Math.sin(a), k = 1 - Math.cos(a);
  const r = [1 - k*(y*y + z*z), k*x*y + s*z, k*x*z - s*y,
             k*x*y - s*z, 1 - k*(x*x + z*z), k*y*z + s*x,
             k*x*z + s*y, k*y*z - s*x, 1 - k*(x*x + y*y)];
  const d = [0, 1, 2].map(i => c[i] + part * m[i] - (r[i]*c[0] + r[3 + i]*c[1] + r[6 + i]*c[2]));
  return [r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6], r[7], r[8], 0, d[0], d[1], d[2], 1];
}

function start() {
  const shading = program(`#version 300 es
    in vec3 position;
    uniform mat4 motion, camera;
    uniform vec3 reference, shift, turn;
    uniform float largest;
    out vec3 place;
    out float share;
    void main() {
      share = length(shift + cross(turn, position - reference)) / largest;
      vec4 seen = camera * (motion * vec4(position, 1.0));
      place = seen.xyz;
      gl_Position = vec4(seen.xy, -0.2 * seen.z, 1.0);
    }`, `#version 300 es
    precision highp float;
    in vec3 place;
    in float share;
    uniform vec3 stops[5], plain;
    uniform vec2 scale;
    uniform float alpha, byBody;
    out vec4 colour;
    void main() {
      vec3 eye = vec3(place.xy / scale, place.z);
      vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
      float light = 0.5 + 0.45 * abs(normal.z) + 0.12 * max(0.0, dot(normal, normalize(vec3(0.4, 0.8, 0.4))));
      float at = clamp(share, 0.0, 1.0) * 4.0;
      int low = min(int(at), 3);
      vec3 mixed = mix(stops[low], stops[low + 1], at - float(low));
      colour = vec4(mix(mixed, plain, byBody) * light, alpha);
    }`);
  gl.useProgram(shading);
  const at = name => gl.getUniformLocation(shading, name);
  const place = Object.fromEntries(["motion", "camera", "reference", "shift", "turn", "largest", "stops", "plain",
    "scale", "alpha", "byBody"].map(name => [name, at(name)]));
  gl.uniform3fv(place.stops, data.colours.flat());
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  gl.clearColor(1, 1, 1, 1);

  const bodies = data.bodies.map((body, number) => {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, bytes(body.points), gl.STATIC_DRAW);
    const where = gl.getAttribLocation(shading, "position");
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 0, 0);
    const triangles = new Uint32Array(bytes(body.triangles));
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    return { ...body, number, array, count: triangles.length, shown: true };
  });
  // Solid bodies first, then what is seen through.
  const inOrder = [...bodies].sort((a, b) => a.fixed - b.fixed);

  const list = document.getElementById("bodies");
  for (const body of bodies) {
    const [label, box, swatch] = ["label", "input", "span"].map(kind => document.createElement(kind));
    box.type = "checkbox"; box.checked = true;
    box.onchange = () => { body.shown = box.checked; };
    swatch.className = "swatch";
    swatch.style.background = `rgb(${body.colour.map(c => Math.round(255 * c)).join(",")})`;
    label.append(box, swatch, body.name);
    list.append(label);
  }
  const rgb = c => `rgb(${c.map(v => Math.round(255 * v)).join(",")})`;
  document.getElementById("bar").style.background = `linear-gradient(to right, ${data.colours.map(rgb).join(",")})`;
  const choice = document.getElementById("mode");
  data.modes.forEach((mode, number) => choice.add(new Option(mode.title.replace(/\n/g, ", "), number)));
  choice.value = String(data.first);

  const initial = { azimuth: 2.5, height: 0.36, zoom: 1, x: 0, y: 0 };
  const eye = { ...initial };
  const fingers = new Map();
  canvas.onpointerdown = event => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  };
  canvas.onpointerup = canvas.onpointercancel = event => fingers.delete(event.pointerId);
  canvas.onpointermove = event => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before[0], dy = event.clientY - before[1];
    if (fingers.size > 1) {
      const other = [...fingers].find(([id]) => id !== event.pointerId)[1];
      const old = Math.hypot(before[0] - other[0], before[1] - other[1]);
      eye.zoom *= Math.hypot(event.clientX - other[0], event.clientY - other[1]) / Math.max(old, 1);
    }
    if (fingers.size > 1 || event.shiftKey) {
      eye.x += 2 * dx / canvas.clientHeight; eye.y -= 2 * dy / canvas.clientHeight;
    } else {
      eye.azimuth -= 0.008 * dx;
      eye.height = Math.min(1.57, Math.max(-1.57, eye.height + 0.008 * dy));
    }
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  };
  canvas.onwheel = event => { event.preventDefault(); eye.zoom *= Math.exp(-0.0015 * event.deltaY); };
  canvas.ondblclick = () => Object.assign(eye, initial);

  let phase = 0, last = null, running = true;
  const play = document.getElementById("play");
  play.onclick = () => { running = !running; play.textContent = running ? "Pause" : "Play"; };

  function frame(now) {
    if (running && last !== null) phase += (now - last) / 1600 * 2 * Math.PI;
    last = now;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const aspect = width / height, size = 1.25 * eye.zoom * Math.min(1, aspect) / data.radius;
    const scale = [size / aspect, size];
    // y points up; the eye goes round the y axis at the azimuth (from +z towards +x) and looks down from the height.
    const ca = Math.cos(eye.azimuth), sa = Math.sin(eye.azimuth), ch = Math.cos(eye.height), sh = Math.sin(eye.height);
    const right = [ca, 0, -sa], back = [sa * ch, sh, ca * ch], up = [-sa * sh, ch, -ca * sh];
    const dot = (a, b) => a[0]*b[0] + a[1]*b[1] + a[2]*b[2], c = data.centre;
    const rows = [right.map(v => v * scale[0]), up.map(v => v * scale[1]), back.map(v => v / data.radius)];
    const shift = [eye.x / aspect - dot(rows[0], c), eye.y - dot(rows[1], c), -dot(rows[2], c)];
    const camera = [0, 1, 2].flatMap(i => [rows[0][i], rows[1][i], rows[2][i], 0]).concat(shift, 1);
    gl.uniformMatrix4fv(place.camera, false, camera);
    gl.uniform2f(place.scale, scale[0] * data.radius, scale[1] * data.radius);
    gl.uniform1f(place.byBody, document.getElementById("byBody").checked ? 1 : 0);
    const mode = data.modes[Number(choice.value)];
    const part = Number(document.getElementById("amplitude").value) * Math.cos(phase);
    gl.uniform1f(place.largest, mode.largest);
    for (const body of inOrder) {
      if (!body.shown) continue;
      const m = mode.motions[body.number];
      gl.uniformMatrix4fv(place.motion, false, motionMatrix(body.reference, m, part));
      gl.uniform3fv(place.reference, body.reference);
      gl.uniform3fv(place.shift, m.slice(0, 3));
      gl.uniform3fv(place.turn, m.slice(3));
      gl.uniform3fv(place.plain, body.colour);
      gl.uniform1f(place.alpha, body.fixed ? 0.18 : 1);
      gl.depthMask(!body.fixed);
      body.fixed ? gl.enable(gl.BLEND) : gl.disable(gl.BLEND);
      gl.bindVertexArray(body.array);
      gl.drawElements(gl.TRIANGLES, body.count, gl.UNSIGNED_INT, 0);
    }
    gl.depthMask(true);
    requestAnimationFrame(frame);
  }
  requestAnimationFrame(frame);
}
