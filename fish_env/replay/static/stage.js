"use strict";
// The water: floor grid, paths and fish, seen through a camera that can be dragged.
// Everything in `water` is in the model's inertial frame: x north, y east, z down.
Robofish.Stage = class {
  constructor(holder, shape) {
    this.holder = holder;
    this.shape = shape;
    this.follow = false;
    // Keeps what was drawn, for printing and pictures of the page.
    const options = { antialias: true, alpha: true, preserveDrawingBuffer: true };
    this.renderer = new THREE.WebGLRenderer(options);
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.domElement.setAttribute("role", "img");
    this.renderer.domElement.setAttribute("aria-label", "fish swimming in three dimensions");
    holder.prepend(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x667788, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(2, 5, 3);
    this.scene.add(sun);
    this.water = new THREE.Group();
    this.water.rotation.x = Math.PI / 2;
    this.scene.add(this.water);
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.01, 2000);
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.wish());
    this.actors = [];
    this.moment = 0;
    new ResizeObserver(() => this.resize()).observe(holder);
  }

  // Draws once before the next picture, however often it is wished for.
  wish() {
    if (this.wished) return;
    this.wished = true;
    requestAnimationFrame(() => {
      this.wished = false;
      this.draw();
    });
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    for (const actor of this.actors) {
      for (const line of [actor.faint, actor.bright]) line.material.resolution.set(width, height);
    }
    this.wish();
  }

  show(tracks, dark) {
    this.clear();
    this.dark = dark;
    this.actors = tracks.map((track) => this.actor(track));
    this.measure(tracks);
    this.addFloor();
    this.resize();
  }

  clear() {
    this.water.traverse((node) => {
      node.geometry?.dispose();
      node.material?.map?.dispose();
      node.material?.dispose();
    });
    this.water.clear();
    this.actors = [];
  }

  actor(track) {
    const colour = track.colour(this.dark);
    const fish = new Robofish.Fish(this.shape, colour);
    const points = Array.from(track.position);
    const faint = Robofish.wideLine(points, colour, 1.5, 0.3);
    const bright = Robofish.wideLine(points, colour, 3, 0.95);
    const drop = new THREE.Line(
      new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, 1)]),
      new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.5 }),
    );
    const shadow = new THREE.Mesh(
      new THREE.CircleGeometry(0.28 * this.shape.length, 24),
      new THREE.MeshBasicMaterial({
        color: colour, transparent: true, opacity: 0.35, side: THREE.DoubleSide,
      }),
    );
    this.water.add(faint, bright, drop, shadow, fish.group);
    return { track, fish, faint, bright, drop, shadow };
  }

  measure(tracks) {
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    for (const { position } of tracks) {
      for (let i = 0; i < position.length; i += 1) {
        this.low[i % 3] = Math.min(this.low[i % 3], position[i]);
        this.high[i % 3] = Math.max(this.high[i % 3], position[i]);
      }
    }
    const spans = this.high.map((value, k) => value - this.low[k]);
    this.extent = Math.max(Math.hypot(...spans), 3 * this.shape.length);
  }

  // A grid of round cells below the lowest point, and the directions of north and east.
  addFloor() {
    const reach = Math.max(this.high[0] - this.low[0], this.high[1] - this.low[1], 0.6);
    const rough = reach / 8;
    const power = 10 ** Math.floor(Math.log10(rough));
    this.cell = [1, 2, 5, 10].map((n) => n * power).find((value) => value >= rough);
    this.floor = this.high[2] + 1.2 * this.shape.length;
    const count = 2 * Math.ceil((0.75 * reach) / this.cell + 1);
    const lines = this.dark ? [0x5d7385, 0x33475a] : [0x7f98ab, 0xb5c6d3];
    const grid = new THREE.GridHelper(count * this.cell, count, ...lines);
    grid.rotation.x = Math.PI / 2;
    const middle = [0, 1].map(
      (k) => this.cell * Math.round((this.low[k] + this.high[k]) / 2 / this.cell),
    );
    grid.position.set(middle[0], middle[1], this.floor);
    this.water.add(grid);
    const edge = (count / 2 + 0.45) * this.cell;
    this.addWord("N", [middle[0] + edge, middle[1], this.floor]);
    this.addWord("E", [middle[0], middle[1] + edge, this.floor]);
    if (this.low[2] > 0.5 * this.shape.height) this.addSurface(middle, count * this.cell);
  }

  addSurface(middle, size) {
    const surface = new THREE.Mesh(
      new THREE.PlaneGeometry(size, size),
      new THREE.MeshBasicMaterial({
        color: 0x4aa3d8, transparent: true, opacity: 0.08, side: THREE.DoubleSide,
        depthWrite: false,
      }),
    );
    surface.position.set(middle[0], middle[1], 0);
    this.water.add(surface);
  }

  addWord(text, place) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 64;
    const pen = canvas.getContext("2d");
    pen.font = "bold 44px sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillStyle = this.dark ? "#a9bccb" : "#48606f";
    pen.fillText(text, 32, 34);
    const word = new THREE.Sprite(
      new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas), depthWrite: false }),
    );
    word.position.fromArray(place);
    word.scale.setScalar(0.8 * this.cell);
    this.water.add(word);
  }

  // Where a point of the water is in the scene: x north to the right, up is up.
  outside([x, y, z]) {
    return new THREE.Vector3(x, -z, y);
  }

  leader() {
    return this.actors.find((actor) => actor.track.shown) ?? this.actors[0];
  }

  look(view) {
    const middle = this.low.map((value, k) => (value + this.high[k]) / 2);
    this.follow = view === "follow";
    const centre = this.follow ? this.leader().track.at(this.moment).position : middle;
    const target = this.outside(centre);
    // Narrow windows need more distance for the same width.
    const narrow = Math.max(1, 1.3 / this.camera.aspect);
    const distance = narrow * (this.follow ? 6 * this.shape.length : 0.95 * this.extent + 2.5 * this.shape.length);
    const from = { follow: [-0.62, 0.42, 0.66], overview: [-0.55, 0.6, 0.6] };
    from.top = [-0.001, 1, 0];
    from.side = [0, 0.08, 1];
    const direction = new THREE.Vector3(...from[view]).normalize();
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(direction, distance);
    this.controls.update();
    this.wish();
  }

  firstView() {
    return this.extent > 12 * this.shape.length ? "follow" : "overview";
  }

  // Turns by angles (rad) around the target, and goes nearer or farther by a factor.
  orbit(around, up, factor) {
    const arm = this.camera.position.clone().sub(this.controls.target);
    const radius = arm.length() * factor;
    const heading = Math.atan2(arm.z, arm.x) + around;
    const height = Math.asin(Math.min(Math.max(arm.y / arm.length(), -1), 1)) + up;
    const limited = Math.min(Math.max(height, -1.5), 1.5);
    arm.set(
      Math.cos(limited) * Math.cos(heading), Math.sin(limited), Math.cos(limited) * Math.sin(heading),
    );
    this.camera.position.copy(this.controls.target).addScaledVector(arm, radius);
    this.controls.update();
    this.wish();
  }

  update(time) {
    const leader = this.leader();
    if (this.follow && leader) {
      const before = this.outside(leader.track.at(this.moment).position);
      const step = this.outside(leader.track.at(time).position).sub(before);
      this.camera.position.add(step);
      this.controls.target.add(step);
    }
    this.moment = time;
    this.wish();
  }

  // Far away the fish are drawn larger, so that they stay visible.
  enlargement() {
    const distance = this.camera.position.distanceTo(this.controls.target);
    return Math.max(1, (0.055 * distance) / this.shape.length);
  }

  draw() {
    const scale = this.enlargement();
    for (const { track, fish, faint, bright, drop, shadow } of this.actors) {
      const pose = track.at(this.moment);
      for (const part of [fish.group, faint, bright, drop, shadow]) part.visible = track.shown;
      fish.pose(pose, scale);
      bright.geometry.instanceCount = Math.max(0, Math.round(pose.frame));
      const [x, y, z] = pose.position;
      drop.position.set(x, y, z);
      drop.scale.z = Math.max(this.floor - z, 0.001);
      shadow.position.set(x, y, this.floor - 0.002);
      shadow.scale.setScalar(scale);
    }
    this.onDraw?.(scale, this.cell);
    this.renderer.render(this.scene, this.camera);
  }
};

Robofish.wideLine = (points, colour, width, opacity) => {
  const geometry = new THREE.LineGeometry();
  geometry.setPositions(points);
  const material = new THREE.LineMaterial({
    color: colour, linewidth: width, transparent: true, opacity, depthWrite: false,
  });
  const line = new THREE.Line2(geometry, material);
  line.frustumCulled = false;
  return line;
};
