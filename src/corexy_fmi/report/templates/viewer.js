"use strict";
// Interactive view of the curves in time: drag to zoom, wheel with Ctrl, buttons, arrow keys.
// Data: see viewer.py. Nothing is loaded and no text is ever written as markup.
(() => {
  const root = document.getElementById("viewer");
  const panels = JSON.parse(document.getElementById("viewer-data").textContent);
  if (!root || !panels.length) return;
  const part = (name) => root.querySelector(`[data-part="${name}"]`);
  const canvas = part("canvas"), pen = canvas.getContext("2d"), readout = part("readout");
  const MODELS = ["nominal", "retuned", "explained"];
  const LABELS = { nominal: "as given", retuned: "retuned", explained: "explained" };
  const PREFIXES = [[1e-12, "p"], [1e-9, "n"], [1e-6, "µ"], [1e-3, "m"], [1, ""]];
  const box = { left: 64, right: 12, top: 12, bottom: 40 };
  let panel, view, drag = null, pointer = null;

  // --- data
  const numbers = (text, Kind) =>
    new Kind(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  function unpack(level) {
    const time = Float64Array.from(numbers(level.time, Float32Array), (t) => t + level.start);
    const curves = {};
    for (const [name, curve] of Object.entries(level.curves)) {
      const low = numbers(curve.low, Int16Array);
      curves[name] = { scale: curve.scale, low, high: curve.high ? numbers(curve.high, Int16Array) : low };
    }
    return { time, curves, merged: Object.values(level.curves).some((c) => c.high) };
  }
  function finest() {
    const inside = (level) => level.time[0] <= view[0] && level.time[level.time.length - 1] >= view[1];
    return panel.unpacked.slice(1).find(inside) || panel.unpacked[0];
  }
  const shown = () => MODELS.filter((m) => panel.unpacked[0].curves[m] && part(`show-${m}`)?.checked);
  function below(time, t) {  // last index with time <= t
    let a = 0, b = time.length - 1;
    while (a < b) { const m = (a + b + 1) >> 1; if (time[m] <= t) a = m; else b = m - 1; }
    return a;
  }

  // --- numbers
  function scaled(largest, unit) {
    if (!/^(m|s|rad|N|V|A|Hz)(?![A-Za-z^])/.test(unit)) return [1, unit];
    const fit = PREFIXES.filter(([size]) => size <= largest / 2).pop() || PREFIXES[0];
    return [1 / fit[0], fit[1] + unit];
  }
  const pretty = (unit) => unit.replace(/\^2/g, "²").replace(/\^3/g, "³").replace(/^1$/, "");
  function ticks(low, high, count) {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const found = [];
    for (let v = Math.ceil(low / step) * step; v <= high + step * 1e-9; v += step) {
      found.push([v, (Math.abs(v) < step / 1e6 ? 0 : v).toFixed(digits).replace("-", "−")]);
    }
    return found;
  }

  // --- drawing
  function limits(level, first, last, names) {
    let top = 0;
    for (const name of names) {
      const { low, high, scale } = level.curves[name];
      for (let i = first; i <= last; i++) top = Math.max(top, Math.abs(low[i]) * scale, Math.abs(high[i]) * scale);
    }
    return Math.max(top, panel.band, 1e-15) * 1.08;
  }
  function draw() {
    const style = getComputedStyle(root), ratio = window.devicePixelRatio || 1;
    const ink = (name) => style.getPropertyValue(`--${name}`).trim();
    const width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width * ratio; canvas.height = height * ratio;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const level = finest(), names = shown();
    const first = below(level.time, view[0]), last = Math.min(below(level.time, view[1]) + 1, level.time.length - 1);
    const top = limits(level, first, last, names), [scale, unit] = scaled(top, panel.unit);
    const inner = [width - box.left - box.right, height - box.top - box.bottom];
    const X = (t) => box.left + ((t - view[0]) / (view[1] - view[0])) * inner[0];
    const Y = (v) => box.top + (1 - v / top) / 2 * inner[1];
    grid(X, Y, top, scale, unit, inner, ink);
    pen.save(); pen.beginPath(); pen.rect(box.left, box.top, ...inner); pen.clip();
    pen.fillStyle = ink("span");
    for (const [a, b] of panel.spans) pen.fillRect(X(a), box.top, Math.max(X(b) - X(a), 1), inner[1]);
    pen.fillStyle = ink("band");
    if (panel.band > 0) pen.fillRect(box.left, Y(panel.band), inner[0], Y(-panel.band) - Y(panel.band));
    for (const name of names) line(level, name, first, last, X, Y, ink(name));
    marks(X, ink, inner);
    pen.restore();
    tell(level, names, scale, unit);
  }
  function grid(X, Y, top, scale, unit, inner, ink) {
    pen.font = `12px ${getComputedStyle(root).fontFamily}`;
    pen.strokeStyle = ink("rule"); pen.fillStyle = ink("muted"); pen.lineWidth = 1;
    const rule = (a, b, c, d) => { pen.beginPath(); pen.moveTo(a, b); pen.lineTo(c, d); pen.stroke(); };
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (const [v, text] of ticks(-top * scale, top * scale, Math.max(inner[1] / 48, 3))) {
      rule(box.left, Y(v / scale), box.left + inner[0], Y(v / scale)); pen.fillText(text, box.left - 8, Y(v / scale));
    }
    pen.textAlign = "center"; pen.textBaseline = "top";
    for (const [t, text] of ticks(view[0], view[1], Math.max(inner[0] / 90, 2))) {
      rule(X(t), box.top, X(t), box.top + inner[1]); pen.fillText(text, X(t), box.top + inner[1] + 6);
    }
    pen.fillText("time [s]", box.left + inner[0] / 2, box.top + inner[1] + 23);
    pen.save(); pen.translate(12, box.top + inner[1] / 2); pen.rotate(-Math.PI / 2);
    pen.fillText(`${panel.kind} [${pretty(unit)}]`, 0, -6); pen.restore();
  }
  function line(level, name, first, last, X, Y, colour) {
    const { low, high, scale } = level.curves[name], time = level.time;
    const gap = 8 * (time[time.length - 1] - time[0]) / time.length;
    pen.strokeStyle = colour; pen.lineWidth = level.merged ? 1 : 1.4; pen.lineJoin = "round"; pen.beginPath();
    for (let i = first; i <= last; i++) {
      const x = X(time[i]), jump = i === first || time[i] - time[i - 1] > gap;
      if (jump) pen.moveTo(x, Y(high[i] * scale)); else pen.lineTo(x, Y(high[i] * scale));
      if (level.merged) pen.lineTo(x, Y(low[i] * scale));
    }
    pen.stroke();
  }
  function marks(X, ink, inner) {
    if (drag) {
      pen.fillStyle = ink("rule"); pen.globalAlpha = 0.5;
      pen.fillRect(X(drag.from), box.top, X(drag.to) - X(drag.from), inner[1]); pen.globalAlpha = 1;
    } else if (pointer !== null) {
      pen.strokeStyle = ink("muted"); pen.beginPath();
      pen.moveTo(X(pointer), box.top); pen.lineTo(X(pointer), box.top + inner[1]); pen.stroke();
    }
  }
  function tell(level, names, scale, unit) {
    const detail = level.merged ? "each point spans the least and greatest of many samples" : "every sample";
    if (pointer === null) { readout.textContent = `${view[0].toFixed(3)} s to ${view[1].toFixed(3)} s, ${detail}`; return; }
    const i = below(level.time, pointer);
    const value = (n) => [...new Set([level.curves[n].low[i], level.curves[n].high[i]])]
      .map((v) => (v * level.curves[n].scale * scale).toPrecision(3).replace("-", "−")).join(" to ");
    readout.textContent = `${level.time[i].toFixed(3)} s: ` +
      names.map((n) => `${LABELS[n]} ${value(n)} ${pretty(unit)}`).join(", ");
  }

  // --- moving about
  const ends = () => { const t = panel.unpacked[0].time; return [t[0], Math.max(t[t.length - 1], t[0] + 1e-6)]; };
  function look(from, to) {
    const [start, end] = ends(), span = Math.min(Math.max(to - from, 1e-3), end - start);
    from = Math.min(Math.max(from, start), end - span);
    view = [from, from + span]; draw();
  }
  const zoom = (factor, at = (view[0] + view[1]) / 2) => look(at - (at - view[0]) * factor, at + (view[1] - at) * factor);
  const pan = (share) => { const by = share * (view[1] - view[0]); look(view[0] + by, view[1] + by); };
  const moves = {
    "zoom-in": () => zoom(0.5), "zoom-out": () => zoom(2), left: () => pan(-0.4), right: () => pan(0.4), reset: () => look(...ends()),
    worst: () => { const t = panel.unpacked[panel.unpacked.length - 1].time, s = panel.spans[0];
      if (s) look(s[0] - (s[1] - s[0]), s[1] + (s[1] - s[0])); else look(t[0], t[t.length - 1]); },
  };
  const keys = { "+": "zoom-in", "=": "zoom-in", "-": "zoom-out", ArrowLeft: "left", ArrowRight: "right", 0: "reset", Escape: "reset" };
  const timeAt = (event) => {
    const share = (event.offsetX - box.left) / (canvas.clientWidth - box.left - box.right);
    return view[0] + Math.min(Math.max(share, 0), 1) * (view[1] - view[0]);
  };
  for (const name of Object.keys(moves)) part(name).addEventListener("click", moves[name]);
  for (const model of MODELS) part(`show-${model}`)?.addEventListener("change", draw);
  canvas.addEventListener("keydown", (event) => {
    if (keys[event.key] && !event.ctrlKey && !event.metaKey) { moves[keys[event.key]](); event.preventDefault(); }
  });
  canvas.addEventListener("wheel", (event) => {
    if (event.ctrlKey || event.metaKey) { zoom(event.deltaY > 0 ? 1.25 : 0.8, timeAt(event)); event.preventDefault(); }
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId); drag = { from: timeAt(event), to: timeAt(event) };
  });
  canvas.addEventListener("pointermove", (event) => { pointer = timeAt(event); if (drag) drag.to = pointer; draw(); });
  canvas.addEventListener("pointerleave", () => { pointer = null; draw(); });
  canvas.addEventListener("pointercancel", () => { drag = null; draw(); });
  canvas.addEventListener("pointerup", () => {
    if (!drag) return;
    const [a, b] = [Math.min(drag.from, drag.to), Math.max(drag.from, drag.to)];
    drag = null;
    if (b - a > 0.01 * (view[1] - view[0])) look(a, b); else draw();
  });
  canvas.addEventListener("dblclick", moves.reset);

  // --- choosing
  const recordings = [...new Set(panels.map((p) => p.recording))];
  function fill(select, texts) { select.replaceChildren(...texts.map((text, i) => new Option(text, i))); }
  function choose() {
    panel = panels.filter((p) => p.recording === recordings[part("recording").value])[part("channel").value];
    panel.unpacked = panel.unpacked || panel.levels.map(unpack);
    panel.kind = panel.title.startsWith("missing") ? "force" : "mismatch";
    for (const m of MODELS) if (part(`show-${m}`)) part(`show-${m}`).disabled = !panel.unpacked[0].curves[m];
    look(...ends());
  }
  function chooseRecording() {
    fill(part("channel"), panels.filter((p) => p.recording === recordings[part("recording").value]).map((p) => p.title));
    choose();
  }
  root.hidden = false;
  fill(part("recording"), recordings);
  part("recording").addEventListener("change", chooseRecording);
  part("channel").addEventListener("change", choose);
  new ResizeObserver(() => panel && draw()).observe(canvas);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  chooseRecording();
})();
