// Bodies in CIELAB that turn: L* up, a* and b* on the floor, one unit as long on all three axes.
//
// Plotly, which takes seconds to start on a slow machine, is started with the first scene.
// A scene is drawn over its still when the reader comes to it, and taken away when too many are live: browsers keep
// few WebGL contexts. What the reader has done to it (view, zoom, hidden bodies, colours) is kept in its state, from
// which it is drawn again.
"use strict";

(() => {
  const MAX_LIVE = 3;
  const SETTLE_MS = 250; // a reader who scrolls past does not start a scene
  const ELEVATION_DEG = 22; // of both standard views, as in the stills
  const FIT = 2.7; // scale at which the axes with their numbers fit into the frame
  const ZOOM_STEP = 1.25;
  const TURN_DEG = 10;
  const PICTURE_PX = { width: 1200, height: 800 };
  const CONFIG = { displayModeBar: false, scrollZoom: false, responsive: true };
  const NO_LIGHT = { ambient: 1, diffuse: 0, specular: 0, fresnel: 0 }; // it is painted on the bodies
  const NO_WEBGL = "This browser offers no WebGL, so the bodies cannot be turned; the picture shows the front view.";

  const { azimuths, scenes, shapeOf, paintOf, rangesOf } = paxelBodies;
  const states = new Map(); // figure -> what the reader has done to it
  const live = new Set(); // figures that are drawn, the one used last at the end

  const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;"); // plotly reads tags in texts

  function traces(state) {
    return state.bodies.map((body, depth) => ({
      type: "mesh3d",
      name: plain(body.label),
      ...shapeOf(body.mesh, depth),
      vertexcolor: paintOf(body.mesh, state.displayed ? null : body.color),
      color: body.color ?? "#808080", // of the legend in a saved picture
      opacity: body.opacity,
      visible: !state.hidden.has(depth),
      showlegend: Boolean(body.label),
      lighting: NO_LIGHT,
      hovertemplate: "%{text}<extra>%{fullData.name}</extra>",
    }));
  }

  // Of all bodies, hidden ones too: nothing jumps when one is hidden.
  function axesOf(bodies) {
    const [a, b, L] = rangesOf(bodies).map(([low, high]) => [low - 5, high + 5]);
    return { a, b, L: [Math.max(0, L[0]), L[1]] };
  }

  // Multiples of the step, but at the ends of the axis, where numbers of two axes would meet; finer on a small body.
  function ticks([low, high], step) {
    while (high - low < 2 * step) step /= 2;
    const first = Math.ceil((low + step / 5) / step);
    const last = Math.floor((high - step / 5) / step);
    return Array.from({ length: Math.max(0, last - first + 1) }, (_, k) => (first + k) * step);
  }

  function layout(state) {
    const spans = ["a", "b", "L"].map((axis) => state.ranges[axis][1] - state.ranges[axis][0]);
    const unit = (FIT * state.zoom) / Math.hypot(...spans);
    const axis = (name, step) => ({
      title: { text: name },
      range: state.ranges[name[0]],
      tickvals: ticks(state.ranges[name[0]], step),
      gridcolor: "#c8c8cc", zerolinecolor: "#8a8a90", showbackground: false, showspikes: false,
    });
    return {
      autosize: true,
      margin: { l: 0, r: 0, t: 0, b: 0 },
      paper_bgcolor: "#fff",
      font: { family: "system-ui, sans-serif", size: 12, color: "#303034" },
      showlegend: false,
      legend: { x: 0, y: 1, bgcolor: "rgba(255,255,255,0.7)" },
      scene: {
        xaxis: axis("a*", 40), yaxis: axis("b*", 40), zaxis: axis("L*", 20),
        aspectmode: "manual",
        aspectratio: { x: spans[0] * unit, y: spans[1] * unit, z: spans[2] * unit },
        dragmode: "turntable",
        camera: {
          eye: state.eye, up: { x: 0, y: 0, z: 1 }, center: { x: 0, y: 0, z: 0 },
          projection: { type: "orthographic" },
        },
      },
    };
  }

  const rad = (deg) => (deg * Math.PI) / 180;
  const eyeFrom = (azimuth, elevation) => ({
    x: 2 * Math.cos(elevation) * Math.cos(azimuth),
    y: 2 * Math.cos(elevation) * Math.sin(azimuth),
    z: 2 * Math.sin(elevation),
  });
  const standardEye = (k) => eyeFrom(rad(azimuths[k]), rad(ELEVATION_DEG));

  function turn(state, across_deg, up_deg) {
    const { x, y, z } = state.eye;
    const elevation = Math.atan2(z, Math.hypot(x, y)) + rad(up_deg);
    const limit = rad(85);
    state.eye = eyeFrom(Math.atan2(y, x) + rad(across_deg), Math.max(-limit, Math.min(limit, elevation)));
  }

  const place = (figure) => figure.querySelector(".live");

  function show(figure) {
    const isLive = live.has(figure);
    place(figure).hidden = !isLive;
    const state = states.get(figure);
    const overlaid = state.bodies.some((body) => body.color);
    for (const button of figure.querySelectorAll("[data-do]")) {
      button.hidden = (button.dataset.do === "start") === isLive || (button.dataset.do === "colors" && !overlaid);
      if (button.dataset.do === "colors") button.setAttribute("aria-pressed", String(state.displayed));
    }
    for (const button of figure.querySelectorAll("[data-body]")) {
      button.setAttribute("aria-pressed", String(!state.hidden.has(Number(button.dataset.body))));
    }
  }

  function say(figure, words) {
    const line = figure.querySelector("[role=status]");
    line.textContent = words;
    line.hidden = !words;
  }

  function stop(figure) {
    live.delete(figure);
    const canvases = [...place(figure).querySelectorAll("canvas")];
    if (window.Plotly) Plotly.purge(place(figure));
    for (const canvas of canvases) canvas.getContext("webgl")?.getExtension("WEBGL_lose_context")?.loseContext();
    place(figure).replaceChildren();
    show(figure);
  }

  function startPlotly() {
    if (window.Plotly) return;
    const script = document.createElement("script");
    script.textContent = document.getElementById("plotly").textContent;
    document.head.append(script);
  }

  // Draws the scene as its state says, and makes it live if it was not.
  async function draw(figure) {
    const state = states.get(figure);
    const started = live.has(figure);
    live.delete(figure);
    while (live.size >= MAX_LIVE) stop([...live].find((other) => !states.get(other).inView) ?? [...live][0]);
    live.add(figure);
    show(figure);
    try {
      startPlotly();
      state.ranges ??= axesOf(state.bodies);
      await Plotly.react(place(figure), traces(state), layout(state), CONFIG);
    } catch (error) {
      stop(figure);
      say(figure, `The bodies cannot be drawn here (${error.message}); the picture shows the front view.`);
      return;
    }
    say(figure, "");
    if (started) return;
    place(figure).on("plotly_relayout", () => {
      state.eye = { ...place(figure).layout.scene.camera.eye };
    });
    for (const canvas of place(figure).querySelectorAll("canvas")) {
      canvas.addEventListener("webglcontextlost", () => live.has(figure) && stop(figure));
    }
  }

  async function save(figure) {
    const state = states.get(figure);
    const picture = { data: traces(state), layout: { ...layout(state), showlegend: true }, config: CONFIG };
    const link = document.createElement("a");
    link.href = await Plotly.toImage(picture, { format: "png", ...PICTURE_PX });
    link.download = `${figure.id}.png`;
    link.click();
  }

  const ACTIONS = {
    start: (state) => state,
    "view-0": (state) => Object.assign(state, { eye: standardEye(0), zoom: 1 }),
    "view-1": (state) => Object.assign(state, { eye: standardEye(1), zoom: 1 }),
    closer: (state) => Object.assign(state, { zoom: state.zoom * ZOOM_STEP }),
    further: (state) => Object.assign(state, { zoom: state.zoom / ZOOM_STEP }),
    colors: (state) => Object.assign(state, { displayed: !state.displayed }),
  };

  const KEYS = {
    ArrowLeft: (state) => turn(state, -TURN_DEG, 0),
    ArrowRight: (state) => turn(state, TURN_DEG, 0),
    ArrowUp: (state) => turn(state, 0, TURN_DEG),
    ArrowDown: (state) => turn(state, 0, -TURN_DEG),
    "+": ACTIONS.closer,
    "-": ACTIONS.further,
  };

  function prepare(figure) {
    const state = {
      bodies: scenes[figure.id],
      eye: standardEye(0),
      zoom: 1,
      hidden: new Set(),
      displayed: false,
      inView: false,
    };
    states.set(figure, state);
    figure.querySelector(".tools").hidden = false;
    for (const button of figure.querySelectorAll("[data-do]")) {
      button.addEventListener("click", () => {
        const action = button.dataset.do;
        if (action === "stop") return stop(figure);
        if (action === "save") return save(figure);
        ACTIONS[action](state);
        return draw(figure);
      });
    }
    for (const button of figure.querySelectorAll("[data-body]")) {
      button.disabled = false;
      button.addEventListener("click", () => {
        const body = Number(button.dataset.body);
        if (!state.hidden.delete(body)) state.hidden.add(body);
        draw(figure);
      });
    }
    place(figure).addEventListener("keydown", (event) => {
      if (!(event.key in KEYS) || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      KEYS[event.key](state);
      draw(figure);
    });
    show(figure);
  }

  function hasWebGL() {
    const context = document.createElement("canvas").getContext("webgl");
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return Boolean(context);
  }

  const figures = document.querySelectorAll("figure.scene");
  if (!hasWebGL()) {
    for (const figure of figures) say(figure, NO_WEBGL);
    return;
  }
  figures.forEach(prepare);

  // A finger that scrolls would turn the bodies instead: there a scene starts when it is asked for.
  const finger = matchMedia("(pointer: coarse)");
  const watch = new IntersectionObserver(
    (seen) => {
      for (const { target, isIntersecting } of seen) {
        const figure = target.closest("figure");
        const state = states.get(figure);
        state.inView = isIntersecting;
        if (!isIntersecting || finger.matches) continue;
        setTimeout(() => state.inView && !live.has(figure) && draw(figure), SETTLE_MS);
      }
    },
    { threshold: 0.3 },
  );
  for (const figure of figures) watch.observe(figure.querySelector(".stage"));
})();
