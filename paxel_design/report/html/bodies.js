// Bodies of the report's scenes: packed meshes -> vertices, triangles and colours in the light, as plotly takes them.
//
// Plotly's own light fails in parallel projection, so it is painted on the vertices: full on faces towards the light,
// 0.4 of it on those away. Knows no page and no plot.
"use strict";

const paxelBodies = (() => {
  const LIGHT_FROM = [0.1, -0.45, 0.89]; // as (a*, b*, L*)
  const CREASE = Math.cos((40 * Math.PI) / 180); // faces that meet at a sharper edge are shaded apart
  const SHRINK = 0.02; // by which each next body is drawn smaller, or faces that two share would flicker

  const data = JSON.parse(document.getElementById("scene-data").textContent);
  const cache = new Map();
  const once = (key, make) => {
    if (!cache.has(key)) cache.set(key, make());
    return cache.get(key); // plotly compares arrays by identity: a turn does not build a body anew
  };

  const bytes = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
  const thirds = (array) => [0, 1, 2].map((k) => array.subarray((k * array.length) / 3, ((k + 1) * array.length) / 3));
  const dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const unit = (v) => {
    const length = Math.hypot(...v) || 1;
    return v.map((part) => part / length);
  };

  // axes: a*, b*, L* of the vertices; corners: first, second, third vertex of the faces; rgb: as displayed.
  const meshOf = (id) =>
    once(id, () => {
      const { Lab, rgb, faces, wide } = data.meshes[id];
      const [L, a, b] = thirds(new Float32Array(bytes(Lab)));
      const corners = thirds(wide ? new Uint32Array(bytes(faces)) : new Uint16Array(bytes(faces)));
      const mesh = { axes: [a, b, L], corners, rgb: new Uint8Array(bytes(rgb)) };
      return { ...mesh, ...creased(mesh) };
    });

  // The mesh with a vertex of its own on each side of every crease.
  // origin: the vertex that a new one was; split: corners by new vertices; shades: light on them.
  function creased({ axes, corners }) {
    const count = axes[0].length;
    const sides = Array.from({ length: count }, () => []);
    const split = corners.map((corner) => new Uint32Array(corner.length));
    const all = [];
    for (let face = 0; face < corners[0].length; face++) {
      const [p, q, r] = corners.map((corner) => corner[face]);
      const u = axes.map((axis) => axis[q] - axis[p]);
      const v = axes.map((axis) => axis[r] - axis[p]);
      const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const facing = unit(normal);
      [p, q, r].forEach((vertex, k) => {
        let side = sides[vertex].find((other) => dot(other.facing, facing) > CREASE);
        if (!side) {
          side = { facing, normal: [0, 0, 0], vertex, index: all.length };
          sides[vertex].push(side);
          all.push(side);
        }
        for (let m = 0; m < 3; m++) side.normal[m] += normal[m];
        split[k][face] = side.index;
      });
    }
    return {
      origin: all.map((side) => side.vertex),
      split,
      shades: all.map((side) => 0.7 + 0.3 * dot(unit(side.normal), LIGHT_FROM)),
    };
  }

  // Places (a*, b*, L*) and faces of body number `depth` from the outside, and what each place truly is.
  const shapeOf = (id, depth) =>
    once(`${id} ${depth}`, () => {
      const { axes, origin, split } = meshOf(id);
      const [x, y, z] = axes.map((axis) => {
        const middle = axis.reduce((sum, value) => sum + value, 0) / axis.length;
        return Float32Array.from(origin, (vertex) => axis[vertex] + SHRINK * depth * (middle - axis[vertex]));
      });
      const [a, b, L] = axes;
      const text = origin.map((v) => `L* ${L[v].toFixed(0)}<br>a* ${a[v].toFixed(0)}<br>b* ${b[v].toFixed(0)}`);
      return { x, y, z, i: split[0], j: split[1], k: split[2], text };
    });

  // Colours of the same vertices in the light: of one colour, "#rrggbb", or as displayed.
  const paintOf = (id, color) =>
    once(`${id} ${color}`, () => {
      const { origin, rgb, shades } = meshOf(id);
      const own = color && [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16));
      return shades.map((shade, n) => {
        const codes = own || rgb.subarray(3 * origin[n], 3 * origin[n] + 3);
        return `rgb(${Math.round(shade * codes[0])},${Math.round(shade * codes[1])},${Math.round(shade * codes[2])})`;
      });
    });

  // Lowest and highest a*, b*, L* of bodies.
  const rangesOf = (bodies) =>
    [0, 1, 2].map((m) => {
      let low = Infinity;
      let high = -Infinity;
      for (const body of bodies) {
        for (const value of meshOf(body.mesh).axes[m]) {
          low = Math.min(low, value);
          high = Math.max(high, value);
        }
      }
      return [low, high];
    });

  return { azimuths: data.azimuths, scenes: data.scenes, shapeOf, paintOf, rangesOf };
})();
