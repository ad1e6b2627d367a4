"use strict";
// The fish as a mesh, in its body frame: x forward, y starboard, z down, metres.
Robofish.Fish = class {
  constructor(shape, colour) {
    this.group = new THREE.Group();
    this.shape = shape;
    this.skin = [];
    const hull = new THREE.Group();
    hull.position.x = shape.nose - shape.length / 2;
    hull.add(this.mesh(Robofish.hullGeometry(shape), { opacity: 0.5, vertexColors: true }));
    this.addFins(hull);
    this.addEyes(hull);
    this.tail = new THREE.Group();
    this.tail.position.fromArray(shape.tailRoot);
    this.tail.add(this.mesh(Robofish.tailGeometry(shape), { opacity: 0.95, vertexColors: true }));
    this.block = new THREE.Mesh(
      new THREE.BoxGeometry(...shape.block),
      new THREE.MeshStandardMaterial({ color: 0xf5c400, roughness: 0.45, metalness: 0.3 }),
    );
    this.group.add(this.block, this.tail, hull);
    this.paint(colour);
  }

  mesh(geometry, { opacity, vertexColors = false }) {
    const material = new THREE.MeshStandardMaterial({
      roughness: 0.5, metalness: 0.05, transparent: opacity < 1, opacity, vertexColors,
      side: THREE.DoubleSide, depthWrite: opacity > 0.9,
    });
    this.skin.push(material);
    return new THREE.Mesh(geometry, material);
  }

  addFins(hull) {
    const { length, height, width } = this.shape;
    const back = [
      [0.12 * length, 0, -0.47 * height], [-0.05 * length, 0, -0.74 * height],
      [-0.22 * length, 0, -0.62 * height], [-0.26 * length, 0, -0.28 * height],
    ];
    hull.add(this.mesh(Robofish.fan(back), { opacity: 0.95 }));
    for (const side of [-1, 1]) {
      const fin = [
        [0.16 * length, side * 0.44 * width, 0.12 * height],
        [0.02 * length, side * 0.86 * width, 0.3 * height],
        [-0.1 * length, side * 0.8 * width, 0.32 * height],
        [-0.02 * length, side * 0.46 * width, 0.16 * height],
      ];
      hull.add(this.mesh(Robofish.fan(fin), { opacity: 0.95 }));
    }
  }

  addEyes(hull) {
    const { length, height, width } = this.shape;
    const white = new THREE.MeshStandardMaterial({ color: 0xffffff, roughness: 0.3 });
    const black = new THREE.MeshStandardMaterial({ color: 0x111111, roughness: 0.2 });
    for (const side of [-1, 1]) {
      const eye = new THREE.Group();
      const ball = new THREE.Mesh(new THREE.SphereGeometry(0.03 * length, 16, 12), white);
      const pupil = new THREE.Mesh(new THREE.SphereGeometry(0.02 * length, 12, 10), black);
      pupil.position.set(0.006 * length, side * 0.015 * length, 0);
      eye.add(ball, pupil);
      eye.position.set(0.33 * length, side * 0.365 * width, -0.12 * height);
      hull.add(eye);
    }
  }

  paint(colour) {
    for (const material of this.skin) material.color.set(colour);
  }

  pose({ position, quaternion, tail, block }, scale) {
    this.group.position.fromArray(position);
    this.group.quaternion.set(quaternion[1], quaternion[2], quaternion[3], quaternion[0]);
    this.group.scale.setScalar(scale);
    this.tail.rotation.z = tail;
    this.block.position.set(block[0], block[1], block[2]);
    this.block.rotation.x = -block[3];
  }
};

// A smooth body of elliptic sections; `profile` is its outline from the nose to the tail.
Robofish.hullGeometry = ({ length, height, width, profile }) => {
  const rings = 40;
  const sectors = 32;
  const points = [];
  const shades = [];
  const faces = [];
  for (let i = 0; i <= rings; i += 1) {
    const along = Math.cos((Math.PI * i) / rings);
    const place = ((1 - along) / 2) * (profile.length - 1);
    const index = Math.min(Math.floor(place), profile.length - 2);
    const radius = profile[index] + (place - index) * (profile[index + 1] - profile[index]);
    for (let j = 0; j < sectors; j += 1) {
      const angle = (2 * Math.PI * j) / sectors;
      const down = Math.cos(angle);
      points.push(
        (along * length) / 2, (radius * width * Math.sin(angle)) / 2, (radius * height * down) / 2,
      );
      const shade = 0.85 + 0.15 * down;
      shades.push(shade, shade, shade);
      if (i < rings) {
        const here = i * sectors + j;
        const beside = i * sectors + ((j + 1) % sectors);
        faces.push(here, here + sectors, beside, beside, here + sectors, beside + sectors);
      }
    }
  }
  return Robofish.geometry(points, faces, shades);
};

// Stalk and crescent fin, upright behind the root; seen from both sides.
Robofish.tailGeometry = ({ tailLength, tailSpan, height }) => {
  const outline = [
    [0.02, -0.1 * height], [-0.45, -0.055 * height], [-0.72, -0.42 * tailSpan],
    [-1.0, -0.5 * tailSpan], [-0.86, -0.16 * tailSpan], [-0.82, 0],
    [-0.86, 0.16 * tailSpan], [-1.0, 0.5 * tailSpan], [-0.72, 0.42 * tailSpan],
    [-0.45, 0.055 * height], [0.02, 0.1 * height],
  ];
  const points = [];
  const shades = [];
  const faces = [];
  const thick = 0.018 * tailLength;
  for (const side of [-1, 1]) {
    const first = points.length / 3;
    for (const [along, down] of outline) {
      const taper = side * thick * (1 + along) * 2;
      points.push(along * tailLength, taper, down);
      shades.push(0.9, 0.9, 0.9);
    }
    points.push(-0.55 * tailLength, side * thick * 0.95, 0);
    shades.push(0.8, 0.8, 0.8);
    const middle = first + outline.length;
    for (let k = 0; k < outline.length; k += 1) {
      faces.push(middle, first + k, first + ((k + 1) % outline.length));
    }
  }
  return Robofish.geometry(points, faces, shades);
};

Robofish.fan = (corners) => {
  const faces = [];
  for (let k = 1; k < corners.length - 1; k += 1) faces.push(0, k, k + 1);
  return Robofish.geometry(corners.flat(), faces);
};

Robofish.geometry = (points, faces, shades) => {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  if (shades) geometry.setAttribute("color", new THREE.Float32BufferAttribute(shades, 3));
  geometry.setIndex(faces);
  geometry.computeVertexNormals();
  return geometry;
};
