"use strict";
(() => {
  const font = { family: 'system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif', size: 13, color: "#1d2329" };
  const config = {
    responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "toImage"],
    modeBarButtonsToAdd: [{
      name: "Save as SVG", icon: Plotly.Icons.camera,
      click: (plot) => Plotly.downloadImage(plot, { format: "svg", filename: plot.id, width: 1100, height: plot.offsetHeight }),
    }],
  };
  if (innerWidth < 560) config.displayModeBar = false;  // it would hide the legend
  const axis = { gridcolor: "#e6e8eb", zerolinecolor: "#c5cad0", linecolor: "#8a929b", ticks: "outside", automargin: true };
  const base = (layout, height) => ({
    font, height, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: "closest",
    margin: { l: 60, r: 16, t: 34, b: 46 }, modebar: { bgcolor: "rgba(255,255,255,0.7)", color: "#8a929b", activecolor: "#0072b2" },
    legend: { orientation: "h", x: 0, y: 1, xanchor: "left", yanchor: "bottom" },
    ...layout,
  });

  const choice = (tools, options, chosen, act) => {
    const group = document.createElement("span");
    group.className = "choice";
    for (const [value, text] of options) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.dataset.value = value;
      button.setAttribute("aria-pressed", String(value === chosen));
      button.onclick = () => {
        for (const other of group.children) other.setAttribute("aria-pressed", String(other === button));
        act(value);
      };
      group.append(button);
    }
    tools.append(group);
    return group;
  };

  const aWeighting = (f) => {
    const s = f * f;
    const gain = 12194.217 ** 2 * s * s /
      ((s + 20.598997 ** 2) * Math.sqrt((s + 107.65265 ** 2) * (s + 737.86223 ** 2)) * (s + 12194.217 ** 2));
    return 20 * Math.log10(Math.max(gain, 1e-300)) + 1.9997;
  };
  const sum = (levels) => 10 * Math.log10(Math.max(levels.reduce((all, level) => all + 10 ** (level / 10), 0), 1e-30));
  const band = (f) => Math.round(10 * Math.log10(f));
  const nominal = (number) => {
    const digits = ["1", "1.25", "1.6", "2", "2.5", "3.15", "4", "5", "6.3", "8"][((number % 10) + 10) % 10];
    const value = Number(digits) * 10 ** Math.floor(number / 10);
    return value >= 1000 ? `${+(value / 1000).toPrecision(3)}k` : String(+value.toPrecision(3));
  };

  const spectrum = (plot, { data }, height) => {
    const state = { axis: "hz", weight: data.weighted ? "A" : "Z", scale: "linear", view: "lines", point: 0 };
    const tools = document.createElement("div");
    tools.className = "tools";
    plot.before(tools);
    const set = (name) => (value) => { state[name] = value; draw(); };
    choice(tools, [["lines", "Lines"], ["thirds", "Third octaves"]], state.view, set("view"));
    const axes = choice(tools, [["hz", "Hz"], ["order", "Order"]], state.axis, set("axis"));
    const scales = choice(tools, [["linear", "Linear"], ["log", "Logarithmic"]], state.scale, set("scale"));
    choice(tools, [["Z", "dB"], ["A", "dB(A)"]], state.weight, set("weight"));
    const points = data.points.length;
    if (points > 1) choice(tools, data.points.map((name, number) => [number, name]), 0, set("point"));
    const orders = data.runs.every((run) => run.turns > 0);
    const oneSpeed = new Set(data.runs.map((run) => run.turns.toFixed(6))).size === 1;

    const draw = () => {
      const thirds = state.view === "thirds";
      for (const button of axes.children) button.disabled = thirds || (button.dataset.value === "order" && !orders);
      for (const button of scales.children) button.disabled = thirds;
      const unit = state.weight === "A" ? "dB(A)" : "dB";
      const levels = data.runs.map((run) => run.level[state.point].map((level, line) =>
        state.weight === "A" ? level + aWeighting(run.frequency[line]) : level));
      const top = 5 * Math.ceil(Math.max(...levels.flat()) / 5) + 5;
      const floor = top - 75;
      const name = (run, number) => `${run.name}: ${sum(levels[number]).toFixed(1).replace("-", "−")} ${unit}`;
      const layout = { yaxis: { ...axis, title: { text: `level / ${unit} re ${data.reference}`, font: { size: 13 } }, range: [floor, top] } };
      const traces = [];
      if (thirds) {
        const numbers = data.runs.map((run) => run.frequency.map(band));
        const first = Math.min(...numbers.map((of) => Math.min(...of))), last = Math.max(...numbers.map((of) => Math.max(...of)));
        const all = Array.from({ length: last - first + 1 }, (_, at) => first + at);
        data.runs.forEach((run, number) => traces.push({
          type: "bar", name: name(run, number), marker: { color: run.colour, pattern: { shape: ["", "/", "x", "."][number % 4], fillmode: "overlay", fgcolor: "white", fgopacity: 0.55, size: 7 } },
          x: all.map(nominal),
          y: all.map((of) => Math.max(sum(levels[number].filter((_, line) => numbers[number][line] === of)), floor) - floor),
          base: floor, hovertemplate: `%{x} Hz: %{customdata:.1f} ${unit}<extra>${run.name}</extra>`,
          customdata: all.map((of) => sum(levels[number].filter((_, line) => numbers[number][line] === of))),
        }));
        layout.xaxis = { ...axis, type: "category", title: { text: "third octave / Hz", font: { size: 13 } } };
        layout.bargap = 0.25;
      } else {
        data.runs.forEach((run, number) => {
          const x = state.axis === "order" ? run.frequency.map((f) => f / run.turns) : run.frequency;
          const seen = levels[number].map((level, line) => [x[line], level, line]).filter(([, level]) => level > floor);
          const strongest = Math.max(...levels[number]);
          const limited = seen.map(([, level, line]) => {
            if (state.point || !run.upper || level < strongest - 20) return [0, 0];
            const weight = level - run.level[0][line];
            const low = run.lower[line] === null ? floor : run.lower[line] + weight;
            return [Math.max(level - Math.max(low, floor), 0), Math.max(run.upper[line] + weight - level, 0)];
          });
          traces.push({
            type: "scatter", mode: "lines", hoverinfo: "skip", showlegend: false, legendgroup: run.name,
            x: seen.flatMap(([at]) => [at, at, null]), y: seen.flatMap(([, level]) => [floor, level, null]),
            line: { color: run.colour, width: number === 0 && data.runs.length > 1 ? 3.5 : 1.6 }, opacity: number === 0 && data.runs.length > 1 ? 0.55 : 1,
          });
          traces.push({
            type: "scatter", mode: "markers", name: name(run, number), legendgroup: run.name,
            x: seen.map(([at]) => at), y: seen.map(([, level]) => level),
            marker: { color: run.colour, size: 6, symbol: run.symbol },
            error_y: { type: "data", symmetric: false, arrayminus: limited.map(([low]) => low), array: limited.map(([, up]) => up), color: run.colour, thickness: 1, width: 3 },
            text: seen.map(([, , line]) => (run.turns ? `order ${+(run.frequency[line] / run.turns).toFixed(4)}, ` : "") +
              `${run.frequency[line].toFixed(1)} Hz` + (run.origin[line] ? `<br>${run.origin[line]}` : "")),
            hovertemplate: `%{text}<br>%{y:.1f} ${unit}<extra>${run.name}</extra>`,
          });
        });
        layout.xaxis = { ...axis, type: state.scale, title: { text: state.axis === "order" ? "order of the input" : "frequency / Hz", font: { size: 13 } } };
        const scale = state.axis === "order" ? 1 : oneSpeed ? data.runs[0].turns : 0;
        const highest = Math.max(...data.runs.map((run) => run.frequency[run.frequency.length - 1]));
        layout.shapes = scale ? data.marks.flatMap(({ order, dash }) => {
          const lines = [];
          for (let k = 1; k * order * data.runs[0].turns <= highest && k < 60; k++)
            lines.push({ type: "line", x0: k * order * scale, x1: k * order * scale, yref: "paper", y0: 0, y1: 1, layer: "below", line: { color: "#b4bac1", width: 1, dash } });
          return lines;
        }) : [];
      }
      Plotly.react(plot, traces, base(layout, height), config);
    };
    draw();
  };

  const kinds = { spectrum, motion: (place, content, height) => movingBodies(place, content, height, choice), player: (place, content) => soundPlayer(place, content, choice), plotly: (plot, { data, layout }, height) =>
      Plotly.newPlot(plot, data, base(layout, height), { ...config, displayModeBar: plot.closest(".evidence") ? false : config.displayModeBar }) };
  /* On a narrow screen panels stand below each other, and their titles break. */
  const narrow = (content, height, width) => {
    const layout = content.layout, { rows, columns } = layout?.grid ?? {};
    if (!rows || width > 560) return height;
    const named = (letter) => Object.keys(layout).filter((name) => name.startsWith(`${letter}axis`));
    const title = (name, text) => { layout[name] = { ...layout[name], title: { ...layout[name].title, text } }; };
    if (columns > 1) {
      const [x, y] = ["x", "y"].map(named), below = layout[x[x.length - 1]].title.text, beside = layout[y[0]].title.text;
      x.forEach((name, number) => title(name, number === x.length - 1 ? below : ""));
      for (const name of y) title(name, beside);
      const scale = x.length / rows;
      layout.grid = { ...layout.grid, rows: x.length, columns: 1 };
      if (layout.legend) layout.legend.y = 1 + (layout.legend.y - 1) / scale;
      height *= scale;
    }
    const most = Math.floor((width - 90) / 6.5);
    for (const of of layout.annotations ?? []) Object.assign(of, { text: broken(of.text, most), align: "left" });
    const more = 17 * ((layout.annotations?.[0]?.text.split("<br>").length ?? 1) - 1);
    if (more && layout.legend && layout.margin) {
      layout.margin = { ...layout.margin, t: layout.margin.t + more };
      layout.legend.y += more / (height - layout.margin.t + more - layout.margin.b);
      height += more;
    }
    return height;
  };
  const broken = (text, most) => {
    const lines = [""];
    const length = (of) => of.replace(/<[^>]*>/g, "").length;
    for (const word of text.split(" ")) {
      const last = lines[lines.length - 1], longer = last ? `${last} ${word}` : word;
      if (last && length(longer) > most) lines.push(word); else lines[lines.length - 1] = longer;
    }
    return lines.join("<br>");
  };
  /* Width (pixels) below which names under bars would overlap, or panels be too narrow: then the figure scrolls. */
  const least = ({ data, layout }) => {
    const panels = 280 * (layout?.grid?.columns ?? 1);
    const named = (Array.isArray(data) ? data : []).map(({ x }) => (typeof x?.[0] === "string" ? x : []));
    return Math.max(panels, ...named.map((x) => 90 + x.length * (8 + 6 * Math.max(0, ...x.flatMap((name) => name.split("<br>")).map((row) => row.length)))));
  };
  const draw = (plot) => {
    const content = JSON.parse(document.querySelector(`script[data-plot="${plot.id}"]`).textContent);
    plot.dataset.height = narrow(content, Number(plot.dataset.height), plot.clientWidth);
    /* A fixed height: without one, Plotly loses the height of a plot when the window changes its width. */
    if (["plotly", "spectrum"].includes(content.kind)) plot.style.height = `${plot.dataset.height}px`;
    if (content.kind === "plotly" && !plot.closest(".evidence")) plot.style.minWidth = `${least(content)}px`;
    kinds[content.kind](plot, content, Number(plot.dataset.height));
    plot.style.minHeight = "";
  };
  const waiting = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      waiting.unobserve(target);
      draw(target);
    }
  }, { rootMargin: "600px" });
  const pending = new Set(document.querySelectorAll(".plot"));
  for (const plot of pending) waiting.observe(plot);
  /* On paper a plot is drawn for a narrow page, then scaled as a picture to the width that there is. */
  const paper = [480, 1040];
  window.addEventListener("beforeprint", () => {
    for (const plot of pending) {
      if (!plot.hasChildNodes()) { waiting.unobserve(plot); draw(plot); }
      if (!plot.querySelector(".main-svg")) continue;
      Plotly.relayout(plot, { autosize: false, width: paper[plot.closest(".evidence") ? 0 : 1] });
      const { width, height } = plot._fullLayout;
      plot.style.setProperty("--shape", `${width} / ${height}`);
      for (const picture of plot.querySelectorAll(".main-svg")) picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
    }
  });
  window.addEventListener("afterprint", () => {
    for (const plot of document.querySelectorAll(".plot:has(.main-svg)")) {
      for (const picture of plot.querySelectorAll(".main-svg")) picture.removeAttribute("viewBox");
      Plotly.relayout(plot, { autosize: true, width: null });
    }
  });
})();
