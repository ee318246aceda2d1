const bodyPainter = (canvas) => {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const shader = (kind, text) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, `#version 300 es\nprecision highp float;\n${text}`);
    gl.compileShader(made);
    return made;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    in vec3 place, re, im, bow; in vec3 tint;
    uniform mat3 turn; uniform vec3 middle, scale; uniform vec2 phase;
    out vec3 colour, seen, bent;
    void main() {
      seen = turn * (place + phase.x * re - phase.y * im - middle);
      colour = tint;
      bent = turn * bow;
      gl_Position = vec4(seen * scale, 1.0);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    in vec3 colour, seen, bent; out vec4 pixel;
    void main() {
      vec3 n = normalize(normalize(cross(dFdx(seen), dFdy(seen))) + bent);
      float light = 0.6 + 0.4 * abs(dot(n, normalize(vec3(-0.25, 0.35, 1.0))));
      pixel = vec4(colour * light, 1.0);
    }`));
  gl.linkProgram(program);
  gl.useProgram(program);
  gl.enable(gl.DEPTH_TEST);
  const load = (name, values, type = gl.FLOAT) => {
    const at = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 3, type, type !== gl.FLOAT, 0, 0);
  };
  const set = (name, kind, ...values) => gl[`uniform${kind}`](gl.getUniformLocation(program, name), ...values);
  const paint = (corners, middle, turn, scale, phase) => {
    canvas.width = canvas.clientWidth * devicePixelRatio;
    canvas.height = canvas.clientHeight * devicePixelRatio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    set("turn", "Matrix3fv", false, turn);
    set("middle", "3fv", middle);
    const fit = scale * Math.min(1, canvas.width / canvas.height);
    set("scale", "3fv", [fit * canvas.height / canvas.width, fit, -0.4 * fit]);
    set("phase", "2fv", phase);
    gl.drawArrays(gl.TRIANGLES, 0, corners);
  };
  return { load, paint, bytes: gl.UNSIGNED_BYTE };
};

const movingBodies = (place, { data }, height, choice) => {
  const RANGE = 30, TOP = 0.995, STIFF = 0.05, SIZE = 0.06, PERIOD = 1800, CREASE = 0.75;
  const RAMP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  const SIGNED = [[33, 102, 172], [146, 197, 222], [247, 247, 247], [244, 165, 130], [178, 24, 43]];
  const kinds = { i1: Int8Array, i2: Int16Array, i4: Int32Array, f4: Float32Array, f8: Float64Array };
  const unpacked = ({ dtype, bdata }) => new kinds[dtype](Uint8Array.from(atob(bdata), (letter) => letter.charCodeAt(0)).buffer);
  const three = (make) => [make(0), make(1), make(2)];
  const cross = (a, b) => three((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);

  /* A vertex moves so that the normal motion of its faces is met in the least squares: matrix per vertex, inverted. */
  const surfaces = data.surfaces.map((of) => {
    const vertex = unpacked(of.vertices), corner = unpacked(of.triangles);
    const faces = corner.length / 3, points = vertex.length / 3;
    const normal = new Float32Array(3 * faces), area = new Float32Array(faces), sums = new Float64Array(6 * points);
    for (let face = 0; face < faces; face++) {
      const at = three((k) => three((axis) => vertex[3 * corner[3 * face + k] + axis]));
      const across = cross(three((k) => at[1][k] - at[0][k]), three((k) => at[2][k] - at[0][k]));
      const size = Math.hypot(...across) || 1, n = across.map((part) => part / size);
      area[face] = size / 2;
      normal.set(n, 3 * face);
      const parts = [n[0] * n[0] + STIFF, n[1] * n[1] + STIFF, n[2] * n[2] + STIFF, n[0] * n[1], n[0] * n[2], n[1] * n[2]];
      for (let k = 0; k < 3; k++) parts.forEach((part, i) => { sums[6 * corner[3 * face + k] + i] += area[face] * part; });
    }
    const inverse = new Float64Array(6 * points);
    for (let p = 0; p < points; p++) {
      const [a, b, c, d, e, f] = sums.subarray(6 * p, 6 * p + 6);
      const minors = [b * c - f * f, a * c - e * e, a * b - d * d, e * f - c * d, d * f - b * e, d * e - a * f];
      const det = a * minors[0] + d * minors[3] + e * minors[4];
      minors.forEach((part, i) => { inverse[6 * p + i] = part / (det || 1); });
    }
    /* Faces around each corner that go on without a crease: its colour and normal are their mean. */
    const at = Array.from({ length: points }, () => []);
    corner.forEach((p, i) => at[p].push(Math.floor(i / 3)));
    const along = (f, g) => normal[3 * f] * normal[3 * g] + normal[3 * f + 1] * normal[3 * g + 1] + normal[3 * f + 2] * normal[3 * g + 2];
    const around = Array.from(corner, (p, i) => at[p].filter((face) => along(face, Math.floor(i / 3)) > CREASE));
    const bow = new Float32Array(3 * corner.length);
    around.forEach((faces, i) => {
      const mean = three((axis) => faces.reduce((sum, face) => sum + area[face] * normal[3 * face + axis], 0)), size = Math.hypot(...mean) || 1;
      for (let axis = 0; axis < 3; axis++) bow[3 * i + axis] = mean[axis] / size - normal[3 * Math.floor(i / 3) + axis];
    });
    const low = three(() => Infinity), high = three(() => -Infinity);
    vertex.forEach((x, i) => { low[i % 3] = Math.min(low[i % 3], x); high[i % 3] = Math.max(high[i % 3], x); });
    const middle = low.map((x, axis) => (x + high[axis]) / 2), span = Math.hypot(...high.map((x, axis) => x - low[axis]));
    let radius = 0;
    for (let p = 0; p < points; p++) radius = Math.max(radius, Math.hypot(...three((axis) => vertex[3 * p + axis] - middle[axis])));
    return { vertex, corner, faces, points, normal, area, around, bow, inverse, middle, span, radius, shapes: unpacked(of.shapes.values), step: unpacked(of.shapes.step) };
  });
  const runs = data.runs.map((run) => ({
    ...run, body: surfaces[run.surface], real: unpacked(run.real), imag: unpacked(run.imag),
    given: Object.fromEntries(Object.entries(run.values).map(([title, of]) => [title, { values: unpacked(of.values), step: unpacked(of.step) }])),
  }));
  const radius = Math.max(...surfaces.map((of) => of.radius + SIZE * of.span));
  const state = { line: data.chosen, colours: 0, playing: false, phase: 0, size: 1, resting: true, zoom: 1, yaw: Math.atan2(data.eye.x, data.eye.z), pitch: Math.asin(data.eye.y / Math.hypot(data.eye.x, data.eye.y, data.eye.z)) };

  const summed = ({ body, real, imag }) => {
    const count = body.step.length, size = body.shapes.length / count, re = new Float32Array(size), im = new Float32Array(size);
    for (let s = 0; s < count; s++) {
      const a = real[state.line * count + s] * body.step[s], b = imag[state.line * count + s] * body.step[s];
      for (let i = 0, at = s * size; i < size; i++, at++) { re[i] += a * body.shapes[at]; im[i] += b * body.shapes[at]; }
    }
    return { re, im };
  };
  /* Size of the motion of the faces whose vertices are given. */
  const faceSize = (body, { re, im }) => ({
    re: new Float32Array(body.faces).map((_, face) => Math.max(...three((k) => {
      const i = 3 * body.corner[3 * face + k];
      return Math.hypot(re[i], re[i + 1], re[i + 2], im[i], im[i + 1], im[i + 2]);
    }))),
    im: new Float32Array(body.faces),
  });
  const vertexMotion = (body, values) => {
    const load = new Float64Array(3 * body.points), moved = new Float32Array(3 * body.points);
    for (let face = 0; face < body.faces; face++)
      for (let k = 0; k < 3; k++)
        for (let axis = 0; axis < 3; axis++) load[3 * body.corner[3 * face + k] + axis] += body.area[face] * values[face] * body.normal[3 * face + axis];
    for (let p = 0; p < body.points; p++) {
      const [a, b, c, d, e, f] = body.inverse.subarray(6 * p, 6 * p + 6), [x, y, z] = load.subarray(3 * p, 3 * p + 3);
      moved.set([a * x + d * y + e * z, d * x + b * y + f * z, e * x + f * y + c * z], 3 * p);
    }
    return moved;
  };
  const expanded = ({ corner }, values) => {
    const found = new Float32Array(3 * corner.length);
    for (let at = 0; at < corner.length; at++) for (let axis = 0; axis < 3; axis++) found[3 * at + axis] = values[3 * corner[at] + axis];
    return found;
  };
  const move = () => {
    let largest = 0;
    for (const run of runs) {
      const found = summed(run), given = found.re.length === 3 * run.body.points && found.re.length !== run.body.faces;
      run.face = given ? faceSize(run.body, found) : found;
      run.motion = given ? found : { re: vertexMotion(run.body, found.re), im: vertexMotion(run.body, found.im) };
      const { re, im } = run.motion;
      for (let i = 0; i < re.length; i += 3)
        largest = Math.max(largest, Math.hypot(re[i], re[i + 1], re[i + 2], im[i], im[i + 1], im[i + 2]));
    }
    state.scale = largest ? SIZE / largest : 0;
    for (const run of runs) for (const part of ["re", "im"]) run.painter.load(part, expanded(run.body, run.motion[part]));
  };
  const tint = () => {
    const { kind, reference, title, unit } = data.colours[state.colours], inside = kind === "signed" || kind === "given";
    for (const run of runs) {
      const given = run.given[title], { re, im } = run.face;
      run.shown = new Float32Array(run.body.faces).map((_, face) => inside ? given.values[state.line * run.body.faces + face] * given.step[state.line] : Math.hypot(re[face], im[face]));
      if (kind === "level") run.shown = run.shown.map((v) => Math.max(20 * Math.log10(v / Math.SQRT2 / reference), -100));
    }
    const sorted = Float32Array.from(runs.flatMap((run) => [...run.shown])).map((v) => (kind === "signed" ? Math.abs(v) : v)).sort();
    const top = sorted[Math.floor(TOP * (sorted.length - 1))] || 1e-9;
    const [low, high] = kind === "level" || kind === "given" ? [Math.ceil(top) - RANGE, Math.ceil(top)] : kind === "signed" ? [-top, top] : [0, top];
    const ramp = kind === "signed" ? SIGNED : RAMP, last = ramp.length - 1;
    for (const run of runs) {
      const found = new Uint8Array(9 * run.body.faces), { area, around } = run.body;
      around.forEach((faces, i) => {
        const size = faces.reduce((sum, face) => sum + area[face], 0) || 1, value = faces.reduce((sum, face) => sum + area[face] * run.shown[face], 0) / size;
        const at = Math.min(Math.max((value - low) / (high - low), 0), 1) * last, k = Math.min(Math.floor(at), last - 1);
        for (let j = 0; j < 3; j++) found[3 * i + j] = ramp[k][j] + (at - k) * (ramp[k + 1][j] - ramp[k][j]);
      });
      run.painter.load("tint", found, run.painter.bytes);
    }
    const number = (value) => kind === "size" ? (value / (top || 1)).toFixed(1) : kind === "level" || kind === "given" ? value.toFixed(0).replace("-", "−") : value.toPrecision(2);
    key.innerHTML = "";
    if (kind === "given" && runs.every((run) => run.given[title].step[state.line] === 0)) { key.append("not computed at this line"); return; }
    key.append(number(low), make("span", { className: "ramp" }), `${number(high)} ${unit}`);
    key.querySelector(".ramp").style.background = `linear-gradient(to right, ${ramp.map((of) => `rgb(${of})`).join(", ")})`;
  };
  const turned = () => {
    const { yaw, pitch } = state, c = Math.cos(yaw), s = Math.sin(yaw), e = [s * Math.cos(pitch), Math.sin(pitch), c * Math.cos(pitch)];
    return [[c, 0, -s], cross(e, [c, 0, -s]), e];
  };
  const factors = ({ body }) => {
    const size = state.resting ? 0 : state.size * state.scale * body.span;
    return [size * Math.cos(state.phase), size * Math.sin(state.phase)];
  };
  const draw = () => {
    const rows = turned(), columns = [0, 1, 2].flatMap((k) => rows.map((row) => row[k]));
    for (const run of runs) run.painter.paint(run.body.corner.length, run.body.middle, columns, state.zoom * 0.97 / radius, factors(run));
  };

  const make = (tag, more = {}) => Object.assign(document.createElement(tag), more);
  const ranged = (name, max, value) => {
    const slider = make("input", { type: "range", min: 0, max, step: 1, value });
    slider.setAttribute("aria-label", name);
    return slider;
  };
  const tools = make("div", { className: "tools" }), second = make("div", { className: "tools" });
  const slider = ranged(data.what, data.lines.length - 1, data.chosen), output = make("output");
  tools.append(make("span", { textContent: data.what }), slider, output);
  const button = make("button", { type: "button", className: "play", textContent: "▶ Move" });
  const phase = ranged("phase", 360, 0), amplitude = ranged("size", 30, 10), key = make("span", { className: "key" });
  phase.className = amplitude.className = "short";
  second.append(button, make("span", { textContent: "phase" }), phase, make("span", { textContent: "size" }), amplitude);
  if (data.colours.length > 1) choice(second, data.colours.map(({ title }, number) => [number, title]), 0, (number) => { state.colours = number; tint(); draw(); });
  second.append(key);
  const bodies = make("div", { className: "bodies" });
  place.append(tools, second, bodies);

  const face = (run, x, y) => {  /* nearest face under a point, in units of the window */
    const rows = turned(), [c, s] = factors(run), { body, motion } = run;
    const at = (p) => {
      const moved = three((axis) => body.vertex[3 * p + axis] + c * motion.re[3 * p + axis] - s * motion.im[3 * p + axis] - body.middle[axis]);
      return rows.map((row) => row[0] * moved[0] + row[1] * moved[1] + row[2] * moved[2]);
    };
    let found = -1, depth = -Infinity;
    for (let f = 0; f < body.faces; f++) {
      const [a, b, d] = three((k) => at(body.corner[3 * f + k]));
      const side = (p, q) => (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
      const signs = [side(a, b), side(b, d), side(d, a)];
      if ((signs.every((v) => v >= 0) || signs.every((v) => v <= 0)) && a[2] + b[2] + d[2] > depth) { found = f; depth = a[2] + b[2] + d[2]; }
    }
    return found;
  };
  for (const run of runs) {
    const cell = make("div"), title = make("h3", { textContent: run.title }), canvas = make("canvas", { tabIndex: 0 });
    canvas.style.height = `${height}px`;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${run.title}: drag or arrow keys turn it`);
    cell.append(title, canvas);
    bodies.append(cell);
    run.painter = bodyPainter(canvas);
    if (!run.painter) { place.replaceChildren(make("p", { textContent: "Bodies need WebGL 2, which this browser does not draw." })); return; }
    run.painter.load("place", expanded(run.body, run.body.vertex));
    run.painter.load("bow", run.body.bow);
    let from = null;
    const turn = (x, y) => { state.yaw -= x; state.pitch = Math.min(Math.max(state.pitch + y, -1.55), 1.55); draw(); };
    canvas.onpointerdown = (event) => { from = event; canvas.setPointerCapture(event.pointerId); };
    canvas.onpointerup = canvas.onpointercancel = () => { from = null; };
    canvas.onpointermove = (event) => {
      if (from) { turn(0.01 * (event.clientX - from.clientX), 0.01 * (event.clientY - from.clientY)); from = event; return; }
      const unit = 2 * radius / (0.97 * state.zoom * Math.min(canvas.clientHeight, canvas.clientWidth)), box = canvas.getBoundingClientRect();
      const under = face(run, unit * (event.clientX - box.left - box.width / 2), unit * (box.top + box.height / 2 - event.clientY));
      canvas.title = under < 0 ? "" : `${run.shown[under].toPrecision(4).replace("-", "−")} ${data.colours[state.colours].unit}`;
    };
    canvas.onkeydown = (event) => {
      const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
      if (step) { event.preventDefault(); turn(...step); }
    };
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      state.zoom = Math.min(Math.max(state.zoom * Math.exp(-event.deltaY / 600), 0.5), 12);
      draw();
    }, { passive: false });
    new ResizeObserver(draw).observe(canvas);
  }
  const describe = () => { output.textContent = data.lines[state.line]; };
  slider.oninput = () => { state.line = Number(slider.value); move(); tint(); draw(); describe(); };
  phase.oninput = () => { state.resting = false; state.phase = Number(phase.value) * Math.PI / 180; draw(); };
  amplitude.oninput = () => { state.resting = false; state.size = Number(amplitude.value) / 10; draw(); };
  const step = (time) => {
    if (!state.playing) return;
    state.phase = 2 * Math.PI * (time % PERIOD) / PERIOD;
    phase.value = Math.round(state.phase * 180 / Math.PI);
    const { top, bottom } = place.getBoundingClientRect();
    if (bottom > 0 && top < window.innerHeight) draw();
    requestAnimationFrame(step);
  };
  button.onclick = () => {
    state.playing = !state.playing;
    state.resting = false;
    button.textContent = state.playing ? "❚❚ Hold" : "▶ Move";
    button.setAttribute("aria-pressed", String(state.playing));
    if (state.playing) requestAnimationFrame(step);
  };
  move();
  tint();
  draw();
  describe();
};
