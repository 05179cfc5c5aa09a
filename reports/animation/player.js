"use strict";
// Players of motions: each element .motion has its data as JSON. One WebGL context draws all panels, one after the other, because
// browsers allow only a few contexts in a page. The result is copied into the canvas of each panel.
(async () => {
  const packed = Uint8Array.from(atob(document.getElementById("three").textContent), (c) => c.charCodeAt(0));
  const library = document.createElement("script");
  library.textContent = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  document.head.append(library); // this runs it: `THREE`
  const { Group, Mesh, MeshLambertMaterial, Quaternion, Vector3 } = THREE, UP = new Vector3(0, 1, 0);
  const FINE = 6; // points of the trace from one frame to the next
  const canvas = document.createElement("canvas"), context = canvas.getContext("webgl2", { alpha: true, preserveDrawingBuffer: true });
  const renderer = context && new THREE.WebGLRenderer({ canvas, context });
  const camera = new THREE.PerspectiveCamera(30, 1, 1, 20), view = { turn: 0.6, tilt: 0.35 };
  camera.up.set(0, 0, 1);

  const split = (flat, n, Kind) => Array.from({ length: flat.length / n }, (_, k) => new Kind(...flat.slice(n * k, n * (k + 1))));
  const between = (states, frame) => { // the two states around a frame, and the share of the second
    const last = states.length - 1, k = Math.min(Math.floor(frame), last);
    return [states[k], states[Math.min(k + 1, last)], Math.min(frame, last) - k];
  };
  const turned = (turns, frame) => new Quaternion().slerpQuaternions(...between(turns, frame));
  const mesh = (geometry, color) => new Mesh(geometry, new MeshLambertMaterial({ color }));
  const stage = (...things) => {
    const sun = new THREE.DirectionalLight(0xffffff, 1.8), sky = new THREE.HemisphereLight(0xffffff, 0xb8c0c8, 2.1);
    sun.position.set(3, 2, 5);
    return new THREE.Scene().add(sky, sun, ...things);
  };
  const wire = (box, color, depthTest) => new THREE.LineSegments(new THREE.EdgesGeometry(box, 30), new THREE.LineBasicMaterial({ color, depthTest }));

  function pointer(color, radius, tip) { // a rod from the fixed point with something at its end
    const rod = mesh(new THREE.CylinderGeometry(radius, radius, 1), color), end = mesh(tip, color), group = new Group().add(rod, end);
    const aim = (vector) => {
      group.quaternion.setFromUnitVectors(UP, vector.clone().normalize());
      rod.scale.y = end.position.y = 2 * (rod.position.y = vector.length() / 2);
      group.visible = end.position.y > 0.05;
    };
    return { group, aim };
  }

  // The parts of the surface of a body and the numbers of their colours: a box, or a cone on its tip in four coloured parts.
  function surface({ shape, size, tip }) {
    if (shape !== "cone") return [[new THREE.BoxGeometry(...size), [0, 1, 2, 3, 4, 5]]];
    const [radius, height] = size, axis = new Vector3(...tip).normalize(), quarter = Math.PI / 2;
    const stand = new Quaternion().setFromUnitVectors(UP, axis.clone().negate()), middle = axis.multiplyScalar(height / 2);
    return [0, 1, 2, 3].map((k) => {
      const part = new THREE.ConeGeometry(radius, height, 12, 1, false, k * quarter, quarter);
      return [part.applyQuaternion(stand).translate(middle.x, middle.y, middle.z), [k, k, 4 + (k % 2)]]; // side, none, base
    });
  }

  function build({ shape, size, tip, q, L, colours }) {
    const turns = split(q, 4, Quaternion), momenta = split(L, 3, Vector3), end = new Vector3(...tip), parts = surface({ shape, size, tip });
    const rod = pointer(colours.trace, 0.025, new THREE.SphereGeometry(0.06)), arrow = pointer(colours.arrow, 0.035, new THREE.ConeGeometry(0.11, 0.26));
    rod.aim(end);
    const faces = parts.map(([part, kinds]) => new Mesh(part, kinds.map((k) => new MeshLambertMaterial({ color: colours.faces[k] }))));
    const [edges, outline] = [[colours.ink, true], [colours.outline, false]].map((style) => new Group().add(...parts.map(([part]) => wire(part, ...style))));
    const body = new Group().add(...faces, edges, rod.group);
    const points = Array.from({ length: (turns.length - 1) * FINE + 1 }, (_, k) => end.clone().applyQuaternion(turned(turns, k / FINE)).toArray());
    const line = new THREE.LineGeometry().setPositions(points.flat());
    const trace = new THREE.Line2(line, new THREE.LineMaterial({ color: colours.trace, linewidth: 2 })); // pixels
    const scene = stage(body, arrow.group, trace, outline);
    return (frame, truth) => {
      body.quaternion.copy(turned(turns, frame));
      arrow.aim(new Vector3().lerpVectors(...between(momenta, frame)).clampLength(0, 1.25).multiplyScalar(1.45)); // a longer one would leave the panel
      line.instanceCount = Math.max(1, Math.round(Math.min(frame, turns.length - 1) * FINE));
      outline.visible = Boolean(truth);
      if (truth) outline.quaternion.copy(turned(truth, frame));
      return scene;
    };
  }

  // The momentum in axes of the body lies on two surfaces: the sphere of its length, and the ellipsoid of the energy. Where one
  // surface goes through the other is the polhode, so that both are opaque.
  function polhode({ moments, L, colours }) {
    const points = split(L, 3, Vector3), twice = (at) => moments.reduce((sum, J, i) => sum + at.getComponent(i) ** 2 / J, 0); // the energy
    const axes = (at) => moments.map((each) => Math.sqrt(each * twice(at)));
    const scale = 1.4 / Math.max(...axes(points[0])), ball = new THREE.SphereGeometry(scale, 64, 48);
    const [sphere, ellipsoid] = [colours.sphere, colours.ellipsoid].map((colour) => mesh(ball, colour));
    const dot = mesh(new THREE.SphereGeometry(0.08), colours.arrow);
    const rods = moments.map((_, i) => {
      const rod = mesh(new THREE.CylinderGeometry(0.02, 0.02, 3.5), colours.faces[2 * i]);
      rod.quaternion.setFromUnitVectors(UP, new Vector3().setComponent(i, 1));
      return rod;
    });
    const line = new THREE.LineGeometry().setPositions(points.flatMap((each) => each.clone().multiplyScalar(1.01 * scale).toArray()));
    const traces = [[true, 1], [false, 0.25]].map(([depthTest, opacity]) => { // that on the far side is faint
      const material = new THREE.LineMaterial({ color: colours.trace, linewidth: 2, transparent: true, depthTest, opacity });
      return new THREE.Line2(line, material);
    });
    const scene = stage(sphere, ellipsoid, dot, ...traces, ...rods);
    return (frame) => {
      const at = new Vector3().lerpVectors(...between(points, frame));
      sphere.scale.setScalar(at.length());
      ellipsoid.scale.set(...axes(at));
      dot.position.copy(at).multiplyScalar(scale);
      line.instanceCount = Math.max(1, Math.round(Math.min(frame, points.length - 1)));
      return scene;
    };
  }

  for (const motion of document.querySelectorAll(".motion")) {
    let duration, frames, truth, panels, poses = null, exact; // of the data of the page, or of a script that sets `content`
    const [play, slider, clock, speed] = ["play", "time", "clock", "speed"].map((name) => motion.querySelector(`.${name}`));
    const canvases = [...motion.querySelectorAll("canvas")], values = [...motion.querySelectorAll(".values")];
    const load = () => {
      const content = motion.content ?? JSON.parse(motion.querySelector(".data").textContent);
      for (const pose of poses ?? []) {
        pose(0, null).traverse(({ geometry, material }) => [geometry, material].flat().forEach((each) => each?.dispose()));
      }
      ({ duration, frames, truth, panels } = content);
      poses = renderer && panels.map((panel) => (panel.moments ? polhode : build)({ ...panel, colours: content.colours }));
      exact = truth !== null && split(panels[truth].q, 4, Quaternion);
    };
    load();
    motion.querySelector(".missing").hidden = Boolean(renderer);
    for (const each of canvases) each.hidden = !renderer;
    let t = 0, last = null, visible = false;

    const draw = () => {
      const frame = (t / duration) * (frames - 1);
      slider.value = t;
      slider.ariaValueText = clock.textContent = `${t.toFixed(duration < 2 ? 3 : 2)} s`;
      for (const [k, { sizes }] of panels.entries()) {
        for (const [j, cell] of [...values[k].querySelectorAll("dd")].entries()) {
          [, cell.textContent, cell.className] = sizes[j].findLast(([from]) => from <= frame + 1e-9);
        }
      }
      const width = Math.round(canvases[0].clientWidth * devicePixelRatio), height = Math.round(canvases[0].clientHeight * devicePixelRatio);
      if (!poses || !width) return;
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.position.set(Math.cos(view.tilt) * Math.cos(view.turn), Math.cos(view.tilt) * Math.sin(view.turn), Math.sin(view.tilt));
      camera.position.multiplyScalar(6.8 * Math.max(1, height / width));
      camera.lookAt(0, 0, 0);
      camera.updateProjectionMatrix();
      for (const [k, target] of canvases.entries()) {
        renderer.render(poses[k](frame, k !== truth && exact), camera);
        Object.assign(target, { width, height }); // this clears it
        target.getContext("2d").drawImage(canvas, 0, 0);
      }
    };
    const turnView = (turn, tilt) => {
      view.turn += turn;
      view.tilt = Math.max(-1.5, Math.min(1.5, view.tilt + tilt));
      draw();
    };
    const step = (now) => {
      if (last === null) return;
      if (visible) {
        t = (t + (Math.min(now - last, 100) / 1000) * Number(speed.value)) % duration;
        draw();
      }
      last = now;
      requestAnimationFrame(step);
    };
    const run = (on) => {
      if (on && last === null) requestAnimationFrame(step);
      last = on ? performance.now() : null;
      play.textContent = on ? "Pause" : "Play";
    };
    play.addEventListener("click", () => run(last === null));
    slider.addEventListener("input", () => { run(false); t = Number(slider.value); draw(); });
    slider.addEventListener("keydown", (event) => { if (event.key === " ") { event.preventDefault(); play.click(); } });
    motion.querySelector(".panels").addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
      if (buttons) turnView(-movementX / 120, movementY / 120);
    });
    motion.querySelector(".panels").addEventListener("keydown", (event) => {
      const by = { ArrowLeft: [0.15, 0], ArrowRight: [-0.15, 0], ArrowUp: [0, -0.15], ArrowDown: [0, 0.15] }[event.key];
      if (by) { event.preventDefault(); turnView(...by); }
    });
    motion.addEventListener("content", () => { load(); draw(); });
    new IntersectionObserver(([entry]) => { visible = entry.isIntersecting; }).observe(motion);
    new ResizeObserver(draw).observe(motion);
    motion.dataset.drawn = renderer ? "3d" : "numbers";
    if (renderer && !matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
  }
})();
