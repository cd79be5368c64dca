"""Modes of a gearbox as a self-contained web page: turn, zoom, animate in any browser with WebGL 2, offline.

The page carries the bodies once and a motion per body and mode; everything else happens in its shaders.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exugear.pictures.scene import DISPLACEMENT_COLOURS, body_colours
from exugear.pictures.shapes import ModeScene, displacement_of
from fe_ste.tools.files import write_file


def write_mode_page(
    scenes: Sequence[ModeScene], path: str | Path, *, heading: str = "Mode shapes", first: int = 0
) -> Path:
    """Write a web page that shows modes of one gearbox.

    Parameters
    ----------
    scenes : sequence of ModeScene
        Modes to choose from, all of the same bodies; their titles are the choices.
    path : path-like
        Where to write the page.
    heading : str
        Gearbox, variant, mesh law and inertia set.
    first : int
        Mode that is shown when the page opens.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    ValueError
        If there is no mode or the modes differ in their bodies.
    """
    if not scenes:
        raise ValueError("mode page: no mode given")
    bodies = scenes[0].bodies
    if any([body.name for body in scene.bodies] != [body.name for body in bodies] for scene in scenes):
        raise ValueError("mode page: all modes must be of the same bodies")
    points = np.concatenate([body.surface.points for body in bodies])
    colours = body_colours(bodies)
    data = {
        "heading": heading,
        "first": first,
        "centre": np.round(0.5 * (points.min(axis=0) + points.max(axis=0)), 6).tolist(),
        "radius": round(0.5 * float(np.linalg.norm(np.ptp(points, axis=0))), 6),
        "colours": [_channels(colour) for colour in DISPLACEMENT_COLOURS],
        "bodies": [
            {
                "name": body.name,
                "fixed": body.fixed,
                "colour": [round(channel, 4) for channel in colours[body.family]],
                "reference": body.reference.tolist(),
                "points": _encoded(body.surface.points.astype("<f4")),
                "triangles": _encoded(body.surface.triangles.astype("<u4")),
            }
            for body in bodies
        ],
        "modes": [_mode(scene) for scene in scenes],
    }
    # Names are free: as escapes of JSON, none of them ends the script element or begins another.
    text = json.dumps(data, separators=(",", ":")).translate({ord(sign): f"\\u{ord(sign):04x}" for sign in "<>&"})
    target = Path(path)
    pieces = {"@HEADING@": html.escape(heading), "@DATA@": text}
    # In one pass, so that nothing in a name is taken for a place to put something.
    page = re.sub("|".join(pieces), lambda found: pieces[found[0]], _PAGE)
    write_file(target, page.encode("utf-8", errors="replace"))
    return target


def _mode(scene: ModeScene) -> dict[str, object]:
    largest = max(
        float(np.linalg.norm(displacement_of(body, motion), axis=1).max())
        for body, motion in zip(scene.bodies, scene.motions, strict=True)
    )
    motions = [[float(f"{value:.6g}") for value in motion] for motion in scene.motions]
    return {"title": scene.title, "largest": largest, "motions": motions}


def _encoded(values: NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _channels(colour: str) -> list[float]:
    return [round(int(colour[place : place + 2], 16) / 255.0, 4) for place in (1, 3, 5)]


_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>@HEADING@</title>
<style>
  html, body { margin: 0; height: 100%; font: 14px/1.4 system-ui, sans-serif; color: #222; background: #fff; }
  body { display: flex; flex-direction: column; }
  header { display: flex; flex-wrap: wrap; gap: 6px 18px; align-items: center; padding: 8px 14px; }
  header { border-bottom: 1px solid #ddd; }
  h1 { font-size: 15px; margin: 0; }
  select { font: inherit; max-width: 60ch; }
  main { position: relative; flex: 1; min-height: 0; }
  canvas { width: 100%; height: 100%; display: block; touch-action: none; cursor: grab; }
  aside { position: absolute; right: 12px; top: 12px; padding: 8px 10px; background: rgba(255,255,255,.85); }
  aside label { display: block; white-space: nowrap; }
  .swatch { display: inline-block; width: 10px; height: 10px; margin: 0 4px; border: 1px solid #777; }
  #bar { width: 170px; height: 10px; margin-top: 8px; border: 1px solid #777; }
  #ends { display: flex; justify-content: space-between; font-size: 12px; }
  #hint { position: absolute; left: 14px; bottom: 8px; font-size: 12px; color: #666; }
  #failure { position: absolute; inset: 0; display: none; align-items: center; justify-content: center; }
</style>
</head>
<body>
<header>
  <h1>@HEADING@</h1>
  <label>Mode <select id="mode"></select></label>
  <button id="play" type="button">Pause</button>
  <label>Amplitude <input id="amplitude" type="range" min="0" max="3" step="0.05" value="1"></label>
  <label><input id="byBody" type="checkbox"> colours of bodies</label>
</header>
<main>
  <canvas id="view"></canvas>
  <aside>
    <div id="bodies"></div>
    <div id="bar"></div>
    <div id="ends"><span>0</span><span>displacement</span><span>largest</span></div>
  </aside>
  <div id="hint">drag: turn, shift-drag or two fingers: move, wheel or pinch: zoom, double click: reset</div>
  <div id="failure">This page needs WebGL 2.</div>
</main>
<script type="application/json" id="data">@DATA@</script>
<script>
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
  data.modes.forEach((mode, number) => choice.add(new Option(mode.title.replace(/\\n/g, ", "), number)));
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
</script>
</body>
</html>
"""
