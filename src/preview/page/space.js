// The view in space, by three.js: the set's own GLB files, every level of detail, side by side, and a forest.

import * as THREE from '/three/three.module.js';
import { GLTFLoader } from '/three/GLTFLoader.js';
import { OrbitControls } from '/three/OrbitControls.js';
import { impostor } from '/three/impostor.js';

const FIELD = 60;
const TREES = 1000;
const slope = 2 * Math.tan(FIELD / 2 * Math.PI / 180);

/** The level for a share of the screen's height: each is shown down to its measured threshold. */
export function levelAt(levels, coverage) {
  const found = levels.findIndex(level => coverage >= level.coverage);
  return found < 0 ? levels.length - 1 : found;
}

/** What a file's vertices tell about wind, as GLSL: declarations, and bend and phase, pivot, swing, flutter and phase of the leaf (examples/engines/wind.md); none where they tell nothing. */
function windOf(attributes) {
  const { uv1, texcoord_4, texcoord_5, _wind, _wind_bend, _wind_leaf } = attributes;
  const declared = names => names.map(name => /^uv[123]$/.test(name)
    ? `\n#ifndef USE_${name.toUpperCase()}\nattribute vec2 ${name};\n#endif` : `\nattribute ${name === '_wind' ? 'vec4' : 'vec2'} ${name};`).join('');
  if (_wind && _wind_leaf && (_wind_bend || uv1)) {
    const bend = _wind_bend ? '_wind_bend' : 'uv1';
    const read = `vec2 told = ${bend}; vec3 pivot = _wind.xyz; float swing = _wind.w; vec2 leaf = _wind_leaf;`;
    return { declared: declared([bend, '_wind', '_wind_leaf']), read };
  }
  if (!texcoord_4) return null;
  // Light maps take the first set.
  const [a, b, c, d] = texcoord_5 ? ['uv2', 'uv3', 'texcoord_4', 'texcoord_5'] : ['uv1', 'uv2', 'uv3', 'texcoord_4'];
  // In files for the web places are whole numbers.
  const swing = attributes[c].array instanceof Uint16Array ? `${c}.y / 65535.0` : `${c}.y`;
  return { declared: declared([a, b, c, d]), read: `vec2 told = ${a}; vec3 pivot = vec3(${b}, ${c}.x); float swing = ${swing}; vec2 leaf = ${d};` };
}

/** Wind for a material: by what the file's vertices tell where the preset has them do so, else by height. `unit` is a metre in the units of positions. */
function sway(material, time, strength, wind, height, unit) {
  const metres = value => (value * unit).toFixed(4);
  material.onBeforeCompile = shader => {
    shader.uniforms.twTime = time;
    shader.uniforms.twWind = strength;
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', `#include <common>\nuniform float twTime; uniform float twWind;${wind?.declared ?? ''}`)
      .replace('#include <begin_vertex>', `#include <begin_vertex>
        {
          float gust = twWind * (0.6 + 0.4 * sin(twTime * 0.7));
          ${wind ? `${wind.read}
          float phase = told.y * 6.2832, bend = max(told.x - 0.4 * swing, 0.0) / 0.6;
          // The limb swings about its own base, each leaf flutters, and the whole tree bends.
          vec3 axis = vec3(-0.33, 0.0, 0.944), arm = transformed - pivot;
          float angle = 0.12 * swing * gust * sin(twTime * 1.7 + phase);
          transformed = pivot + arm * cos(angle) + cross(axis, arm) * sin(angle) + axis * dot(axis, arm) * (1.0 - cos(angle));
          transformed += vec3(0.5, 1.0, 0.5) * ${metres(height * 0.004)} * leaf.x * gust * sin(twTime * 7.0 + leaf.y * 6.2832);` : `
          float up = clamp(position.y / ${metres(height)}, 0.0, 1.0), bend = up * up, phase = (position.x * 1.7 + position.z * 2.3) / ${metres(1)};
          transformed += vec3(0.6, 0.25, 0.8) * gust * up * length(position.xz) * 0.12 * sin(twTime * 2.3 + phase) * ${(height * 0.012).toFixed(4)};`}
          transformed += vec3(1.0, 0.0, 0.35) * bend * gust * sin(twTime * 1.1) * ${metres(height * 0.02)};
        }`);
  };
  material.customProgramCacheKey = () => `sway ${wind?.read} ${height.toFixed(3)} ${metres(1)}`;
}

export function space(box, tell) {
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.setScissorTest(true);
  box.prepend(renderer.domElement);
  const camera = new THREE.PerspectiveCamera(FIELD, 1, 0.05, 20000);
  const controls = new OrbitControls(camera, renderer.domElement);
  Object.assign(controls, { enableDamping: true, dampingFactor: .12, maxPolarAngle: Math.PI * .495, zoomSpeed: .8 });
  const time = { value: 0 }, strength = { value: 0 };
  const loader = new GLTFLoader();
  const files = new Map();
  const dark = matchMedia('(prefers-color-scheme: dark)');

  function world() {
    const scene = new THREE.Scene();
    // The light of the pictures that the program draws itself; three.js divides by pi.
    const sky = new THREE.HemisphereLight(new THREE.Color(.62, .7, .8), new THREE.Color(.4, .4, .3), Math.PI);
    const sun = new THREE.DirectionalLight(new THREE.Color(2.2, 2.05, 1.8), Math.PI);
    sun.position.set(.482, .723, .494);
    // Leaves let light through: a second, weaker sun from behind stands for it.
    const through = new THREE.DirectionalLight(new THREE.Color(.6, .62, .45), Math.PI);
    through.position.set(-.5, .35, -.6);
    const ground = new THREE.Mesh(new THREE.CircleGeometry(1, 72), new THREE.ShaderMaterial({
      transparent: true, depthWrite: false, uniforms: { tint: { value: new THREE.Color() } },
      vertexShader: 'varying vec2 at; void main() { at = position.xy; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }',
      // Darkest under the tree, gone at the edge.
      fragmentShader: 'uniform vec3 tint; varying vec2 at; void main() { float r = length(at); gl_FragColor = vec4(tint * (0.8 + 0.2 * smoothstep(0.0, 0.35, r)), 0.7 * (1.0 - smoothstep(0.35, 1.0, r))); \n#include <colorspace_fragment>\n }',
    }));
    ground.rotation.x = -Math.PI / 2;
    ground.position.y = -.005;
    ground.renderOrder = -1;
    scene.add(sky, sun, through, ground);
    return { scene, ground, trees: new THREE.Group() };
  }
  const left = world(), right = world();
  for (const w of [left, right]) w.scene.add(w.trees);
  const tint = () => { for (const w of [left, right]) w.ground.material.uniforms.tint.value.set(dark.matches ? 0x343b33 : 0xcfcab6); };
  tint();
  dark.addEventListener('change', tint);

  /** All levels of a variant, each a group of meshes; loaded once for a key. */
  function load(set, variant) {
    const name = `${set.key} ${variant.name}`;
    if (!files.has(name)) {
      if (files.size > 40) files.delete(files.keys().next().value);
      files.set(name, (async () => {
        const url = `/set/${encodeURIComponent(set.set)}/${encodeURIComponent(variant.file)}`;
        const gltf = await loader.loadAsync(url);
        const json = gltf.parser.json;
        return Promise.all(variant.levels.map(async level => {
          const mesh = json.meshes.findIndex(m => m.name === level.mesh);
          const node = json.nodes.findIndex(n => n.mesh === mesh);
          // A level in a file of its own, or a level that the file does not hold: what the scene shows.
          const object = node < 0 ? gltf.scene : await gltf.parser.getDependency('node', node);
          const group = new THREE.Group();
          const copy = object.clone();
          group.add(level.kind === 'Impostor' ? impostor(copy) : copy);
          return group;
        }));
      })());
    }
    return files.get(name);
  }
  /** A part's material in the wind; an impostor's shader is its own. */
  function swaying(part, height) {
    if (part.userData.facing) return part.material;
    const own = part.material.clone();
    const wind = windOf(part.geometry.attributes);
    box.dataset.wind = wind ? 'told' : 'by height';
    sway(own, time, strength, wind, height, 1 / part.getWorldScale(new THREE.Vector3()).x);
    return own;
  }
  function dressed(group, height) {
    group.traverse(part => {
      if (!part.isMesh || part.userData.swaying) return;
      part.material = swaying(part, height);
      part.userData.swaying = true;
    });
    return group;
  }

  /** Lines in place of faces; leaves are then drawn to their cards' edges. */
  function lined(part, on) {
    if (!part.isMesh || part.material.wireframe === on) return;
    part.userData.cut ??= part.material.alphaTest;
    Object.assign(part.material, { wireframe: on, alphaTest: on ? 0 : part.userData.cut, needsUpdate: true });
  }
  const seen = new THREE.Frustum(), view = new THREE.Matrix4(), ball = new THREE.Sphere();
  let wanted = null, trees = [null, null], forest = null, run = 0, framed = '', drawn = 0;
  async function show(what) {
    wanted = what;
    strength.value = what.wind ? 1 : 0;
    const mine = ++run;
    let made;
    try {
      made = what.forest
        ? await plant(what.set)
        : await Promise.all([what.variant, what.other].map(async v => v && { variant: v, levels: (await load(what.set, v)).map(g => dressed(g, v.height)) }));
    } catch (error) { if (mine === run) box.dataset.drawn = `error ${error.message}`; return; }
    if (mine !== run) return;
    left.trees.clear();
    right.trees.clear();
    forest = what.forest ? made : null;
    trees = what.forest ? [null, null] : made;
    if (forest) left.trees.add(...forest.parts.flat().map(p => p.mesh));
    for (const w of [left, right]) w.trees.traverse(p => lined(p, what.wire));
    const frame = `${what.set.set} ${what.forest ? 'forest' : what.variant.name}`;
    if (frame !== framed) { framed = frame; look(what); }
    if (!forest) for (const [tree, w] of [[trees[0], left], [trees[1], right]]) {
      if (!tree) continue;
      tree.levels.forEach(level => level.traverse(p => lined(p, what.wire)));
      w.trees.add(...tree.levels);
    }
    drawn = 0;
    need = 3;
  }
  function look({ variant, set, forest: many }) {
    const tall = many ? Math.max(...set.variants.map(v => v.height)) : variant.height;
    const wide = 2 * Math.max(...variant.bounds.max.map(Math.abs), -variant.bounds.min[0], -variant.bounds.min[2], tall * .3) / Math.max(.6, Math.min(1.6, camera.aspect));
    const away = many ? tall * 3.2 : Math.max(tall, wide * .8) / (.7 * slope);
    controls.target.set(0, tall * (many ? .5 : .46), 0);
    camera.position.set(away * .43, tall * .56, away * .9);
    if (many) {
      // From its edge, over the crowns.
      const edge = Math.sqrt(TREES) * spacing(set.variants) / 2;
      controls.target.set(0, tall * .4, edge * .35);
      camera.position.set(edge * .18, tall * 1.7, edge + tall * 1.5);
    }
    controls.minDistance = tall * .1;
    controls.maxDistance = tall * 140;
    for (const w of [left, right]) w.ground.scale.setScalar(many ? tall * 60 : tall * 1.5);
  }

  const spacing = some => Math.max(...some.map(v => Math.max(v.bounds.max[0] - v.bounds.min[0], v.bounds.max[2] - v.bounds.min[2], v.height * .4)));
  /** A thousand trees of the set on a jittered grid; each is drawn at the level of its distance. */
  async function plant(set) {
    const some = set.variants.slice(0, 8);
    const all = await Promise.all(some.map(v => load(set, v)));
    const far = spacing(some);
    const side = Math.ceil(Math.sqrt(TREES));
    const places = [];
    // Addressed, so that the same forest grows each time.
    const dice = n => { let h = Math.imul(n ^ 0x9e3779b9, 0x85ebca6b); h ^= h >>> 13; h = Math.imul(h, 0xc2b2ae35); return ((h ^ h >>> 16) >>> 0) / 2 ** 32; };
    for (let i = 0; i < TREES; i++) {
      const x = (i % side - side / 2 + (dice(i * 5) - .5) * .7) * far, z = (Math.floor(i / side) - side / 2 + (dice(i * 5 + 1) - .5) * .7) * far;
      const turn = new THREE.Matrix4().makeRotationY(dice(i * 5 + 2) * Math.PI * 2).scale(new THREE.Vector3().setScalar(.85 + dice(i * 5 + 3) * .3));
      places.push({ variant: Math.floor(dice(i * 5 + 4) * some.length), at: new THREE.Vector3(x, 0, z), matrix: turn.setPosition(x, 0, z) });
    }
    const counts = some.map((_, v) => places.filter(p => p.variant === v).length);
    const parts = all.map((levels, v) => levels.flatMap((group, level) => {
      const made = [];
      group.traverse(part => {
        if (!part.isMesh) return;
        const mesh = new THREE.InstancedMesh(part.geometry, swaying(part, some[v].height), counts[v]);
        mesh.frustumCulled = false;
        made.push({ mesh, level });
      });
      return made;
    }));
    return { some, parts, places };
  }
  function sort({ some, parts, places }) {
    const fill = parts.map(all => all.map(() => 0));
    const most = Math.max(...some.map(v => v.levels.length));
    const counts = Array(most).fill(0);
    camera.updateMatrixWorld();
    seen.setFromProjectionMatrix(view.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    // Thresholds are measured on a screen of 1080 lines; who draws fewer may switch earlier.
    const lines = Math.min(1, box.clientHeight * renderer.getPixelRatio() / 1080);
    for (const place of places) {
      const { levels, height } = some[place.variant];
      ball.center.copy(place.at).y = height / 2;
      ball.radius = height;
      const sight = seen.intersectsSphere(ball);
      const away = Math.max(.01, camera.position.distanceTo(place.at));
      const level = wanted.level === 'auto' ? levelAt(levels, lines * height / (away * slope)) : Math.min(wanted.level, levels.length - 1);
      counts[level]++;
      if (sight) parts[place.variant].forEach((part, i) => { if (part.level === level) part.mesh.setMatrixAt(fill[place.variant][i]++, place.matrix); });
    }
    parts.forEach((all, v) => all.forEach((part, i) => { part.mesh.count = fill[v][i]; part.mesh.visible = fill[v][i] > 0; part.mesh.instanceMatrix.needsUpdate = true; }));
    return counts;
  }

  // Frames are drawn when something has changed, or moves.
  let last = 0, told = '', need = 3;
  function draw(now) {
    const wide = box.clientWidth, tall = box.clientHeight;
    if (!wide || !tall) return;
    const size = renderer.getSize(new THREE.Vector2());
    if (size.x !== wide || size.y !== tall) { renderer.setSize(wide, tall, false); need = 3; }
    time.value = now / 1000;
    if (controls.update() || strength.value) need = Math.max(need, 2);
    if (need <= 0) return;
    need--;
    const pair = !forest && trees[0] && trees[1];
    camera.aspect = (pair ? wide / 2 : wide) / tall;
    camera.updateProjectionMatrix();
    let facts = null;
    if (forest) {
      if (now - last > 120 || !drawn) { last = now; forest.counts = sort(forest); }
      facts = { distance: 0, coverage: 0, level: 0, levels: wanted.variant.levels, counts: forest.counts };
    } else {
      const away = Math.max(.01, camera.position.distanceTo(controls.target));
      for (const tree of trees) {
        if (!tree) continue;
        const { levels, height } = tree.variant;
        const coverage = height / (away * slope);
        const level = wanted.level === 'auto' ? levelAt(levels, coverage) : Math.min(wanted.level, levels.length - 1);
        tree.levels.forEach((group, i) => { group.visible = i === level; });
        facts ??= { distance: away, coverage, level, levels, counts: [] };
      }
    }
    const views = pair ? [[left, 0, wide / 2], [right, wide / 2, wide / 2]] : [[left, 0, wide]];
    renderer.setClearColor(0, 0);
    for (const [w, x, width] of views) {
      renderer.setViewport(x, 0, width, tall);
      renderer.setScissor(x, 0, width, tall);
      renderer.render(w.scene, camera);
    }
    if (facts) {
      const look = `${facts.level} ${facts.distance.toFixed(1)} ${facts.counts} ${wanted.variant.name}`;
      if (look !== told) { told = look; tell(facts); }
      drawn++;
      if (drawn === 2) box.dataset.drawn = JSON.stringify([wanted.variant.name, wanted.level, wanted.other?.name ?? null, wanted.forest, wanted.wire, wanted.wind, renderer.info.render.triangles]);
    }
  }
  renderer.setAnimationLoop(draw);
  return {
    show(what) { delete box.dataset.drawn; told = ''; show(what); },
    turn(degrees) {
      need = 3;
      const offset = camera.position.clone().sub(controls.target).applyAxisAngle(new THREE.Vector3(0, 1, 0), degrees * Math.PI / 180);
      camera.position.copy(controls.target).add(offset);
    },
    near(by) {
      const offset = camera.position.clone().sub(controls.target);
      camera.position.copy(controls.target).add(offset.setLength(Math.min(controls.maxDistance, Math.max(controls.minDistance, offset.length() * by))));
    },
    close() {
      renderer.setAnimationLoop(null);
      controls.dispose();
      dark.removeEventListener('change', tint);
      files.clear();
      renderer.dispose();
      renderer.domElement.remove();
    },
  };
}
