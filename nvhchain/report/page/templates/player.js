"use strict";
const soundPlayer = (place, { data }, choice) => {
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const unpacked = ({ dtype, bdata }) =>
    new { i4: Int32Array, f4: Float32Array, f8: Float64Array }[dtype](bytes(bdata));
  const state = { run: 0, order: "", alone: false, playing: false, background: 0 };
  let context, sources = [], gains = [], noise, began = 0, offset = 0;

  const steady = (run) => {
    const line = unpacked(run.line), real = unpacked(run.real), imag = unpacked(run.imag);
    const chosen = new Set(state.order === "" ? [] : run.orders[state.order].lines);
    const buffer = context.createBuffer(1, run.count, run.rate), samples = buffer.getChannelData(0);
    const sum = new Float64Array(run.count);
    for (let n = 0; n < line.length; n++) {
      if (state.order !== "" && chosen.has(n) !== state.alone) continue;
      const step = 2 * Math.PI * line[n] / run.count, c = Math.cos(step), s = Math.sin(step);
      let x = real[n] / data.scale, y = imag[n] / data.scale;
      for (let i = 0; i < run.count; i++) {
        sum[i] += x;
        const turned = x * c - y * s;
        y = x * s + y * c;
        x = turned;
      }
    }
    samples.set(sum);
    return buffer;
  };

  const track = (run, of, rate, count) => {
    const angle = unpacked(run.angle), speed = unpacked(run.speed), real = unpacked(of.real), imag = unpacked(of.imag);
    const found = new Float64Array(count);
    for (let i = 0; i < count; i++) {
      const at = Math.min(i / rate / run.step, angle.length - 1), left = Math.min(Math.floor(at), angle.length - 2);
      const s = at - left, low = run.step * speed[left], high = run.step * speed[left + 1], rise = angle[left + 1] - angle[left];
      const phase = of.order * (angle[left] + s * (low + s * (3 * rise - 2 * low - high + s * (low + high - 2 * rise))));
      const x = real[left] + s * (real[left + 1] - real[left]), y = imag[left] + s * (imag[left + 1] - imag[left]);
      found[i] = (x * Math.cos(phase) - y * Math.sin(phase)) / data.scale;
    }
    return found;
  };

  const records = new Map();
  const sampled = (run) => {
    const wav = new DataView(bytes(run.wav)), rate = wav.getUint32(24, true), count = wav.getUint32(40, true) / 2;
    const whole = Float64Array.from({ length: count }, (_, i) => wav.getInt16(44 + 2 * i, true) / 32767);
    return { rate, whole };
  };
  const record = (run) => {
    if (!records.has(run)) records.set(run, sampled(run));
    const { rate, whole } = records.get(run);
    const buffer = context.createBuffer(1, whole.length, rate), samples = buffer.getChannelData(0);
    const part = state.order === "" ? null : track(run, run.orders[state.order], rate, whole.length);
    for (let i = 0; i < whole.length; i++) samples[i] = part === null ? whole[i] : state.alone ? part[i] : whole[i] - part[i];
    return buffer;
  };
  const made = (run) => (run.wav ? record(run) : steady(run));
  const level = (run) => (run === state.run ? 1 : 0);
  const longest = () => Math.max(...sources.map((source) => source.buffer.duration));
  const passed = () => (state.playing ? offset + context.currentTime - began : offset);
  const halt = () => {
    for (const source of sources) { source.onended = null; source.stop(); source.disconnect(); }
    if (noise) noise.source.stop();
    sources = []; gains = []; noise = undefined;
  };
  const start = () => {
    context ??= new AudioContext();
    context.resume();
    halt();
    began = context.currentTime + 0.05;
    data.runs.forEach((run, number) => {
      const source = context.createBufferSource(), gain = context.createGain();
      source.buffer = made(run);
      source.loop = !run.wav;
      gain.gain.value = level(number);
      source.connect(gain).connect(context.destination);
      source.start(began, source.loop ? offset % source.buffer.duration : Math.min(offset, source.buffer.duration));
      sources.push(source); gains.push(gain);
    });
    if (data.background) {
      const wav = sampled({ wav: data.background }), buffer = context.createBuffer(1, wav.whole.length, wav.rate);
      buffer.getChannelData(0).set(wav.whole);
      const source = context.createBufferSource(), gain = context.createGain();
      source.buffer = buffer; source.loop = true; gain.gain.value = state.background;
      source.connect(gain).connect(context.destination);
      source.start(began);
      noise = { source, gain };
    }
    if (data.runs[0].wav) sources.find((source) => source.buffer.duration === longest()).onended = () => { stop(); offset = 0; };
    state.playing = true;
    show();
  };
  const stop = () => { offset = passed(); halt(); state.playing = false; show(); };
  const again = () => { if (state.playing) { offset = passed() % longest(); start(); } };

  const tools = document.createElement("div"), filter = document.createElement("div");
  tools.className = filter.className = "tools";
  const play = Object.assign(document.createElement("button"), { type: "button", className: "play" });
  play.onclick = () => (state.playing ? stop() : start());
  const clock = document.createElement("output");
  clock.className = "clock";
  const show = () => {
    play.textContent = state.playing ? "■ Stop" : "▶ Play";
    play.setAttribute("aria-pressed", String(state.playing));
    Object.assign(place.dataset, { playing: state.playing, run: state.run });
  };
  tools.append(play);
  const runs = choice(tools, data.runs.map((run, number) => [number, run.name]), 0, (value) => {
    state.run = value;
    gains.forEach((gain, number) => gain.gain.setTargetAtTime(level(number), context.currentTime, 0.005));
    show();
  });
  runs.hidden = data.runs.length < 2;
  [...runs.children].forEach((button, number) => { button.style.borderBottom = `3px solid ${data.runs[number].colour}`; });
  if (data.runs[0].wav) {
    const seek = Object.assign(document.createElement("input"), { type: "range", min: 0, step: 0.05, value: 0 });
    seek.setAttribute("aria-label", "time");
    seek.max = Math.max(...data.runs.map((run) => (run.wav.length * 0.75 - 46) / 2 / new DataView(bytes(run.wav.slice(0, 64))).getUint32(24, true)));
    seek.oninput = () => { offset = Number(seek.value); if (state.playing) start(); };
    tools.append(seek, clock);
    setInterval(() => {
      if (state.playing) seek.value = passed();
      clock.textContent = `${Number(seek.value).toFixed(1)} s`;
    }, 100);
  }
  const orders = document.createElement("select");
  orders.setAttribute("aria-label", "orders");
  const option = (text, value) => orders.append(Object.assign(document.createElement("option"), { textContent: text, value }));
  option("all orders", "");
  (data.runs[0].orders ?? []).forEach(({ name }, number) => option(`without ${name}`, `w${number}`));
  (data.runs[0].orders ?? []).forEach(({ name }, number) => option(`only ${name}`, `o${number}`));
  orders.onchange = () => {
    state.alone = orders.value.startsWith("o");
    state.order = orders.value === "" ? "" : Number(orders.value.slice(1));
    again();
  };
  filter.append("Orders", orders);
  if (data.background) {
    const slider = Object.assign(document.createElement("input"), { type: "range", min: -30, max: 0, step: 1, value: -30 });
    const told = document.createElement("output");
    slider.setAttribute("aria-label", "background");
    slider.oninput = () => {
      state.background = slider.value <= -30 ? 0 : 10 ** (slider.value / 20);
      told.textContent = slider.value <= -30 ? "off" : `${slider.value} dB`;
      if (noise) noise.gain.gain.setTargetAtTime(state.background, context.currentTime, 0.005);
    };
    filter.append("Background", slider, told);
    slider.oninput();
  }
  place.append(tools, filter);
  place.sound = { made: (number, order, alone) => {  // for tests: samples as played
    context ??= new AudioContext();
    Object.assign(state, { order, alone });
    const buffer = made(data.runs[number]);
    state.order = "";
    return buffer;
  } };
  show();
};
