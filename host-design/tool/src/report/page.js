"use strict";
// What is folded is opened where a link leads, and on paper.
(() => {
  const openAround = () => {
    const target = location.hash.length > 1 ? document.getElementById(location.hash.slice(1)) : null;
    const folded = target?.closest("details");
    if (!folded || folded.open) return;
    folded.open = true;
    target.scrollIntoView();
  };
  addEventListener("hashchange", openAround);
  openAround();
  addEventListener("beforeprint", () => { for (const folded of document.querySelectorAll("details")) folded.open = true; });
})();
// Plays the runs: one time for the animation and for the cursors of all plots.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  if (data.scenes.length === 0) return;
  const svg = (name, attributes, parent) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (parent) parent.append(element);
    return element;
  };
  const [playback, stages, play, speed, scrub, output, choice] =
    ["playback", "stages", "play", "speed", "scrub", "time", "scene"].map((id) => document.getElementById(id));

  // A line in every panel of every plot over time.
  const plots = [...document.querySelectorAll("figure[data-areas]")].map((figure) => {
    const drawing = figure.querySelector("svg");
    const [from, to] = figure.dataset.times.split(" ").map(Number);
    const panels = figure.dataset.areas.split(";").map((area) => {
      const [left, right, top, bottom] = area.split(" ").map(Number);
      return { left, right, line: svg("line", { class: "cursor", y1: top, y2: bottom }, drawing) };
    });
    return { drawing, from, to, panels };
  });
  const moveCursors = () => {
    for (const { from, to, panels } of plots) {
      for (const { left, right, line } of panels) {
        const x = left + (right - left) * (time - from) / (to - from);
        line.setAttribute("x1", x);
        line.setAttribute("x2", x);
        line.style.visibility = time < from || time > to ? "hidden" : "visible";
      }
    }
  };

  // The machine, to scale: metres, y upwards.
  const total = data.lengths.reduce((sum, length) => sum + length, 0);
  const cart = { width: 0.36 * total, height: 0.13 * total };
  const colours = data.colours;
  const line = (parent, stroke, width) =>
    svg("line", { stroke, "stroke-width": width * total, "stroke-linecap": "round" }, parent);
  const place = (element, x1, y1, x2, y2) => {
    for (const [key, value] of Object.entries({ x1, y1: -y1, x2, y2: -y2 })) element.setAttribute(key, value);
  };
  // How far the lowest joint or end of a link is below the rail.
  const hangsBelow = (angles) => {
    let y = cart.height + 0.03 * total;
    return -Math.min(...data.lengths.map((length, link) => (y += length * Math.cos(angles[link]))));
  };
  let drawn = [];
  const setStage = () => {
    if (!stages) return;
    const runs = scene.runs;
    const all = runs.flatMap((run) => [...run.x, ...run.target]);
    const [low, high] = [Math.min(...all), Math.max(...all)];
    const needed = high - low + 1.6 * total;
    const width = Math.max(2.6 * total, Math.min(needed, 3.2 * total));
    const follows = needed > width;
    stages.replaceChildren();
    // Labels stay legible on a telephone.
    const room = (stages.clientWidth - 20 * (runs.length - 1)) / runs.length;
    const letter = Math.max(0.09 * total, 10 * Math.max(width / room, 1.6 * total / (0.24 * window.innerHeight)));
    // High enough for the raised links, the labels below the rail, and links that hang below it.
    const depth = Math.max(...runs.flatMap((run) => run.angles.map(hangsBelow)));
    const below = Math.max(0.1 * total + 1.3 * letter, depth + 0.05 * total);
    const view = { width, height: 1.3 * total + below, top: 1.3 * total };
    const steps = [1, 2, 5, 10, 20, 50].map((s) => s * 10 ** (Math.floor(Math.log10(total)) - 1));
    const step = steps.find((s) => s > 4.2 * letter) ?? steps.at(-1);
    drawn = runs.map((run) => {
      const figure = document.createElement("figure");
      const caption = document.createElement("figcaption");
      const canvas = svg("svg", { class: "stage", role: "img", "aria-label": `The machine under ${run.law}` });
      figure.append(caption, canvas);
      stages.append(figure);
      const ground = svg("g", {}, canvas);
      place(line(ground, "#000000", 0.012), data.rail[0], 0, data.rail[1], 0);
      for (const end of data.rail) place(line(ground, "#000000", 0.03), end, 0, end, 0.12 * total);
      for (let i = Math.ceil(data.rail[0] / step); i * step <= data.rail[1]; i += 1) {
        place(line(ground, "#000000", 0.008), i * step, 0, i * step, -0.04 * total);
        const label = svg("text", { x: i * step, y: 0.08 * total + letter, "text-anchor": "middle", fill: "#000000",
          "font-size": letter, "font-family": "sans-serif" }, ground);
        label.textContent = `${Number((i * step).toPrecision(6))} m`.replace("-", "−");
      }
      const target = svg("path", { d: `M0 0 l${0.045 * total} ${0.08 * total} h${-0.09 * total} z`, fill: colours[1] }, ground);
      const body = svg("g", {}, canvas);
      svg("rect", { x: -0.5 * cart.width, y: -cart.height - 0.03 * total, width: cart.width, height: cart.height, rx: 0.02 * total,
        fill: data.cart_colour, stroke: "#000000", "stroke-width": 0.008 * total }, body);
      for (const side of [-0.3, 0.3]) svg("circle", { cx: side * cart.width, cy: -0.03 * total, r: 0.03 * total, fill: "#000000" }, body);
      const links = data.lengths.map((_, index) => line(canvas, colours[index % colours.length], 0.035));
      const joints = data.lengths.map(() => svg("circle", { r: 0.022 * total, fill: "#000000" }, canvas));
      return { run, caption, canvas, view, follows, middle: 0.5 * (low + high), target, body, links, joints };
    });
  };
  const between = (values, at) => {
    const index = Math.min(Math.floor(at), values.length - 1);
    const next = Math.min(index + 1, values.length - 1);
    return values[index] + (values[next] - values[index]) * Math.min(at - index, 1);
  };
  const drawMachine = () => {
    for (const { run, caption, canvas, view, follows, middle, target, body, links, joints } of drawn) {
      const at = time / run.every;
      const frame = Math.min(Math.floor(at), run.angles.length - 1);
      const next = Math.min(frame + 1, run.angles.length - 1);
      const part = Math.min(at - frame, 1);
      let x = between(run.x, at);
      const centre = follows ? x : middle;
      canvas.setAttribute("viewBox", `${centre - 0.5 * view.width} ${-view.top} ${view.width} ${view.height}`);
      target.setAttribute("transform", `translate(${run.target[frame]} 0)`);
      body.setAttribute("transform", `translate(${x} 0)`);
      let y = cart.height + 0.03 * total;
      data.lengths.forEach((length, link) => {
        const angle = run.angles[frame][link] + (run.angles[next][link] - run.angles[frame][link]) * part;
        joints[link].setAttribute("cx", x);
        joints[link].setAttribute("cy", -y);
        // Counter-clockwise positive: to the left.
        const tip = [x - length * Math.sin(angle), y + length * Math.cos(angle)];
        place(links[link], x, y, ...tip);
        [x, y] = tip;
      });
      const lost = run.fall && at >= run.x.length - 1;
      caption.textContent = run.law + (lost ? `: ${run.fall}` : "");
    }
  };

  let scene = data.scenes[0];
  let time = 0;
  let playing = false;
  let last = 0;
  const show = () => {
    output.textContent = `${time.toFixed(2)} s`;
    scrub.value = String(Math.round(1000 * time / scene.end));
    drawMachine();
    moveCursors();
  };
  const seek = (to) => {
    time = Math.max(0, Math.min(to, scene.end));
    show();
  };
  const setPlaying = (value) => {
    playing = value;
    play.textContent = playing ? "Pause" : "Play";
    if (playing) {
      last = performance.now();
      requestAnimationFrame(tick);
    }
  };
  const tick = (now) => {
    if (!playing) return;
    seek(time + Math.max(0, now - last) / 1000 * Number(speed.value));
    last = now;
    if (time >= scene.end) setPlaying(false);
    else requestAnimationFrame(tick);
  };
  play.addEventListener("click", () => {
    if (!playing && time >= scene.end) seek(0);
    setPlaying(!playing);
  });
  scrub.addEventListener("input", () => {
    setPlaying(false);
    seek(Number(scrub.value) / 1000 * scene.end);
  });
  choice.addEventListener("change", () => {
    scene = data.scenes[Number(choice.value)];
    document.querySelectorAll(".scene > details")[Number(choice.value)]?.setAttribute("open", "");
    setStage();
    seek(0);
  });
  // A plot sets the time, too.
  for (const { drawing, from, to, panels } of plots) {
    const point = (event) => {
      const box = drawing.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width * drawing.viewBox.baseVal.width;
      setPlaying(false);
      seek(from + (x - panels[0].left) / (panels[0].right - panels[0].left) * (to - from));
    };
    drawing.addEventListener("pointerdown", point);
    drawing.addEventListener("pointermove", (event) => { if (event.buttons === 1) point(event); });
  }
  playback.hidden = false;
  setStage();
  show();
})();
