"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const [width, height] = data.size;
  const $ = (id) => document.getElementById(id);
  const stage = $("stage"), divider = $("divider"), reticle = $("reticle");
  const sides = { left: { select: $("left"), image: $("left-image"), tag: $("left-tag") },
                  right: { select: $("right"), image: $("right-image"), tag: $("right-tag") } };
  const tiles = [...document.querySelectorAll(".tile")];
  const clamp = (v, lo, hi) => Math.min(hi, Math.max(lo, v));

  const state = { left: 0, right: 1, kind: "color", split: 50, zoom: 8, spot: firstSpot() };

  /** Where techniques differ most, else the middle; pixels. */
  function firstSpot() {
    return data.spot ? [...data.spot] : [Math.floor(width / 2), Math.floor(height / 2)];
  }

  /** What an item shows for the kind chosen: the truth has no maps and shows its picture instead. */
  function shown(index) {
    const { files } = data.items[index];
    return files[state.kind] ? state.kind : "color";
  }
  const labels = Object.fromEntries(data.kinds.map((k) => [k.id, k.label]));

  // Pictures ----------------------------------------------------------------------------------

  const pictures = new Map();
  function picture(index) {
    const file = data.items[index].files[shown(index)];
    if (!pictures.has(file)) {
      const image = new Image();
      image.onload = () => drawTiles();
      image.src = file;
      pictures.set(file, image);
    }
    return pictures.get(file);
  }

  // Stage -------------------------------------------------------------------------------------

  function showSides() {
    for (const [name, { select, image, tag }] of Object.entries(sides)) {
      const index = state[name], item = data.items[index], kind = shown(index);
      const file = item.files[kind];
      if (image.getAttribute("src") !== file) image.src = file;
      image.alt = `${labels[kind]}: ${item.name}`;
      tag.textContent = kind === state.kind ? item.name : `${item.name} (${labels[kind].toLowerCase()})`;
      select.value = index;
    }
    for (const legend of document.querySelectorAll("[data-legend]"))
      legend.classList.toggle("shown", legend.dataset.legend === state.kind);
    for (const input of $("kinds").querySelectorAll("input")) input.checked = input.value === state.kind;
    tiles.forEach((tile, i) => tile.setAttribute("aria-pressed", i === state.left || i === state.right));
    showSplit();
    drawTiles();
  }

  function showSplit() {
    stage.style.setProperty("--split", `${state.split}%`);
    divider.setAttribute("aria-valuenow", Math.round(state.split));
    divider.setAttribute("aria-valuetext",
      `${Math.round(state.split)} % ${data.items[state.left].name}, rest ${data.items[state.right].name}`);
  }

  function setSplit(percent) {
    state.split = clamp(percent, 0, 100);
    showSplit();
  }

  function at(event) {
    const box = stage.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  // A mouse drags the divider from the point where it is pressed. A finger only drags after it has moved
  // sideways, so that a tap can place the magnifier and a vertical stroke can scroll the page.
  let press = null;
  stage.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    press = { x: event.clientX, dragging: event.pointerType === "mouse" };
    stage.setPointerCapture(event.pointerId);
    if (press.dragging) {
      event.preventDefault();
      divider.focus({ preventScroll: true, focusVisible: false });
      setSplit(at(event)[0] * 100);
    }
  });
  stage.addEventListener("pointermove", (event) => {
    if (press && Math.abs(event.clientX - press.x) > 6) press.dragging = true;
    if (press?.dragging) setSplit(at(event)[0] * 100);
    else if (!press) placeAt(event);
  });
  stage.addEventListener("pointerup", (event) => {
    if (press && !press.dragging) placeAt(event);
    press = null;
  });
  stage.addEventListener("pointercancel", () => { press = null; });

  divider.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? 10 : 1;
    const to = { ArrowLeft: state.split - step, ArrowDown: state.split - step, ArrowRight: state.split + step,
                 ArrowUp: state.split + step, PageDown: state.split - 10, PageUp: state.split + 10,
                 Home: 0, End: 100 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    setSplit(to);
  });

  // Magnifier ---------------------------------------------------------------------------------

  /** Width and height of what a tile shows, pixels of the picture: 4:3 like the tile, if they fit. */
  function region() {
    const fourths = Math.max(1, Math.round(tiles[0].firstElementChild.clientWidth / state.zoom / 4));
    return [Math.min(width, fourths * 4), Math.min(height, fourths * 3)];
  }

  function placeAt(event) {
    const [x, y] = at(event);
    place(x * width, y * height);
  }

  function place(x, y) {
    state.spot = [clamp(Math.floor(x), 0, width - 1), clamp(Math.floor(y), 0, height - 1)];
    drawTiles();
  }

  let drawing = 0;
  function drawTiles() {
    drawing ||= requestAnimationFrame(() => {
      drawing = 0;
      const [w, h] = region();
      const left = clamp(state.spot[0] - Math.floor(w / 2), 0, width - w);
      const top = clamp(state.spot[1] - Math.floor(h / 2), 0, height - h);
      tiles.forEach((tile, i) => drawTile(tile.firstElementChild, picture(i), left, top, w, h));
      Object.assign(reticle.style, { left: `${left / width * 100}%`, top: `${top / height * 100}%`,
                                     width: `${w / width * 100}%`, height: `${h / height * 100}%` });
      reticle.setAttribute("aria-label",
        `Magnifier at column ${state.spot[0]}, row ${state.spot[1]}; arrow keys move it`);
    });
  }

  function drawTile(canvas, image, left, top, w, h) {
    const box = canvas.getBoundingClientRect();
    const size = [box.width, box.height].map((v) => Math.max(1, Math.round(v * devicePixelRatio)));
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, ...size);
    if (!image.complete || !image.naturalWidth) return;
    context.imageSmoothingEnabled = false;
    // Pixels stay square even if the region was clamped at the edge of the picture.
    const scale = Math.min(size[0] / w, size[1] / h);
    context.drawImage(image, left, top, w, h, (size[0] - w * scale) / 2, (size[1] - h * scale) / 2, w * scale, h * scale);
  }

  reticle.addEventListener("keydown", (event) => {
    const direction = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!direction) return;
    event.preventDefault();
    const step = event.shiftKey ? region()[0] : Math.max(1, Math.round(region()[0] / 8));
    place(state.spot[0] + direction[0] * step, state.spot[1] + direction[1] * step);
  });

  // Controls ----------------------------------------------------------------------------------

  for (const name of ["left", "right"])
    sides[name].select.addEventListener("change", (event) => {
      state[name] = Number(event.target.value);
      showSides();
    });
  $("swap").addEventListener("click", () => {
    [state.left, state.right] = [state.right, state.left];
    showSides();
  });
  $("kinds").addEventListener("change", (event) => {
    state.kind = event.target.value;
    showSides();
  });
  $("zooms").addEventListener("change", (event) => {
    state.zoom = Number(event.target.value);
    drawTiles();
  });
  tiles.forEach((tile, i) => tile.addEventListener("click", () => {
    state[i === 0 ? "left" : "right"] = i;
    showSides();
  }));
  new ResizeObserver(drawTiles).observe(stage);

  /** Shows an item beside the truth, up in the viewer. */
  function view(index, kind, spot) {
    Object.assign(state, { left: 0, right: index || state.right, kind: labels[kind] ? kind : "color" });
    if (spot) state.spot = [...spot];
    if (kind === "difference" || kind === "error") state.split = Math.min(state.split, 50);
    showSides();
    $("compare").scrollIntoView();
  }
  for (const link of document.querySelectorAll("a[data-item]"))
    link.addEventListener("click", (event) => {
      if (event.button || event.ctrlKey || event.metaKey || event.shiftKey || event.altKey) return;
      event.preventDefault();
      view(Number(link.dataset.item), link.dataset.kind);
    });
  for (const button of document.querySelectorAll(".worst"))
    button.addEventListener("click", () => {
      const index = Number(button.dataset.item);
      view(index, state.kind, data.items[index].spot);
    });

  showSides();
})();
