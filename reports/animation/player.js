"use strict";
// Players of motions. Each element .motion has its panels as JSON. One WebGL context draws all panels, one after the other, because
// browsers allow only a few contexts per page; the result is copied into the canvas of the panel.
(async () => {
  const packed = Uint8Array.from(atob(document.getElementById("three").textContent), (c) => c.charCodeAt(0));
  const library = document.createElement("script");
  library.textContent = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  document.head.append(library); // runs it: `THREE`
  const { Vector3, Quaternion } = THREE;
  const FACES = [0xd55e00, 0xf2b48a, 0x0072b2, 0x8fc4e8, 0xe0a800, 0xf7e3a1]; // +x, -x, +y, -y, +z, -z
  const ARROW = 0x009e73, TRACE = 0xcc3399, OUTLINE = 0x808890;

  const canvas = document.createElement("canvas");
  const context = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  const renderer = context && new THREE.WebGLRenderer({ canvas, context });
  const camera = new THREE.PerspectiveCamera(30, 1, 1, 20);
  const view = { turn: 0.6, tilt: 0.35 };

  const quaternions = (flat) => Array.from({ length: flat.length / 4 }, (_, k) => new Quaternion(flat[4 * k + 1], flat[4 * k + 2], flat[4 * k + 3], flat[4 * k]));
  const mesh = (geometry, color) => new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color }));

  // The picture of a body in its principal axes, its angular momentum, the trace of the tip of an axis, and the outline of the truth.
  function build({ size, tip, q, L }) {
    const scene = new THREE.Scene(), body = new THREE.Group(), arrow = new THREE.Group();
    const end = new Vector3(...tip), box = new THREE.BoxGeometry(...size), edges = new THREE.EdgesGeometry(box);
    const rod = mesh(new THREE.CylinderGeometry(0.025, 0.025, end.length()), TRACE), ball = mesh(new THREE.SphereGeometry(0.06), TRACE);
    rod.position.copy(end).divideScalar(2);
    rod.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), end.clone().normalize());
    ball.position.copy(end);
    const solid = new THREE.Mesh(box, FACES.map((color) => new THREE.MeshLambertMaterial({ color })));
    body.add(solid, new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ color: 0x202428 })), rod, ball);
    const shaft = mesh(new THREE.CylinderGeometry(0.035, 0.035, 1), ARROW), head = mesh(new THREE.ConeGeometry(0.11, 0.26), ARROW);
    arrow.add(shaft, head);
    const outline = new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ color: OUTLINE, depthTest: false }));
    const turns = quaternions(q), fine = 6; // points of the trace between two frames
    const points = turns.slice(1).flatMap((next, k) => Array.from({ length: fine }, (_, j) =>
      end.clone().applyQuaternion(new Quaternion().slerpQuaternions(turns[k], next, (j + 1) / fine)).toArray()));
    const line = new THREE.LineGeometry().setPositions([end.clone().applyQuaternion(turns[0]).toArray(), ...points].flat());
    const trace = new THREE.Line2(line, new THREE.LineMaterial({ color: TRACE, linewidth: 2 }));
    const sun = new THREE.DirectionalLight(0xffffff, 1.8);
    sun.position.set(3, 2, 5);
    scene.add(new THREE.HemisphereLight(0xffffff, 0xb8c0c8, 2.1), sun, body, arrow, trace, outline);
    const place = (frame, of = turns) => {
      const k = Math.min(Math.floor(frame), of.length - 1), next = Math.min(k + 1, of.length - 1);
      return [k, next, Math.min(frame, of.length - 1) - k];
    };
    return (frame, truth) => {
      const [k, next, share] = place(frame);
      body.quaternion.slerpQuaternions(turns[k], turns[next], share);
      const momentum = new Vector3(...L.slice(3 * k, 3 * k + 3)).lerp(new Vector3(...L.slice(3 * next, 3 * next + 3)), share).multiplyScalar(1.45);
      const length = Math.min(momentum.length(), 1.8); // longer ones leave the panel
      arrow.visible = length > 0.05;
      arrow.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), momentum.normalize());
      shaft.scale.y = head.position.y = length;
      shaft.position.y = length / 2;
      line.instanceCount = Math.max(1, Math.round(Math.min(frame, turns.length - 1) * fine));
      if ((outline.visible = Boolean(truth))) {
        const [a, b, s] = place(frame, truth);
        outline.quaternion.slerpQuaternions(truth[a], truth[b], s);
      }
      return scene;
    };
  }

  for (const motion of document.querySelectorAll(".motion")) {
    const { duration, frames, truth, panels } = JSON.parse(motion.querySelector(".data").textContent);
    const [play, slider, clock, speed] = [".play", ".time", ".clock", ".speed"].map((name) => motion.querySelector(name));
    const canvases = [...motion.querySelectorAll("canvas")], values = [...motion.querySelectorAll(".values")];
    const pose = renderer && panels.map(build), exact = truth === null ? null : quaternions(panels[truth].q);
    motion.querySelector(".missing").hidden = Boolean(renderer);
    for (const each of canvases) each.hidden = !renderer;
    let t = 0, last = null, visible = false;

    const draw = () => {
      const frame = (t / duration) * (frames - 1);
      slider.value = t;
      clock.textContent = `${t.toFixed(duration < 2 ? 3 : 2)} s`;
      slider.ariaValueText = clock.textContent;
      for (const [k, { ended, sizes }] of panels.entries()) {
        for (const [j, series] of Object.values(sizes).entries()) {
          const value = series[Math.min(Math.floor(frame), series.length - 1)], cell = values[k].querySelectorAll("dd")[j];
          const [good, fair] = cell.dataset.limits.split(" ").map(Number);
          cell.textContent = value < 1e-15 ? "< 1e-15" : value < 0.1 || value >= 10 ? value.toExponential(0).replace("+", "") : value.toPrecision(1);
          cell.className = value <= good ? "good" : value <= fair ? "fair" : "bad";
        }
        const over = values[k].querySelector(".ended");
        if (over) over.hidden = t <= ended;
      }
      if (!pose) return;
      const scale = devicePixelRatio, width = Math.round(canvases[0].clientWidth * scale), height = Math.round(canvases[0].clientHeight * scale);
      if (!width) return;
      renderer.setSize(width, height, false);
      camera.position.setFromSphericalCoords(6.8 * Math.max(1, height / width), Math.PI / 2 - view.tilt, view.turn);
      camera.position.set(camera.position.z, camera.position.x, camera.position.y); // the world's third axis is up
      camera.up.set(0, 0, 1);
      camera.aspect = width / height;
      camera.lookAt(0, 0, 0);
      camera.updateProjectionMatrix();
      for (const [k, target] of canvases.entries()) {
        renderer.render(pose[k](frame, k === truth ? null : exact), camera);
        if (target.width !== width || target.height !== height) Object.assign(target, { width, height });
        const paper = target.getContext("2d");
        paper.clearRect(0, 0, width, height);
        paper.drawImage(canvas, 0, 0);
      }
    };
    const step = (now) => {
      if (last === null) return;
      if (visible) t = (t + (Math.min(now - last, 100) / 1000) * Number(speed.value)) % duration;
      last = now;
      if (visible) draw();
      requestAnimationFrame(step);
    };
    const run = (on) => {
      play.textContent = on ? "Pause" : "Play";
      const started = last !== null;
      last = on ? performance.now() : null;
      if (on && !started) requestAnimationFrame(step);
    };
    play.addEventListener("click", () => run(last === null));
    slider.addEventListener("input", () => { run(false); t = Number(slider.value); draw(); });
    slider.addEventListener("keydown", (event) => { if (event.key === " ") { event.preventDefault(); play.click(); } });
    for (const each of canvases) {
      each.addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
        if (!buttons) return;
        view.turn -= movementX / 120;
        view.tilt = Math.max(-1.5, Math.min(1.5, view.tilt + movementY / 120));
        draw();
      });
    }
    new IntersectionObserver(([entry]) => { visible = entry.isIntersecting; }).observe(motion);
    new ResizeObserver(draw).observe(motion);
    draw();
    motion.dataset.drawn = renderer ? "3d" : "numbers";
    if (renderer && !matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
  }
})();
